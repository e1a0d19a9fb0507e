//! Light that is not perfect and caustic meshes, as a person asks for them.

mod common;

use common::{
    measured::{prints_at_worst, prints_within_tenth_of},
    workshop::{FILE, FINE, REFUSED, SHORT, Workshop},
};
use image::{GrayImage, ImageBuffer, Luma};
use std::{fmt::Write as _, fs};

const LINE: &str = "design -v chiral.png --nodes 97 --transfer linear --no-report --pictures";

fn workshop() -> Workshop {
    let workshop = Workshop::new();
    workshop.draw_chiral_picture();
    workshop
}

/// What is said of the light that there is.
fn seen(out: &str) -> f64 {
    let from = out.find("In the light that there is").unwrap_or_else(|| panic!("not looked at:\n{out}"));
    let line = out[from..].lines().find_map(|line| line.trim().strip_prefix("relative RMS")).unwrap();
    line.split_whitespace().next().unwrap().parse().unwrap()
}

fn same_solid(workshop: &Workshop, a: &str, b: &str) -> bool {
    // Without the header, which names the file.
    let [a, b] = [a, b].map(|name| fs::read(workshop.path(name)).unwrap());
    a[84..] == b[84..]
}

#[test]
fn a_wide_source_is_made_up_for_and_the_gain_is_traced() {
    let workshop = workshop();
    // The command tells the photons' standard error: 0.0004, which is within a fiftieth of these.
    for (flags, measured, plainly) in [
        ("--source-size 1.5deg", 0.0262, 0.0806),
        ("--source-distance 300mm --window 100mm --source-size 9x6mm", 0.0360, 0.0850),
        ("--roughness 0.8deg", 0.0244, 0.0753),
    ] {
        let with = workshop.run(&format!("{LINE} {flags} -o with.stl"));
        let without = workshop.run(&format!("{LINE} {flags} --deconvolution off -o without.stl"));
        assert_eq!((with.code, without.code), (FINE, FINE), "{}{}", with.err, without.err);
        let (with_error, without_error) = (seen(&with.out), seen(&without.out));
        prints_within_tenth_of(measured, with_error, flags);
        prints_within_tenth_of(plainly, without_error, format_args!("{flags}, without deconvolution"));
        for words in [
            "deconvolution",
            "beside the window",
            "contrast of the light to draw",
            "standard deviation on the receiver",
        ] {
            assert!(with.out.contains(words), "{words} is not in\n{}", with.out);
        }
        // The side file holds everything that is needed to judge the block, and to make it again.
        let verified = workshop.run("verify with.stl");
        // Other photons: the noise of both.
        prints_at_worst(0.0005, (seen(&verified.out) - with_error).abs(), &verified.out);
        assert_eq!(workshop.run("design with.toml -o again.stl --no-verify --no-report").code, FINE);
        assert!(same_solid(&workshop, "with.stl", "again.stl"), "{flags}");
        assert!(!same_solid(&workshop, "with.stl", "without.stl"), "{flags}");
        assert!(workshop.path("with.perfect.png").exists());
    }
    let limited = workshop.run("verify with.stl --max-error 0.001");
    assert_eq!(limited.code, SHORT);
    assert!(limited.err.contains("in the light that there is"), "{}", limited.err);
}

#[test]
fn a_measured_speck_is_made_up_for() {
    let workshop = workshop();
    // 8 mm wide, lopsided.
    GrayImage::from_fn(16, 11, |x, y| Luma([(15 * x + y) as u8])).save(workshop.path("speck.png")).unwrap();
    let with = workshop.run(&format!("{LINE} --psf speck.png,0.5mm -o with.stl"));
    let without = workshop.run(&format!("{LINE} --psf speck.png,0.5mm --deconvolution off -o without.stl"));
    assert_eq!(with.code, FINE, "{}", with.err);
    prints_within_tenth_of(0.0363, seen(&with.out), "a speck");
    prints_within_tenth_of(0.0834, seen(&without.out), "a speck, without deconvolution");
    fs::create_dir(workshop.path("away")).unwrap();
    for name in ["with.stl", "with.toml"] {
        fs::rename(workshop.path(name), workshop.path(&format!("away/{name}"))).unwrap();
    }
    let moved = fs::read_to_string(workshop.path("away/with.toml")).unwrap();
    fs::write(
        workshop.path("away/with.toml"),
        moved.replace("\"chiral", "\"../chiral").replace("\"speck", "\"../speck"),
    )
    .unwrap();
    assert_eq!(seen(&workshop.run("verify away/with.stl").out), seen(&with.out));
}

