//! glasswarp in a page: what the command line does with a disk, done with bytes that were dropped
//! on it.
//!
//! A [`Studio`] holds the files of a page and the block that was designed last. Settings come in as
//! a JSON object with the names of design files; whatever is found out goes out as an object with
//! `facts` (plain data) and `arrays` (typed arrays). Nothing is computed here: every figure is what
//! the library's own functions say.

mod catalogue;
mod files;
mod host;
mod made;
mod page_progress;
mod reply;
mod settings;
mod shop;
mod studio;
mod threads;

pub use catalogue::{catalogue, fault_of, read_design};
pub use studio::Studio;
pub use threads::{start_threads, work_as_thread};
