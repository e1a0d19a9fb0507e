//! A run that ends too early, of whatever cause: files of its outputs are the older ones or the
//! whole new ones, and the next run makes what it should have made.
#![cfg(unix)]

#[path = "common/workshop.rs"]
mod workshop;

use std::{
    collections::BTreeMap,
    fs,
    os::unix::{fs::PermissionsExt, process::CommandExt},
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    thread,
    time::{Duration, Instant},
};
use workshop::{FILE, FINE, Workshop};

const DESIGN: &str = "design --pictures picture.png --nodes 33 -o block.stl -o block.3mf --height-map block.exr";
/// The same files from another bench: what lies there before.
const OLDER: &str =
    "design --pictures picture.png --nodes 17 --distance 300mm -o block.stl -o block.3mf --height-map block.exr";

fn binary() -> PathBuf {
    assert_cmd::cargo::cargo_bin!("glasswarp").to_path_buf()
}

fn command(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(binary());
    command
        .current_dir(folder)
        .args(line.split_whitespace())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    command
}

/// Names and contents.
type Files = BTreeMap<String, Vec<u8>>;

/// The visible files of a folder and what is in them; hidden ones by name only. Of a report, which
/// tells the time that it took, whether it is whole.
fn contents(folder: &Path) -> (Files, Vec<String>) {
    let (mut files, mut hidden) = (BTreeMap::new(), Vec::new());
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let name = entry.file_name().into_string().unwrap();
        if name == glasswarp_files::NAME {
            continue;
        } else if name.starts_with('.') {
            hidden.push(name);
        } else {
            let mut bytes = fs::read(entry.path()).unwrap();
            if name.ends_with(".html") {
                bytes = bytes.trim_ascii_end().ends_with(b"</html>").to_string().into_bytes();
            }
            files.insert(name, bytes);
        }
    }
    (files, hidden)
}

/// Two workshops with the older and the new files of the same names, and the time that a run takes.
fn before_and_after() -> (Files, Files, Duration) {
    let made = |line| {
        let shop = Workshop::new();
        assert_eq!(shop.run(line).code, FINE);
        contents(shop.root()).0
    };
    let older = made(OLDER);
    let start = Instant::now();
    let new = made(DESIGN);
    let took = start.elapsed();
    assert_eq!(older.keys().collect::<Vec<_>>(), new.keys().collect::<Vec<_>>());
    (older, new, took)
}

/// Puts files into a folder, as an earlier run would have: they may be renewed.
fn furnish(folder: &Path, files: &Files) {
    let mut record = String::new();
    for (name, bytes) in files {
        let whole: &[u8] = if name.ends_with(".html") { b"</html>" } else { bytes };
        fs::write(folder.join(name), whole).unwrap();
        record += &format!("{}  {name}\n", glasswarp_files::sha256(&folder.join(name)).unwrap());
    }
    fs::write(folder.join(glasswarp_files::NAME), record).unwrap();
}

/// Ends runs at moments that are spread over their time, and looks at what they leave; then at what
/// the next run makes of it.
fn ends_at_any_moment(signal: &str, moments: std::ops::Range<u32>, of: u32) {
    let (older, new, took) = before_and_after();
    let mut early = 0;
    for moment in moments {
        let shop = Workshop::new();
        furnish(shop.root(), &older);
        let mut child = command(shop.root(), DESIGN).spawn().unwrap();
        // Moments that no regular step of the program could keep in time with.
        let spread =
            (f64::from(moment) + 0.5) / f64::from(of) + 0.3 * (f64::from(moment) * 0.618).fract() / f64::from(of);
        thread::sleep(took.mul_f64(spread));
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().is_ok());
        let status = child.wait().unwrap();
        early += u32::from(!status.success());
        let (left, hidden) = contents(shop.root());
        assert_eq!(left.keys().collect::<Vec<_>>(), new.keys().collect::<Vec<_>>(), "moment {moment}");
        for (name, bytes) in &left {
            assert!(bytes == &older[name] || bytes == &new[name], "moment {moment}: {name} is neither old nor new");
        }
        if signal != "-KILL" {
            assert!(hidden.is_empty(), "moment {moment}: {hidden:?} was left");
            assert!(matches!(status.code(), Some(0 | 130)), "moment {moment}: {status}");
        }
        assert_eq!(shop.run(DESIGN).code, FINE);
        let (again, hidden) = contents(shop.root());
        assert!(again == new, "moment {moment}: the next run makes something else");
        assert!(hidden.is_empty(), "moment {moment}: {hidden:?} was left by two runs");
    }
    // Under load a run takes longer than the one that was timed; it never takes much less.
    assert!(early > 0, "every run was over before its end");
}

#[test]
fn a_run_that_is_killed_leaves_old_files_or_new_ones() {
    ends_at_any_moment("-KILL", 0..25, 50);
}

