//! The command line of glasswarp.

fn main() -> std::process::ExitCode {
    glasswarp::cli::run()
}
