//! Independent tools that judge what is exported.
//!
//! A test whose tool is missing says so past the test harness, and passes; with
//! `GLASSWARP_REQUIRE_TOOLS=1` it fails. Python is `$GLASSWARP_PYTHON` or `python3`; packages of
//! node are looked for in `$GLASSWARP_NODE_MODULES`, and where node looks by itself.

// Every test binary uses its own part of this.
#![allow(dead_code)]

pub(crate) mod measured;
pub(crate) mod workshop;

use std::{
    env,
    ffi::OsString,
    io::Write,
    process::{Command, Output, Stdio},
};

/// A program of the system, such as `admesh`; `package` says how to get it.
pub(crate) fn program(name: &str, package: &str) -> Option<Command> {
    // Every program answers to something: only whether it starts matters.
    let found = Command::new(name).arg("--version").output().is_ok();
    if found { Some(Command::new(name)) } else { missing(name, package) }
}

/// Where a browser is, by its usual names.
pub(crate) fn browser() -> Option<&'static str> {
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let found = names.into_iter().find(|name| Command::new(name).arg("--version").output().is_ok());
    found.or_else(|| program(names[0], "Debian package chromium").map(|_| names[0]))
}

/// Python with these modules, ready to run `script` with further arguments.
pub(crate) fn python(modules: &[&str], script: &str) -> Option<Command> {
    let interpreter = env::var_os("GLASSWARP_PYTHON").unwrap_or_else(|| OsString::from("python3"));
    let imports = modules.iter().map(|module| format!("import {module}\n")).collect::<String>();
    let command = |script: &str| {
        let mut command = Command::new(&interpreter);
        command.args(["-c", script]);
        command
    };
    if succeeds(command(&imports)) {
        return Some(command(script));
    }
    let what = format!("python ({}) with {}", interpreter.to_string_lossy(), modules.join(", "));
    missing(&what, "pip install; name the interpreter in GLASSWARP_PYTHON")
}

/// FreeCAD without a window, running a script; `None` if it is missing.
pub(crate) fn freecad(script: &str) -> Option<Command> {
    let mut command = program("freecadcmd", "Debian package freecad")?;
    // Without a locale of UTF-8 it crashes.
    command.env("LC_ALL", "C.UTF-8").arg("-c").arg(script).stdin(Stdio::null());
    Some(command)
}

/// Node with these modules, ready to run `script` with further arguments (`process.argv` from index
/// 1).
pub(crate) fn node(modules: &[&str], script: &str) -> Option<Command> {
    let command = |script: &str| {
        let mut command = Command::new("node");
        if let Some(path) = env::var_os("GLASSWARP_NODE_MODULES") {
            command.env("NODE_PATH", path);
        }
        command.args(["-e", script]);
        command
    };
    let imports = modules.iter().map(|module| format!("require('{module}');\n")).collect::<String>();
    if succeeds(command(&imports)) {
        return Some(command(script));
    }
    let what = format!("node with {}", modules.join(", "));
    missing(&what, "npm install; name the folder node_modules in GLASSWARP_NODE_MODULES")
}

/// Standard output of a tool.
///
/// # Panics
/// If it fails.
pub(crate) fn output(command: &mut Command) -> String {
    let Output { status, stdout, stderr } = command.output().expect("the tool was there a moment ago");
    let (stdout, stderr) = (String::from_utf8_lossy(&stdout), String::from_utf8_lossy(&stderr));
    assert!(status.success(), "{command:?} failed with {status}:\n{stdout}\n{stderr}");
    stdout.into_owned()
}

fn succeeds(mut command: Command) -> bool {
    command.output().is_ok_and(|output| output.status.success())
}

fn missing(what: &str, remedy: &str) -> Option<Command> {
    let test = std::thread::current().name().unwrap_or("a test").to_owned();
    let message = format!("\n*** DID NOT RUN: {test} needs {what} ({remedy}) ***\n");
    assert!(env::var_os("GLASSWARP_REQUIRE_TOOLS").is_none_or(|value| value != "1"), "{message}");
    // Not `eprintln!`: the harness would swallow that of a test that passes.
    let _ = std::io::stderr().write_all(message.as_bytes());
    None
}
