//! Walks through docs/tutorial.md: every command in it is run, in order, in one folder, with a
//! smaller picture.
#![cfg(unix)]

use image::imageops::FilterType;
use std::{fs, path::Path, process::Command};

#[test]
fn every_command_of_the_tutorial_works() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let read = |page: &str| fs::read_to_string(root.join("docs").join(page)).unwrap();
    // The settings are tried on the tutorial's picture.
    let page = read("tutorial.md") + &read("settings.md");
    let folder = tempfile::tempdir().unwrap();
    let small = image::open(root.join("samples/camera/target.png")).unwrap().resize_exact(48, 48, FilterType::Triangle);
    fs::create_dir_all(folder.path().join("samples/camera")).unwrap();
    small.save(folder.path().join("samples/camera/target.png")).unwrap();
    let programs = assert_cmd::cargo::cargo_bin!("glasswarp").parent().unwrap().to_path_buf();
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap());
    let scripts: Vec<&str> =
        page.split("```sh\n").skip(1).map(|rest| rest.split("```").next().unwrap_or_default()).collect();
    assert!(scripts.len() >= 10);
    for script in scripts {
        let shell = ["-e", "-c", script];
        let output = Command::new("sh").args(shell).current_dir(folder.path()).env("PATH", &path).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        // A check that finds something wrong with so small a picture has still been made.
        let judges = ["glasswarp check", "glasswarp ready"].iter().any(|command| script.contains(command));
        let fell_short = judges && output.status.code() == Some(3);
        assert!(output.status.success() || fell_short, "{script}\n{said}");
    }
    for picture in page.split("](figures/").skip(1).filter_map(|rest| rest.split(')').next()) {
        assert!(root.join("docs/figures").join(picture).exists(), "{picture} is missing");
    }
    for made in [
        "portrait.preview.html",
        "portrait.panel.png",
        "portrait.contours.png",
        "portrait.ready.html",
        "check.png",
        "steps.png",
        "final.drawing.png",
        "final.ready.html",
        "final.toml",
        "window.panel.png",
        "torch.panel.png",
        "laser.panel.png",
    ] {
        assert!(folder.path().join(made).exists(), "{made} is missing");
    }
}

#[test]
fn the_gallery_shows_every_sample() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = fs::read_to_string(root.join("docs/gallery.md")).unwrap();
    for sample in fs::read_dir(root.join("samples")).unwrap().map(|entry| entry.unwrap()) {
        if sample.path().join("design.toml").exists() {
            let name = sample.file_name().into_string().unwrap();
            assert!(page.contains(&format!("samples/{name}/design.toml")), "{name}");
            assert!(root.join(format!("docs/figures/gallery-{name}.png")).exists(), "{name}");
        }
    }
}
