//! What a plan lets be written: never over an input, and over a file of somebody's own only by force.

use glasswarp_files::{NAME, Plan, PlanError, WriteError, enter, may_replace, write_atomically};
use std::{
    fs,
    io::Write as _,
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

/// A plan is in force for the whole process: one test at a time.
static ALONE: Mutex<()> = Mutex::new(());

struct Folder {
    folder: tempfile::TempDir,
    _alone: MutexGuard<'static, ()>,
}

impl Folder {
    fn new() -> Self {
        let alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        Self { folder: tempfile::tempdir().unwrap(), _alone: alone }
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A file of somebody's own.
    fn own(&self, name: &str) -> PathBuf {
        fs::write(self.at(name), "somebody's").unwrap();
        self.at(name)
    }

    fn says(&self, name: &str) -> String {
        fs::read_to_string(self.at(name)).unwrap()
    }
}

fn write(path: &Path, text: &str) -> Result<(), WriteError> {
    write_atomically(path, |out| out.write_all(text.as_bytes()))
}

#[test]
fn nothing_is_written_once_nobody_waits_for_it() {
    let folder = Folder::new();
    let wanted = Arc::new(AtomicBool::new(true));
    let asked = Arc::clone(&wanted);
    let plan = Plan::new(false).writes(folder.at("a")).writes(folder.at("b"));
    plan.as_long_as(move || asked.load(Ordering::Relaxed)).approve().unwrap();
    write(&folder.at("a"), "whole").unwrap();
    // Also one that has begun.
    let begun = write_atomically(&folder.at("b"), |out| {
        wanted.store(false, Ordering::Relaxed);
        out.write_all(b"whole")
    });
    assert!(begun.is_err() && !folder.at("b").exists());
    let refused = write(&folder.at("b"), "whole").unwrap_err();
    assert!(matches!(&refused, WriteError::Refused { refusal } if matches!(**refusal, PlanError::Unwanted { .. })));
    assert_eq!(folder.says("a"), "whole");
    approve(&[], &[], false).unwrap();
    write(&folder.at("b"), "again").unwrap();
}

fn approve(inputs: &[&Path], outputs: &[&Path], force: bool) -> Result<(), PlanError> {
    let plan = inputs.iter().fold(Plan::new(force), |plan, path| plan.reads(*path));
    outputs.iter().fold(plan, |plan, path| plan.writes(*path)).approve()
}

#[test]
fn what_was_written_is_renewed_and_what_was_changed_is_kept() {
    let folder = Folder::new();
    let path = folder.at("a.stl");
    for text in ["first", "second", "second"] {
        approve(&[], &[&path], false).unwrap();
        write(&path, text).unwrap();
        assert_eq!(folder.says("a.stl"), text);
    }
    fs::write(&path, "second, and a word of mine").unwrap();
    let error = approve(&[], &[&path], false).unwrap_err();
    assert!(matches!(error, PlanError::Owned { .. }), "{error}");
    assert!(error.to_string().contains("has been changed since glasswarp wrote it: write to another name"), "{error}");
    approve(&[], &[&path], true).unwrap();
    write(&path, "third").unwrap();
    approve(&[], &[&path], false).expect("by force it became the program's own");
    // The record itself is as sha256sum reads it.
    let line = folder.says(NAME).lines().last().unwrap().to_owned();
    assert_eq!(line, format!("{}  a.stl", glasswarp_files::sha256(&path).unwrap()));
}

#[test]
fn files_of_others_stay_without_force() {
    let folder = Folder::new();
    let (mine, new) = (folder.own("mine.png"), folder.at("new.stl"));
    let error = approve(&[], &[&new, &mine], false).unwrap_err().to_string();
    assert!(error.contains("mine.png was not written by glasswarp") && error.contains("--force"), "{error}");
    assert!(!new.exists(), "nothing is begun");
    // A file that appears while the work is done is held to the rule, too.
    approve(&[], &[&new], false).unwrap();
    fs::write(&new, "somebody was quicker").unwrap();
    assert!(matches!(write(&new, "ours"), Err(WriteError::Refused { .. })));
    assert_eq!(folder.says("new.stl"), "somebody was quicker");
    // And so is one that the plan forgot.
    assert!(matches!(write(&mine, "ours"), Err(WriteError::Refused { .. })));
    approve(&[], &[&mine], true).unwrap();
    write(&mine, "ours").unwrap();
    assert_eq!(folder.says("mine.png"), "ours");
}

#[test]
fn inputs_stay_even_by_force_and_however_they_are_spelt() {
    let folder = Folder::new();
    let input = folder.own("in.png");
    fs::create_dir(folder.at("sub")).unwrap();
    let mut spellings = vec![folder.at("in.png"), folder.at("./in.png"), folder.at("sub/../in.png")];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(&input, folder.at("soft.png")).unwrap();
        fs::hard_link(&input, folder.at("hard.png")).unwrap();
        std::os::unix::fs::symlink(folder.at("sub"), folder.at("way")).unwrap();
        spellings.extend([folder.at("soft.png"), folder.at("hard.png"), folder.at("way/../in.png")]);
    }
    for output in &spellings {
        for force in [false, true] {
            let error = approve(&[&input], &[output], force).unwrap_err();
            assert!(matches!(error, PlanError::Input { .. }), "{}: {error}", output.display());
        }
    }
    approve(&[&input], &[&folder.at("out.png")], true).unwrap();
    for output in &spellings {
        assert!(matches!(may_replace(output), Err(PlanError::Input { .. })), "{}", output.display());
    }
    assert_eq!(folder.says("in.png"), "somebody's");
    // An input that is an output of before is no less an input.
    write(&folder.at("out.png"), "ours").unwrap();
    assert!(matches!(approve(&[&folder.at("out.png")], &[&folder.at("out.png")], true), Err(PlanError::Input { .. })));
}

#[test]
fn outputs_must_not_be_one_file() {
    let folder = Folder::new();
    fs::create_dir(folder.at("sub")).unwrap();
    let same = |first: &str, second: &str| approve(&[], &[&folder.at(first), &folder.at(second)], true).unwrap_err();
    for (first, second) in [("a.stl", "a.stl"), ("a.stl", "./a.stl"), ("sub/../a.stl", "a.stl")] {
        assert!(matches!(same(first, second), PlanError::Same { .. }), "{first} {second}");
    }
    assert!(matches!(same("a.stl", "A.stl"), PlanError::Case { .. }));
    #[cfg(unix)]
    {
        folder.own("one.stl");
        std::os::unix::fs::symlink(folder.at("one.stl"), folder.at("two.stl")).unwrap();
        assert!(matches!(same("one.stl", "two.stl"), PlanError::Same { .. }));
    }
}

#[test]
fn names_that_cannot_be_recorded_are_refused() {
    let folder = Folder::new();
    let error = approve(&[], &[&folder.at("a\nb.stl")], true).unwrap_err();
    assert!(error.to_string().contains("a\\nb.stl") && error.to_string().contains("line break"), "{error}");
    assert!(matches!(approve(&[&folder.at("a\tb.png")], &[], true), Err(PlanError::Name { .. })));
    #[cfg(unix)]
    {
        use std::os::unix::ffi::OsStrExt;
        let path = folder.folder.path().join(std::ffi::OsStr::from_bytes(b"a\xff.stl"));
        let error = approve(&[], &[&path], true).unwrap_err();
        assert!(error.to_string().contains("no UTF-8"), "{error}");
    }
}

#[cfg(unix)]
#[test]
fn a_file_that_was_protected_is_not_renewed() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::new();
    let path = folder.at("a.stl");
    approve(&[], &[&path], false).unwrap();
    write(&path, "first").unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o444)).unwrap();
    let error = approve(&[], &[&path], false).unwrap_err().to_string();
    assert!(error.contains("write-protected"), "{error}");
}

#[test]
fn what_a_helper_wrote_is_the_programs_own_once_it_is_entered() {
    let folder = Folder::new();
    approve(&[], &[&folder.at("a.stl")], false).unwrap();
    let log = folder.own("render.log");
    assert!(may_replace(&log).is_err());
    enter(&log).unwrap();
    may_replace(&log).unwrap();
}
