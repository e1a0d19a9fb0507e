//! Plates in a row, through the whole command: each draws its picture together with those before it,
//! and what cannot be done with them is refused by name.

mod common;

use common::{
    measured::within_tenth_of,
    workshop::{FINE, REFUSED, Workshop},
};
use image::{GrayImage, Luma};
use serde_json::Value;
use std::fs;

const COMMON: &str = "--size 60mm --nodes 129 --facing 0mm --transfer linear --source-size none";

/// Three pictures of 64 pixels that no mirroring or turning makes alike.
fn workshop() -> Workshop {
    let workshop = Workshop::new();
    let disc = |x: f64, y: f64| if (x - 0.35).hypot(y - 0.3) < 0.2 { 230.0 } else { 90.0 };
    let wave = |x: f64, y: f64| 128.0 + 90.0 * (9.0 * x + 4.0 * y * y).sin();
    let bars = |x: f64, y: f64| if (x > 0.2 && x < 0.4) || (y > 0.7 && x < 0.8) { 200.0 } else { 60.0 + 60.0 * x };
    draw(&workshop, "a.png", disc);
    draw(&workshop, "b.png", wave);
    draw(&workshop, "c.png", bars);
    workshop
}

fn draw(workshop: &Workshop, name: &str, light: impl Fn(f64, f64) -> f64) {
    let pixel = |x, y| Luma([light(f64::from(x) / 63.0, f64::from(y) / 63.0) as u8]);
    GrayImage::from_fn(64, 64, pixel).save(workshop.path(name)).unwrap();
}

fn json(workshop: &Workshop, line: &str) -> Value {
    let done = workshop.run(&format!("{line} --json"));
    assert_eq!(done.code, FINE, "{line}\n{}\n{}", done.out, done.err);
    serde_json::from_str(&done.out).unwrap()
}

fn error(found: &Value) -> f64 {
    found["judgement"]["picture"]["rel_rms"].as_f64().unwrap()
}

#[test]
fn every_plate_draws_its_picture_with_those_before_it() {
    let workshop = workshop();
    let made = json(
        &workshop,
        &format!("design a.png --then b.png --then c.png --gap 15mm --gap 25mm {COMMON} --distance 150mm -o s.stl"),
    );
    let plates = made["result"]["plates"].as_array().unwrap();
    let alone = ["a.png", "b.png", "c.png"].map(|picture| {
        let flat =
            json(&workshop, &format!("design {picture} {COMMON} --distance 150mm --no-report -o alone.stl --force"));
        error(&flat["result"])
    });
    for (k, measured) in [MEASURED[0], MEASURED[1], MEASURED[2]].into_iter().enumerate() {
        within_tenth_of(measured, error(&plates[k]), format_args!("plate {}", k + 1));
        // A few parts in ten thousand are lost at the rims of later plates.
        assert!(error(&plates[k]) < 1.3 * alone[k] + 5e-4, "plate {}: {} alone {}", k + 1, error(&plates[k]), alone[k]);
        for extension in ["stl", "toml", "report.html"] {
            assert!(workshop.path(&format!("s.{}.{extension}", k + 1)).exists());
        }
    }
    // A stranger opens the files.
    let seen = json(&workshop, "verify s.toml --photons 200000");
    for (plate, made) in seen["result"]["plates"].as_array().unwrap().iter().zip(plates) {
        assert_eq!(error(plate), error(made), "{plate}");
        let judged = &plate["judgement"];
        assert!(judged["photons_off"].as_f64().unwrap() < 4.0, "{judged}");
        assert!(judged["light"]["window"].as_f64().unwrap() > 0.99, "{judged}");
    }
    let light = seen["result"]["plates"][2]["bench"]["light"].as_str().unwrap();
    assert!(light.contains("through 2 other blocks"), "{light}");
    // What stands before a plate counts: without it, or elsewhere, the picture is another one.
    let side = fs::read_to_string(workshop.path("s.2.toml")).unwrap();
    assert!(side.contains("behind = \"s.1.stl,15mm\""), "{side}");
    for (as_if, least) in [("", 0.3), ("behind = \"s.1.stl,40mm\"", 0.02)] {
        let line = side.lines().find(|line| line.starts_with("behind")).unwrap();
        fs::write(workshop.path("s.2.toml"), side.replace(line, as_if)).unwrap();
        let found = json(&workshop, "verify s.2.stl --photons 1000");
        assert!(error(&found["result"]) > least, "{as_if}: {}", error(&found["result"]));
    }
}

