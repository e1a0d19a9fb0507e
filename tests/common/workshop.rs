//! A folder of its own, and the binary run in it.

// Every test binary uses its own part of this.
#![allow(dead_code)]

use assert_cmd::Command;
use image::{GrayImage, Luma};
use std::{
    fs,
    path::{Path, PathBuf},
};

pub(crate) const FINE: i32 = 0;
pub(crate) const FILE: i32 = 1;
pub(crate) const REFUSED: i32 = 2;
pub(crate) const SHORT: i32 = 3;
pub(crate) const MESH: i32 = 4;

pub(crate) struct Workshop {
    folder: tempfile::TempDir,
}

pub(crate) struct Outcome {
    pub(crate) code: i32,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl Workshop {
    /// A folder with a `picture.png` in it.
    pub(crate) fn new() -> Self {
        let workshop = Self { folder: tempfile::tempdir().unwrap() };
        GrayImage::from_fn(48, 32, |x, y| Luma([(40 + (x * 4) % 200 / 2 + y * 3) as u8]))
            .save(workshop.path("picture.png"))
            .unwrap();
        workshop
    }

    pub(crate) fn root(&self) -> &Path {
        self.folder.path()
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn run(&self, line: &str) -> Outcome {
        let mut command = Command::cargo_bin("glasswarp").unwrap();
        let output = command.current_dir(self.folder.path()).args(line.split_whitespace()).output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        let (out, err) = (text(output.stdout), text(output.stderr));
        assert!(!err.contains("panicked"), "{line}: {err}");
        Outcome { code: output.status.code().expect("an exit code"), out, err }
    }

    /// The names of all files but the folder's record.
    pub(crate) fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.folder.path()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<_> = entries.filter(|name| name != ".glasswarp.sha256").collect();
        names.sort();
        names
    }

    /// Runs a command that must be refused, with an error that contains every one of `words`,
    /// leaving no file behind.
    pub(crate) fn refuses(&self, line: &str, code: i32, words: &[&str]) {
        let before = self.files();
        let outcome = self.run(line);
        assert_eq!(outcome.code, code, "{line}\n{}{}", outcome.out, outcome.err);
        for word in words {
            assert!(outcome.err.contains(word), "{line}: '{word}' is not in\n{}", outcome.err);
        }
        assert_eq!(self.files(), before, "{line} left something behind");
    }

    /// Draws `chiral.png`, a picture that no mirror image or turn of itself resembles, wider than
    /// tall.
    pub(crate) fn draw_chiral_picture(&self) {
        let tone = |x: u32, y: u32| {
            let (u, v) = (f64::from(x) / 48.0, f64::from(y) / 32.0);
            let spot = |a: f64, b: f64, r: f64| (-((u - a).powi(2) + (v - b).powi(2)) / (r * r)).exp();
            60.0 + 130.0 * spot(0.25, 0.3, 0.2) + 90.0 * spot(0.75, 0.2, 0.12) + 60.0 * spot(0.35, 0.8, 0.15)
        };
        GrayImage::from_fn(48, 32, |x, y| Luma([tone(x, y) as u8])).save(self.path("chiral.png")).unwrap();
    }
}