#[test]
fn a_run_that_is_killed_late_leaves_old_files_or_new_ones() {
    ends_at_any_moment("-KILL", 25..50, 50);
}

#[test]
fn an_interrupted_run_leaves_old_files_or_new_ones_and_nothing_else() {
    ends_at_any_moment("-INT", 0..12, 12);
}

/// What a run leaves that could not write all of its files.
fn assert_untouched(shop: &Path, output: &Output, older: &Files, new: &Files) {
    let (text, (left, hidden)) = (String::from_utf8_lossy(&output.stderr), contents(shop));
    assert_eq!(output.status.code(), Some(FILE), "{text}");
    assert!(text.contains("error:") && !text.contains("panicked"), "{text}");
    assert!(hidden.is_empty(), "{hidden:?} was left");
    for (name, bytes) in &left {
        assert!(older.get(name) == Some(bytes) || new.get(name) == Some(bytes), "{name} is neither old nor new");
    }
    assert!(older.keys().all(|name| left.contains_key(name)), "an older file is gone");
    assert!(left != *new, "nothing was missing");
}

#[test]
fn files_that_must_not_grow_stay_as_they_were() {
    let (older, new, _) = before_and_after();
    // In blocks of 512 bytes: below every file, below the block, below the largest only.
    for limit in [1, 40, 100] {
        let shop = Workshop::new();
        furnish(shop.root(), &older);
        // A process that ignores the signal is told by an error instead.
        let script = format!("trap '' XFSZ; ulimit -f {limit}; exec \"$0\" \"$@\"");
        let output = Command::new("sh")
            .args(["-c", &script])
            .arg(binary())
            .args(DESIGN.split_whitespace())
            .current_dir(shop.root())
            .output()
            .unwrap();
        assert_untouched(shop.root(), &output, &older, &new);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_old_files_or_new_ones() {
    let (older, new, _) = before_and_after();
    let shop = Workshop::new();
    let disk = shop.path("disk");
    fs::create_dir(&disk).unwrap();
    let old_size: usize = older.values().map(|bytes| bytes.len().next_multiple_of(4096)).sum();
    // Room for the older files, and for some of the new ones beside them.
    let size = format!("size={}", old_size + 200_000);
    let mounted = Command::new("mount").args(["-t", "tmpfs", "-o", &size, "tmpfs"]).arg(&disk).output();
    if !mounted.is_ok_and(|output| output.status.success()) {
        eprintln!(
            "\n*** DID NOT RUN: a_full_disk_leaves_old_files_or_new_ones needs the right to mount a small disk ***\n"
        );
        return;
    }
    let result = std::panic::catch_unwind(|| {
        furnish(&disk, &older);
        fs::write(disk.join("filler"), vec![0; 120_000]).unwrap();
        let mut full = older.clone();
        full.insert("filler".into(), vec![0; 120_000]);
        let output = Command::new(binary()).args(DESIGN.split_whitespace()).current_dir(&disk).output().unwrap();
        assert!(
            String::from_utf8_lossy(&output.stderr).contains("space"),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        assert_untouched(&disk, &output, &full, &new);
        // With room again, the same run succeeds.
        fs::remove_file(disk.join("filler")).unwrap();
        let remount = format!("remount,size={}", 4 * old_size + 1_000_000);
        assert!(Command::new("mount").args(["-o", &remount]).arg(&disk).status().unwrap().success());
        assert!(command(&disk, DESIGN).status().unwrap().success());
        assert!(contents(&disk).0 == new);
    });
    assert!(Command::new("umount").arg(&disk).status().unwrap().success());
    if let Err(cause) = result {
        std::panic::resume_unwind(cause);
    }
}

#[test]
fn a_folder_that_takes_no_files_is_refused_before_the_work() {
    let shop = Workshop::new();
    let folder = shop.path("closed");
    fs::create_dir(&folder).unwrap();
    fs::write(folder.join("block.stl"), "old").unwrap();
    fs::copy(shop.path("picture.png"), folder.join("picture.png")).unwrap();
    let program = shop.path("program");
    fs::copy(binary(), &program).unwrap();
    fs::set_permissions(shop.root(), PermissionsExt::from_mode(0o755)).unwrap();
    fs::set_permissions(&folder, PermissionsExt::from_mode(0o555)).unwrap();
    let mut command = Command::new(program);
    command.current_dir(&folder).args(DESIGN.split_whitespace());
    // Nothing is closed to the administrator.
    if fs::write(folder.join("probe"), "").is_ok() {
        fs::remove_file(folder.join("probe")).unwrap();
        command.uid(65_534);
    }
    let output = command.output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(FILE), "{text}");
    assert!(text.contains("takes no new file"), "{text}");
    assert_eq!(fs::read_to_string(folder.join("block.stl")).unwrap(), "old");
    assert_eq!(contents(&folder).0.len(), 2);
    fs::set_permissions(&folder, PermissionsExt::from_mode(0o755)).unwrap();
}
