//! Every sample is made from its own file, at reduced size, and judged by tracing what was written.

mod common;

use assert_cmd::Command;
use common::measured::prints_within_tenth_of;
use std::{fs, path::Path};

/// The samples, and the relative RMS errors of their blocks of 193 nodes at 96 pixels across, as
/// measured.
const SAMPLES: [(&str, f64); 3] = [("camera", 0.0117), ("letter-f", 0.0142), ("rosette", 0.0011)];

#[test]
fn every_sample_makes_a_block_whose_light_draws_it() {
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples");
    let mut made = 0;
    for entry in fs::read_dir(&samples).unwrap() {
        let sample = entry.unwrap();
        let design = sample.path().join("design.toml");
        if !design.exists() {
            continue;
        }
        let name = sample.file_name().into_string().unwrap();
        let (_, measured) =
            SAMPLES.iter().find(|(sample, _)| *sample == name).unwrap_or_else(|| panic!("{name} is new"));
        let folder = tempfile::tempdir().unwrap();
        let glasswarp = |line: &str| {
            let line = line.replace("DESIGN", &design.to_string_lossy());
            let output = Command::cargo_bin("glasswarp")
                .unwrap()
                .current_dir(folder.path())
                .args(line.split(' '))
                .output()
                .unwrap();
            let text =
                format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
            assert!(output.status.success(), "{}: {text}", design.display());
            text
        };
        glasswarp("design DESIGN --nodes 193 --no-verify -o block.stl -o block.glb");
        let text = glasswarp("verify block.stl --pixels 96 --photons 200000");
        let error = text.lines().find_map(|line| line.trim().strip_prefix("relative RMS")).unwrap();
        prints_within_tenth_of(*measured, error.trim().parse().unwrap(), &name);
        assert!(text.contains("standard errors (up to 2 is expected"), "{text}");
        made += 1;
    }
    assert_eq!(made, SAMPLES.len());
}
