//! `glasswarp-bindgen MODULE.wasm FOLDER`: the JavaScript side of a module, for a page.
//!
//! What wasm-bindgen's own program does, as a package beside the module's: one lock gives both the
//! same version, as they must have.

use std::process::ExitCode;
use wasm_bindgen_cli_support::Bindgen;

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().skip(1).collect();
    let [module, folder] = arguments.as_slice() else {
        eprintln!("usage: glasswarp-bindgen MODULE.wasm FOLDER");
        return ExitCode::from(2);
    };
    let written =
        Bindgen::new().input_path(module).typescript(true).web(true).and_then(|bindgen| bindgen.generate(folder));
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error:#}");
            ExitCode::FAILURE
        }
    }
}
