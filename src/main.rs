//! The command line of glasswarp.
fn main() {}