/// Relative RMS errors of the three plates.
const MEASURED: [f64; 3] = [0.002637, 0.000741, 0.001504];

#[test]
fn what_cannot_stand_in_a_row_is_refused_by_name() {
    let workshop = workshop();
    let refused = |line: &str, words: &[&str]| {
        let done = workshop.run(line);
        let said = done.err.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(done.code == REFUSED && words.iter().all(|word| said.contains(word)), "{line}: {}\n{said}", done.code);
    };
    let front = json(&workshop, &format!("design a.png {COMMON} --distance 175mm --no-report -o front.stl"));
    assert!(error(&front["result"]) < 0.1);
    let design = format!("design b.png {COMMON} --distance 150mm --no-report -o back.stl");
    for (flags, words) in [
        ("--behind front.stl", &["lacks the air between the blocks"][..]),
        ("--behind front.stl,20mm --tilt 10deg", &["--behind", "--tilt", "the block before"]),
        ("--behind front.stl,20mm --mirror", &["--behind", "--mirror"]),
        ("--behind front.stl,20mm --solver warping", &["other faces first", "transport"]),
        ("--behind front.stl,20mm --roughness 0.1deg", &["cannot be corrected for behind another block"]),
        ("--behind front.stl,-3mm", &["-3 mm of air behind front.stl", "leave"]),
        ("--behind front.stl,0mm", &["0 mm of air behind front.stl", "leave"]),
    ] {
        refused(&format!("{design} {flags}"), words);
    }
    // What is larger than the block before gets no light at its rim.
    let larger = design.replace("--size 60mm", "--size 75mm");
    refused(&format!("{larger} --behind front.stl,20mm"), &["from beside face", "smaller block"]);
    refused("design a.png --then b.png --gap 10mm --gap 20mm -o s.stl", &["2 pictures and 2 gaps"]);
    refused("design a.png --gap 10mm -o s.stl", &["--then"]);
    refused("design a.png --then b.png --gap 0mm -o s.stl", &["0 mm of air behind the plate before"]);
    refused(
        "design a.png --then b.png --outline circle -o s.stl",
        &["the outline of the plate before is no rectangle"],
    );
    refused("design a.png --then b.png --source-size sun -o s.stl", &["cannot be corrected for behind another block"]);
    GrayImage::from_pixel(64, 48, Luma([90])).save(workshop.path("wide.png")).unwrap();
    let mut wide = image::open(workshop.path("wide.png")).unwrap().to_luma8();
    wide.put_pixel(20, 20, Luma([200]));
    wide.save(workshop.path("wide.png")).unwrap();
    refused(
        &format!("design a.png --then wide.png {COMMON} -o s.stl"),
        &["wide.png would make a plate of", "the same aspect"],
    );
    assert!(!workshop.path("s.1.stl").exists());
    json(&workshop, &format!("{design} --behind front.stl,20mm"));
    refused("crosscheck back.stl --with povray --write-only --scene x", &["behind another block"]);
    refused("verify back.stl --photons 1000 --white white.png", &["behind another"]);
    let side = fs::read_to_string(workshop.path("back.toml")).unwrap();
    // Another block in the place of the one before.
    json(&workshop, &format!("design b.png {COMMON} --distance 175mm --no-report -o front.stl"));
    let seen = json(&workshop, "verify back.stl --photons 1000");
    assert!(seen["warnings"].to_string().contains("not the block that this one was designed behind"), "{seen}");
    fs::write(workshop.path("back.toml"), side.replace("front.stl", "back.stl")).unwrap();
    refused("verify back.stl --photons 1000", &["in a row", "behind itself"]);
    fs::write(workshop.path("back.toml"), side).unwrap();
    fs::remove_file(workshop.path("front.toml")).unwrap();
    let lost = workshop.run("verify back.stl --photons 1000");
    assert!(lost.code == 1 && lost.err.contains("front.toml"), "{}: {}", lost.code, lost.err);
}
