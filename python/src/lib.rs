//! glasswarp for Python: what the library does, as functions and classes of the extension module
//! `glasswarp._glasswarp`. It computes nothing. The package `glasswarp` around it, in Python, gives
//! it its shape.

mod arrays;
mod ask;
mod design;
mod fault;
mod listed;
mod rays;
mod slopes;
mod work;

use pyo3::prelude::*;
use std::ffi::OsString;

#[pymodule]
mod _glasswarp {
    #[pymodule_export]
    use super::{
        ask::ask,
        design::{Design, bench, design, restore},
        listed::listed,
        main,
        rays::trace,
        slopes::heights,
        tidy,
    };

    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}

/// Removes what is half-written, when the interpreter ends while work that nobody waits for goes on.
#[pyfunction]
fn tidy() {
    std::mem::forget(glasswarp::export::remove_unfinished());
}

/// Runs the command with these words, as the program does, and returns its exit code.
#[pyfunction]
fn main(py: Python<'_>, words: Vec<OsString>) -> u8 {
    py.detach(|| glasswarp::cli::run_with(words))
}