#[test]
fn senseless_light_is_refused_with_a_way_out() {
    let workshop = workshop();
    GrayImage::new(8, 8).save(workshop.path("black.png")).unwrap();
    ImageBuffer::<Luma<u8>, _>::from_fn(300, 8, |_, _| Luma([200])).save(workshop.path("wide.png")).unwrap();
    fs::write(workshop.path("text.png"), "no picture").unwrap();
    for (flags, code, words) in [
        ("--source-size 5mm", REFUSED, ["light is parallel", "0.53deg"]),
        ("--source-size sun --source-distance 300mm", REFUSED, ["point nearby", "millimetres"]),
        ("--source-size 5", REFUSED, ["lacks its unit", "5x3mm"]),
        ("--source-size moon", REFUSED, ["moon", "0.53deg"]),
        ("--source-size 30deg", REFUSED, ["angular diameter", "0.35 rad"]),
        ("--source-size 15deg --distance 1m", REFUSED, ["spreads over", "nearer"]),
        ("--roughness 20deg", REFUSED, ["roughness", "0.2 rad"]),
        ("--roughness -1deg", REFUSED, ["roughness", "between 0"]),
        ("--psf black.png,0.1mm", REFUSED, ["black everywhere", "speck"]),
        ("--psf wide.png,1mm", REFUSED, ["300.0", "crop it"]),
        ("--psf wide.png,0mm", REFUSED, ["pixel", "0 mm"]),
        ("--psf wide.png", REFUSED, ["size of a pixel", "speck.png,0.05mm"]),
        ("--psf none.png,0.1mm", FILE, ["none.png", "speck of light"]),
        ("--psf text.png,0.1mm", FILE, ["text.png", "speck of light"]),
        ("--deconvolution paper", REFUSED, ["no spread", "--source-size"]),
        ("--source-size sun --deconvolution-rounds 0", REFUSED, ["number of rounds", "between 1"]),
    ] {
        workshop.refuses(&format!("{LINE} {flags} -o block.stl"), code, &words);
    }
}

/// A mesh of 12 x 8 quads, 60 x 40 mm, sheared.
fn mesh() -> String {
    let mut text = String::new();
    for k in 0..13 * 9 {
        let (u, v) = (f64::from(k % 13) / 6.0 - 1.0, f64::from(k / 13) / 4.0 - 1.0);
        writeln!(text, "v {} {} 0", 30.0 * u + 4.0 * v, 6.0 * u + 20.0 * v).unwrap();
    }
    for k in 0..12 * 8 {
        let first = 1 + k % 12 + 13 * (k / 12);
        writeln!(text, "f {} {} {} {}", first, first + 1, first + 14, first + 13).unwrap();
    }
    text
}

#[test]
fn a_picture_is_drawn_on_a_mesh_by_the_warping_solver_and_by_no_other() {
    let workshop = workshop();
    fs::write(workshop.path("mesh.obj"), mesh()).unwrap();
    let drawn = workshop.run(&format!("{LINE} --solver warping --caustic-mesh mesh.obj -o block.stl"));
    assert_eq!(drawn.code, FINE, "{}", drawn.err);
    for words in ["12 x 8 quads, 96 with their front", "from its place on the caustic mesh", "100.00 x 66.67 mm"] {
        assert!(drawn.out.contains(words), "'{words}' is not in\n{}", drawn.out);
    }
    let error = |out: &str| -> f64 {
        let line = out.lines().find_map(|line| line.trim().strip_prefix("relative RMS")).unwrap();
        line.trim().parse().unwrap()
    };
    // Pixels on the brim of the mesh, which it cuts, have most of it.
    prints_within_tenth_of(0.0152, error(&drawn.out), "drawn on a mesh");
    let verified = workshop.run("verify block.stl --photons 200000");
    assert_eq!(error(&verified.out), error(&drawn.out), "{}", verified.out);
    assert_eq!(workshop.run("design block.toml -o again.stl --no-verify --no-report").code, FINE);
    assert!(same_solid(&workshop, "block.stl", "again.stl"));

    fs::write(workshop.path("triangles.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    fs::write(workshop.path("large.obj"), mesh().replace("v 34", "v 64")).unwrap();
    let line = format!("{LINE} -o other.stl");
    workshop.refuses(&format!("{line} --caustic-mesh mesh.obj"), REFUSED, &["transport", "--solver warping"]);
    for (file, words) in [
        ("triangles.obj", ["3 corners", "must have 4"]),
        ("large.obj", ["beyond the picture", "--window"]),
        ("none.obj", ["none.obj", "OBJ"]),
    ] {
        workshop.refuses(&format!("{line} --solver warping --caustic-mesh {file}"), REFUSED, &words);
    }
}
