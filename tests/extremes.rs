//! Every number of every command at its extremes: an answer or a refusal, soon, and never a panic.

#[path = "common/workshop.rs"]
mod workshop;

use std::{
    process::{Command, Stdio},
    thread,
    time::{Duration, Instant},
};
use workshop::{FINE, Workshop};

/// What is tried in the place of every number; those that ask for much work, and may have it, are
/// not among them. Bare numbers are millimetres, degrees, nanometres.
const NUMBERS: [&str; 11] =
    ["nan", "inf", "-inf", "-1", "-0", "0", "1e-300", "1e300", "-1e300", "4294967296", "18446744073709551616"];

/// Longest that a run may take: hundreds of times what the slowest takes alone.
const LONGEST: Duration = Duration::from_secs(120);

/// Commands with what they need, and what of it goes if the flag itself is given.
const COMMANDS: [(&str, &[&str], &[&str]); 7] = [
    ("design", &["design", "picture.png", "--no-report", "-o", "e.stl"], &["--no-verify", "--nodes", "17"]),
    ("preview", &["preview", "picture.png", "-o", "e.html"], &["--nodes", "17"]),
    ("verify", &["verify", "b.stl"], &["--photons", "2000"]),
    (
        "verify",
        &["verify", "alone/b.stl"],
        &["--photons", "2000", "--ior", "1.5", "--distance", "250", "--pixels", "16"],
    ),
    ("check", &["check", "b.stl", "--tolerance"], &["--pixels", "16"]),
    ("mill", &["mill", "b.stl"], &["--pixels", "16", "--step-over", "2"]),
    ("crosscheck", &["crosscheck", "b.stl", "--with", "povray", "--write-only", "--scene", "e"], &["--pixels", "64"]),
];

/// The flags of a command that take a value, with its name, as the help tells them.
fn flags(shop: &Workshop, command: &str) -> Vec<(String, String)> {
    let help = shop.run(&format!("{command} --help"));
    assert_eq!(help.code, FINE);
    let flag = |line: &str| {
        let (flag, rest) =
            line.trim().strip_prefix("-o, ").unwrap_or(line.trim()).strip_prefix("--")?.split_once(" <")?;
        Some((format!("--{flag}"), rest.split_once('>')?.0.to_owned()))
    };
    help.out.lines().filter_map(flag).collect()
}

/// What a value of this name looks like with a number in its place; nothing if it holds none.
fn written(value: &str, number: &str) -> Vec<String> {
    match value {
        "FILE" | "DIR" | "PICTURE" | "NAME" | "KIND" | "CURVE" | "PLACE" | "RENDERER" | "MODE" | "BOOL" | "SHELL" => {
            Vec::new()
        }
        "CUTTER" => vec![
            format!("ball:{number}"),
            format!("ball:d{number}"),
            format!("bull:{number},r{number}"),
            format!("flat:{number}"),
        ],
        "SHAPE" => vec![format!("circle:{number}"), format!("rounded:{number}")],
        "HOW" => vec![format!("gaussian:{number}")],
        "FINISH" => vec![
            format!("polish={number}"),
            format!("polish=0.1mm,gain={number}"),
            format!("cutter=ball:{number},step-over={number}"),
        ],
        "K/N" => vec![format!("{number}/{number}"), format!("1/{number}")],
        "WHAT=FROM..TO" => ["distance", "size", "thickness", "index", "nodes"]
            .iter()
            .flat_map(|what| [format!("{what}={number}..{number}"), format!("{what}=1..{number}")])
            .collect(),
        "PICTURE,LENGTH" => vec![format!("picture.png,{number}")],
        "RIGHT,UP" | "WIDTH,HEIGHT" => vec![format!("{number},{number}"), format!("10,{number}")],
        "ANGLE[,SIDE]" => vec![number.to_owned(), format!("10,{number}")],
        "SIZE" => vec![number.to_owned(), format!("{number}x{number}"), format!("{number}mm"), format!("{number}deg")],
        _ => vec![number.to_owned()],
    }
}

/// Runs a command; its exit code and what it says.
fn run(shop: &Workshop, arguments: &[String]) -> (Option<i32>, String) {
    // No run may take what the machine has.
    run_within(400, shop, arguments)
}

/// The same with so much memory free.
fn run_within(megabytes: u32, shop: &Workshop, arguments: &[String]) -> (Option<i32>, String) {
    let mut child = Command::new(assert_cmd::cargo::cargo_bin!("glasswarp"))
        .current_dir(shop.root())
        .env("GLASSWARP_MEMORY", megabytes.to_string())
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(std::fs::File::create(shop.path("said")).unwrap())
        .spawn()
        .unwrap();
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if start.elapsed() > LONGEST {
            child.kill().unwrap();
            child.wait().unwrap();
            panic!("{} took longer than {LONGEST:?}", arguments.join(" "));
        }
        thread::sleep(Duration::from_millis(2));
    };
    (status.code(), std::fs::read_to_string(shop.path("said")).unwrap())
}

