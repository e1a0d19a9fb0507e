//! The command line as a person types it.

mod common;

use assert_cmd::Command;
use common::workshop::{FILE, FINE, MESH, REFUSED, SHORT, Workshop};
use image::{GrayImage, Luma, LumaA, Rgba};
use std::{fs, path::Path};

#[test]
fn a_picture_becomes_files_of_every_format_with_a_side_file_and_pictures() {
    let workshop = Workshop::new();
    let outcome =
        workshop.run("design picture.png -o block.stl -o block.glb -o block.obj --nodes 97 --transfer linear");
    assert_eq!(outcome.code, FINE, "{}", outcome.err);
    for name in [
        "block.stl",
        "block.glb",
        "block.obj",
        "block.toml",
        "block.panel.png",
        "block.caustic.png",
        "block.difference.png",
        "block.contours.png",
    ] {
        assert!(fs::metadata(workshop.path(name)).is_ok_and(|m| m.len() > 100), "{name} of {:?}", workshop.files());
    }
    for word in ["relative RMS", "SSIM", "250 mm", "mean plane of the exit face", "100.00 x 66.67 mm"] {
        assert!(outcome.out.contains(word), "'{word}' is not in\n{}", outcome.out);
    }
    assert!(workshop.files().iter().all(|name| !name.contains(".part")));
}

#[test]
fn the_side_file_makes_the_same_block_again_bit_by_bit_on_any_number_of_threads() {
    let workshop = Workshop::new();
    assert_eq!(
        workshop
            .run("design picture.png -o a.stl --nodes 65 --no-verify --size 80mm --material pmma --offset 0.2")
            .code,
        FINE
    );
    for threads in ["1", "3"] {
        let mut command = Command::cargo_bin("glasswarp").unwrap();
        let again = command.current_dir(workshop.root()).env("RAYON_NUM_THREADS", threads);
        again.args(["design", "a.toml", "-o", "b.stl", "--no-verify"]).assert().success();
        assert!(
            fs::read(workshop.path("a.stl")).unwrap() == fs::read(workshop.path("b.stl")).unwrap(),
            "{threads} threads"
        );
    }
}

#[test]
fn verify_reads_the_bench_from_the_side_file_in_every_format() {
    let workshop = Workshop::new();
    assert_eq!(
        workshop.run("design picture.png -o block.stl -o block.obj -o block.glb --nodes 97 --no-verify").code,
        FINE
    );
    let mut errors = Vec::new();
    for block in ["block.stl", "block.obj", "block.glb"] {
        let outcome = workshop.run(&format!("verify {block} --target picture.png --photons 100000"));
        assert_eq!(outcome.code, FINE, "{}", outcome.err);
        assert!(outcome.err.is_empty(), "{}", outcome.err);
        let line = outcome.out.lines().find(|line| line.contains("relative RMS  ")).unwrap();
        errors.push(line.split_whitespace().last().unwrap().parse::<f64>().unwrap());
    }
    assert!(errors[0] < 0.1 && errors.iter().all(|e| (e - errors[0]).abs() < 2e-3), "{errors:?}");
    let wrong =
        workshop.run("verify block.stl --target picture.png --distance 200mm --max-error 0.05 --photons 100000");
    assert_eq!(wrong.code, SHORT, "{}", wrong.out);
    assert_eq!(workshop.run("verify block.stl -o light.exr -o light.png --photons 100000").code, FINE);
    assert!(workshop.path("light.exr").exists() && workshop.path("light.png").exists());
}

#[test]
fn verify_says_when_a_file_is_not_the_one_that_was_designed() {
    let workshop = Workshop::new();
    assert_eq!(workshop.run("design picture.png -o block.stl --nodes 65 --no-verify").code, FINE);
    let mut bytes = fs::read(workshop.path("block.stl")).unwrap();
    bytes[10] ^= 1; // in the header
    fs::write(workshop.path("block.stl"), &bytes).unwrap();
    let outcome = workshop.run("verify block.stl --photons 100000");
    assert!(outcome.err.contains("changed since"), "{}", outcome.err);
    bytes.truncate(bytes.len() - 1000);
    fs::write(workshop.path("block.stl"), &bytes).unwrap();
    workshop.refuses("verify block.stl", MESH, &["block.stl"]);
    fs::remove_file(workshop.path("block.toml")).unwrap();
    workshop.refuses("verify block.stl", REFUSED, &["side file", "--bench"]);
    workshop.refuses("verify nothing.stl", FILE, &["nothing.stl"]);
}

