//! The command line of glasswarp.

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
