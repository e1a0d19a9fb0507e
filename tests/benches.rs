//! Every bench from the command line: mirrors, light from the side, lamps, beams, leaning
//! receivers.

mod common;

use common::{
    measured::prints_within_tenth_of,
    workshop::{FINE, REFUSED, Workshop},
};
use image::{GrayImage, Luma};
use std::fs;

const COMMON: &str = "--size 40mm --distance 150mm --nodes 97 --transfer linear";

#[test]
fn any_bench_is_designed_judged_and_made_again_from_its_side_file() {
    let workshop = Workshop::new();
    let lamp = "IESNA:LM-63-2002\nTILT=NONE\n1 100 1 4 1 1 2 0 0 0\n1 1 1\n0 10 20 40\n0\n100 90 60 5\n";
    fs::write(workshop.path("lamp.ies"), lamp).unwrap();
    // Brighter on one side.
    GrayImage::from_fn(16, 16, |x, _| Luma([120 + 8 * x as u8])).save(workshop.path("beam.png")).unwrap();
    // Relative RMS errors as the verifier measured them.
    for (name, flags, measured) in [
        ("mirror", "--mirror --tilt 30deg", 0.0001),
        ("side", "--tilt 25deg,90deg --material pmma --wavelength 532nm", 0.0005),
        ("lamp", "--source-distance 200mm --emission lamp.ies", 0.0),
        ("torch", "--source-distance 15cm --emission gaussian:20deg --tilt 10deg,180deg", 0.0002),
        ("leaning", "--receiver-tilt 20deg,270deg", 0.0001),
        ("leaning-lamp", "--receiver-tilt 15deg --light point --shift 5mm,-3mm", 0.0),
        ("mirror-lamp", "--mirror --source-distance 120mm --emission lambertian --tilt 15deg", 0.0),
        ("beam", "--beam beam.png --tilt 10deg", 0.0002),
        ("shifted", "--shift 10mm,0mm --window 60mm", 0.0001),
    ] {
        let made = workshop.run(&format!("design picture.png {COMMON} {flags} --no-report -o {name}.stl"));
        assert_eq!(made.code, FINE, "{name}: {}{}", made.out, made.err);
        let judged = workshop.run(&format!("verify {name}.stl --photons 200000"));
        assert_eq!(judged.code, FINE, "{name}: {}{}", judged.out, judged.err);
        let error = judged.out.lines().find_map(|line| line.trim().strip_prefix("relative RMS")).unwrap();
        prints_within_tenth_of(measured, error.trim().parse().unwrap(), name);
        let again = workshop.run(&format!("design {name}.toml --no-report --no-verify -o {name}-again.stl"));
        assert_eq!(again.code, FINE, "{name}: {}", again.err);
        let read = |file: &str| fs::read(workshop.path(file)).unwrap();
        assert!(read(&format!("{name}.stl")) == read(&format!("{name}-again.stl")), "{name}");
    }
}

#[test]
fn benches_that_physics_forbids_are_refused_with_the_value_and_the_remedy() {
    let workshop = Workshop::new();
    for (flags, part) in [
        ("--tilt 80deg", "between 0 and 75 degrees"),
        ("--receiver-tilt 85deg", "at most 80 degrees"),
        ("--receiver-tilt 70deg --distance 60mm", "the receiver cuts the block"),
        ("--tilt 40deg --skirt 0mm --thickness 50mm", "through a side wall"),
        ("--source-distance 20mm", "move the source further away"),
        ("--source-distance 5mm", "at most 75 degrees"),
        ("--source-distance 300mm --emission gaussian:2deg", "2 % are needed"),
        ("--source-distance 300mm --emission gaussian:95deg", "between 0.1deg and 89deg"),
        ("--window 900mm", "totally reflected"),
    ] {
        let refused = workshop.run(&format!("design picture.png --nodes 65 -o block.stl {flags}"));
        assert_eq!(refused.code, REFUSED, "{flags}: {}{}", refused.out, refused.err);
        assert!(refused.err.contains(part), "{flags}: {}", refused.err);
        assert!(!workshop.path("block.stl").exists(), "{flags}");
    }
}

#[test]
fn white_light_is_looked_at_where_the_material_is_known() {
    let workshop = Workshop::new();
    let made = workshop
        .run(&format!("design picture.png {COMMON} --material polycarbonate --no-verify --no-report -o block.stl"));
    assert_eq!(made.code, FINE, "{}", made.err);
    let seen = workshop.run("verify block.stl --photons 100000 --pixels 32 --white white.png");
    assert_eq!(seen.code, FINE, "{}", seen.err);
    assert!(seen.out.contains("colours part") && seen.out.contains("486.1 nm"), "{}", seen.out);
    let picture = image::open(workshop.path("white.png")).unwrap().to_rgb8();
    assert!(picture.pixels().any(|p| p[0] != p[2]), "no colours");
    let plain = workshop.run(&format!("design picture.png {COMMON} --ior 1.5 --no-verify --no-report -o plain.stl"));
    assert_eq!(plain.code, FINE, "{}", plain.err);
    let refused = workshop.run("verify plain.stl --photons 100000 --pixels 32 --white white.png");
    assert_eq!(refused.code, REFUSED);
    assert!(refused.err.contains("--material"), "{}", refused.err);
}