#[test]
fn pictures_of_every_kind_are_taken() {
    let workshop = Workshop::new();
    let level = |x: u32, y: u32| 60 + 3 * x as u8 + y as u8;
    image::ImageBuffer::from_fn(40, 40, |x, y| Luma([u16::from(level(x, y)) * 257]))
        .save(workshop.path("deep.png"))
        .unwrap();
    image::ImageBuffer::from_fn(40, 24, |x, y| Rgba([level(x, y), 90, 200, if x < 5 { 0 } else { 255 }]))
        .save(workshop.path("colour.png"))
        .unwrap();
    image::ImageBuffer::from_fn(24, 40, |x, y| LumaA([level(x, y), 200])).save(workshop.path("alpha.png")).unwrap();
    image::ImageBuffer::from_fn(33, 47, |x, y| image::Rgb([level(x, y), 90, 200]))
        .save(workshop.path("photo.jpg"))
        .unwrap();
    exr::prelude::write_rgb_file(workshop.path("light.exr"), 40, 40, |x, y| (0.5 + x as f32, 1.0, y as f32)).unwrap();
    for picture in ["deep.png", "colour.png", "alpha.png", "photo.jpg", "light.exr"] {
        let outcome = workshop.run(&format!("design {picture} -o block.stl --nodes 65 --distance 400"));
        assert_eq!(outcome.code, FINE, "{picture}: {}", outcome.err);
    }
}

#[test]
fn pictures_that_make_no_target_are_refused() {
    let workshop = Workshop::new();
    GrayImage::new(1, 1).save(workshop.path("dot.png")).unwrap();
    GrayImage::new(32, 32).save(workshop.path("black.png")).unwrap();
    fs::write(workshop.path("empty.png"), "").unwrap();
    fs::write(workshop.path("text.png"), "this is no picture").unwrap();
    let whole = fs::read(workshop.path("picture.png")).unwrap();
    fs::write(workshop.path("cut.png"), &whole[..whole.len() / 2]).unwrap();
    exr::prelude::write_rgb_file(workshop.path("nan.exr"), 16, 16, |x, _| {
        (if x == 3 { f32::NAN } else { 1.0 }, 1.0, 1.0)
    })
    .unwrap();
    workshop.refuses("design dot.png -o b.stl", REFUSED, &["1 x 1", "between 4 and"]);
    workshop.refuses("design black.png --offset 0 -o b.stl", REFUSED, &["black", "offset"]);
    workshop.refuses("design nan.exr -o b.stl", REFUSED, &["column 3", "NaN"]);
    workshop.refuses("design empty.png -o b.stl", FILE, &["empty.png"]);
    workshop.refuses("design text.png -o b.stl", FILE, &["text.png"]);
    workshop.refuses("design cut.png -o b.stl", FILE, &["cut.png"]);
    workshop.refuses("design nothing.png -o b.stl", FILE, &["nothing.png", "No such file"]);
    workshop.refuses("design . -o b.stl", FILE, &["directory"]);
}

#[test]
fn benches_that_make_no_sense_are_refused_with_the_value_and_its_limit() {
    let workshop = Workshop::new();
    for (flags, words) in [
        ("--distance 0", ["distance to the receiver is 0 mm", "1 mm"]),
        ("--distance -250mm", ["-250 mm", "1 mm"]),
        ("--size 0mm", ["width of the block is 0 mm", "1 mm"]),
        ("--size nan", ["nan", "mm, cm, m or in"]),
        ("--size 3furlongs", ["furlongs", "mm, cm, m or in"]),
        ("--ior 1", ["index is 1", "1.01"]),
        ("--ior 0", ["index is 0", "1.01"]),
        ("--offset -0.5", ["offset is -0.5", "between 0"]),
        ("--offset nan", ["offset is NaN", "between 0"]),
        ("--nodes 2", ["2 height nodes", "between 9"]),
        ("--nodes 99999", ["99999", "8193"]),
        ("--material cheese", ["cheese", "glasswarp materials"]),
        ("--thickness 2mm", ["2 mm", "--thickness"]),
        ("--thickness -1", ["-1 mm", "between"]),
        ("--solver magic", ["magic", "transport"]),
        ("--solver warping --quality fine", ["--quality", "warping solver"]),
        ("--min-radius -1mm", ["-1 mm", "between"]),
    ] {
        workshop.refuses(&format!("design picture.png -o b.stl {flags}"), REFUSED, &words);
    }
}