fn try_command(k: usize) {
    let shop = Workshop::new();
    assert_eq!(shop.run("design picture.png --nodes 17 --no-verify --no-report --material pmma -o b.stl").code, FINE);
    std::fs::create_dir(shop.path("alone")).unwrap();
    std::fs::copy(shop.path("b.stl"), shop.path("alone/b.stl")).unwrap();
    let (command, always, usually) = COMMANDS[k];
    let flags = flags(&shop, command);
    assert!(flags.len() > 5, "{flags:?}");
    let mut tried = 0;
    for (flag, value) in flags {
        for number in NUMBERS {
            for written in written(&value, number) {
                let mut arguments: Vec<String> = always.iter().map(|&word| word.to_owned()).collect();
                let mut words = usually.iter().peekable();
                while let Some(&word) = words.next() {
                    let mut group = vec![word.to_owned()];
                    group.extend(words.next_if(|word| !word.starts_with("--")).map(|&word| word.to_owned()));
                    if group[0] != flag {
                        arguments.extend(group);
                    }
                }
                arguments.push(format!("{flag}={written}"));
                let (code, said) = run(&shop, &arguments);
                assert!(
                    matches!(code, Some(0..=4)) && !said.contains("panicked"),
                    "{} ended with {code:?}:\n{said}",
                    arguments.join(" ")
                );
                tried += 1;
            }
        }
    }
    println!("{command}: {tried} extremes");
    assert!(tried >= 40, "{tried}");
}

#[test]
fn of_design() {
    try_command(0);
}

#[test]
fn of_preview() {
    try_command(1);
}

#[test]
fn of_verify() {
    try_command(2);
}

#[test]
fn of_verify_without_a_side_file() {
    try_command(3);
}

#[test]
fn of_check() {
    try_command(4);
}

#[test]
fn of_mill() {
    try_command(5);
}

#[test]
fn of_crosscheck() {
    try_command(6);
}

/// A window of many more pixels than anything holds is refused by their number, not found out while
/// they are filled.
#[test]
fn more_pixels_than_a_window_holds_are_refused() {
    let shop = Workshop::new();
    assert_eq!(shop.run("design picture.png --nodes 17 --no-verify --no-report -o b.stl").code, FINE);
    std::fs::create_dir(shop.path("alone")).unwrap();
    std::fs::copy(shop.path("b.stl"), shop.path("alone/b.stl")).unwrap();
    let line = "verify alone/b.stl --ior 1.5 --distance 250mm --window 100mmx200mm --pixels 8192";
    shop.refuses(line, workshop::REFUSED, &["number of pixels of the window", "134217728", "67108864"]);
    // A narrow window without a picture gets fewer across, and says so.
    let narrow = shop.run("verify alone/b.stl --ior 1.5 --distance 250mm --window 1mmx1000mm --pixels 8192");
    assert!(narrow.code == FINE && narrow.out.contains("(366 x 32768 pixels)"), "{}{}", narrow.out, narrow.err);
}

/// Work beyond the memory that is free is refused by name before it is begun, with what would fit,
/// which is let through.
#[test]
fn previews_looks_and_sweeps_beyond_the_memory_are_refused() {
    let shop = Workshop::new();
    assert_eq!(shop.run("design picture.png --nodes 17 --no-verify --no-report -o b.stl").code, FINE);
    std::fs::create_dir(shop.path("alone")).unwrap();
    std::fs::copy(shop.path("b.stl"), shop.path("alone/b.stl")).unwrap();
    let run = |line: &str, number: &str| {
        let arguments: Vec<String> = format!("{line}{number}").split(' ').map(str::to_owned).collect();
        run_within(120, &shop, &arguments)
    };
    for (line, flag) in [
        ("preview picture.png -o e.html --nodes ", "--nodes "),
        ("verify alone/b.stl --ior 1.5 --distance 250mm --photons 2000 --pixels ", "--pixels "),
        ("verify b.stl --steps 2 --sweep nodes=4096..", "--nodes "),
    ] {
        let (code, said) = run(line, "8192");
        assert_eq!(code, Some(workshop::REFUSED), "{line}: {said}");
        for words in ["takes about", "of memory, and 120 MB are free", "take at most", flag, "--ignore-memory"] {
            assert!(said.contains(words), "{line}: {said}");
        }
        if line.ends_with(flag) {
            let advised = said.split("take at most ").nth(1).and_then(|rest| rest.split([' ', ',']).nth(1)).unwrap();
            let (code, said) = run(line, advised);
            assert!(code != Some(workshop::REFUSED) && !said.contains("takes about"), "{line}{advised}: {said}");
            let more = (advised.parse::<u32>().unwrap() + 8).to_string();
            assert_eq!(run(line, &more).0, Some(workshop::REFUSED), "{line}: more would have fitted than {advised}");
        }
    }
}