#[test]
fn what_physics_forbids_is_refused_with_the_remedy() {
    let workshop = Workshop::new();
    GrayImage::from_fn(64, 64, |x, y| Luma([if x < 8 && y < 8 { 255 } else { 0 }]))
        .save(workshop.path("corner.png"))
        .unwrap();
    for solver in ["warping", "transport"] {
        let line = format!("design corner.png -o b.stl --nodes 65 --distance 20mm --offset 0.01 --solver {solver}");
        workshop.refuses(&line, REFUSED, &["further away"]);
    }
    workshop.refuses(
        "design picture.png -o b.stl --nodes 65 --distance 60 --thickness 4mm",
        REFUSED,
        &["relief", "--thickness"],
    );
}

#[test]
fn outputs_that_cannot_be_written_are_refused_before_the_work() {
    let workshop = Workshop::new();
    workshop.refuses("design picture.png -o block.xyz", REFUSED, &[".xyz", ".stl"]);
    workshop.refuses("design picture.png -o block", REFUSED, &["no extension", ".stl"]);
    workshop.refuses("design picture.png -o nowhere/block.stl", FILE, &["nowhere", "does not exist"]);
    workshop.refuses("design picture.png -o /proc/block.stl", FILE, &["/proc"]);
    workshop.refuses("verify block.stl -o light.jpg", REFUSED, &[".exr"]);
}

#[test]
fn a_full_disk_is_an_error_that_leaves_nothing_half_written() {
    let workshop = Workshop::new();
    let disk = workshop.path("disk");
    fs::create_dir(&disk).unwrap();
    // A disk of 300 kB in a mount namespace of its own; a block of 97 nodes takes 1 MB.
    let script = format!(
        "mount -t tmpfs -o size=300k tmpfs '{0}' && '{1}' design '{2}' -o '{0}/block.stl' --nodes 97 --no-verify; echo code $?; ls -A '{0}'",
        disk.display(),
        Path::new(env!("CARGO_BIN_EXE_glasswarp")).display(),
        workshop.path("picture.png").display(),
    );
    let output = std::process::Command::new("unshare").args(["-rm", "sh", "-c", &script]).output();
    let Some(output) = output.ok().filter(|output| !String::from_utf8_lossy(&output.stderr).contains("not permitted"))
    else {
        println!("NOT RUN: this system lets nobody mount a small disk, so the full disk was not tried");
        return;
    };
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(out.trim(), "code 1", "out: {out}\nerr: {err}");
    assert!(err.contains("No space left"), "{err}");
}

#[cfg(unix)]
#[test]
fn an_interruption_leaves_nothing_half_written() {
    let workshop = Workshop::new();
    GrayImage::from_fn(600, 600, |x, y| Luma([(x / 3 + y / 8) as u8])).save(workshop.path("large.png")).unwrap();
    let before = workshop.files();
    let child = std::process::Command::new(env!("CARGO_BIN_EXE_glasswarp"))
        .current_dir(workshop.root())
        .args(["design", "large.png", "-o", "block.stl", "--nodes", "2049"])
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(std::time::Duration::from_millis(300));
    let killed = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(workshop.files(), before);
}

#[test]
fn help_shows_units_defaults_and_examples() {
    let workshop = Workshop::new();
    let help = workshop.run("design --help");
    for word in ["--distance <LENGTH>", "250mm", "--offset", "--solver"] {
        assert!(help.out.contains(word), "'{word}' is not in\n{}", help.out);
    }
    assert!(workshop.run("--help").out.contains("glasswarp design portrait.png"));
    assert!(workshop.run("materials").out.contains("pmma"));
    assert_eq!(workshop.run("design").code, REFUSED);
}
