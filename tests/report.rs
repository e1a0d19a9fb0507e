//! The report in a browser: nothing missing, nothing asked of the network, a model that turns, and
//! a page that prints.

mod common;

use common::{
    measured::at_worst,
    workshop::{FILE, FINE, REFUSED, Workshop},
};
use image::RgbaImage;
use serde_json::Value;
use std::{fs, path::Path};

/// Drives a browser over a page; writes screenshots and says what was found as JSON.
const BROWSE: &str = include_str!("report/browse.js");

fn browse(page: &Path, shots: &Path) -> Option<Value> {
    let name = common::browser()?;
    let mut node = common::node(&["puppeteer-core"], BROWSE)?;
    let found = common::output(node.arg(name).arg(page).arg(shots));
    Some(serde_json::from_str(&found).unwrap_or_else(|error| panic!("{error} in\n{found}")))
}

fn shot(folder: &Path, name: &str) -> RgbaImage {
    let path = folder.join(format!("{name}.png"));
    image::open(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display())).into_rgba8()
}

/// Share of the pixels that differ by more than a rounding.
fn changed(a: &RgbaImage, b: &RgbaImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let differ = a.pixels().zip(b.pixels()).filter(|(a, b)| (0..3).any(|k| a[k].abs_diff(b[k]) > 3)).count();
    differ as f64 / f64::from(a.width() * a.height())
}

fn brightness(image: &RgbaImage) -> f64 {
    image.pixels().map(|p| f64::from(p[0]) + f64::from(p[1]) + f64::from(p[2])).sum::<f64>()
        / (765.0 * f64::from(image.width() * image.height()))
}

/// How alike the greys of two pictures are, from -1, the negative, to 1.
fn correlation(a: &RgbaImage, b: &RgbaImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let greys = |image: &RgbaImage| -> Vec<f64> {
        image.pixels().map(|p| f64::from(p[0]) + f64::from(p[1]) + f64::from(p[2])).collect()
    };
    let centred = |values: Vec<f64>| {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        values.into_iter().map(|v| v - mean).collect::<Vec<_>>()
    };
    let (a, b) = (centred(greys(a)), centred(greys(b)));
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    product(&a, &b) / (product(&a, &a) * product(&b, &b)).sqrt()
}

#[test]
fn the_report_of_a_design_works_in_a_browser() {
    let workshop = Workshop::new();
    workshop.draw_chiral_picture();
    let outcome = workshop.run(
        "design chiral.png -o block.stl -o block.obj --nodes 97 --transfer linear --thickness 20mm --rim 8mm,-6mm --mark 5mm",
    );
    assert_eq!(outcome.code, FINE, "{}", outcome.err);
    assert!(outcome.out.contains("block.report.html"), "{}", outcome.out);
    let page = workshop.path("block.report.html");
    let length = fs::metadata(&page).unwrap().len();
    assert!((100_000..4_000_000).contains(&length), "{length} bytes");
    let shots = workshop.path("shots");
    fs::create_dir(&shots).unwrap();
    let Some(found) = browse(&page, &shots) else { return };

    assert_eq!(found["console"], Value::Array(vec![]), "nothing to complain of");
    assert_eq!(found["requests"], Value::Array(vec![]), "nothing asked of the network");
    assert!(found["images"].as_u64() >= Some(15), "{found}");
    assert_eq!(found["unnamed"], Value::Array(vec![]), "every picture has words in its place");
    assert_eq!(found["broken"], Value::Array(vec![]), "every picture is one");
    assert_eq!(found["live"], true, "the model is drawn: {found}");
    assert_eq!(found["sideways"], Value::Array(vec![]), "no width has to be scrolled sideways");
    assert_eq!(found["headings"], "fine", "headings go down one level at a time");
    assert_eq!(found["focus"], "fine", "every control is reached by the keyboard");
    assert!(found["command"].as_str().is_some_and(|text| text.starts_with("glasswarp design chiral.png -o block.stl")));

    let moving = found["moving"].as_object().unwrap();
    let apart = |name: &str| moving[name].as_f64().unwrap();
    assert!(moving["shown"] == true && apart("designed") < 0.03, "light that moves, as designed: {moving:?}");
    assert!(apart("back") < 1e-6, "a reset gives the light of the design again: {moving:?}");
    let sliders: Vec<f64> = (0..7).map(|k| apart(&format!("slider {k}"))).collect();
    assert!(sliders.iter().all(|moved| *moved > 0.01), "every slider moves the light: {moving:?}");

    assert_eq!(found["folded"], "fine", "a link unfolds what is for the engineer");
    assert_eq!(found["narrow"], Value::Array(vec![]), "nothing is cut off, and no words lie over buttons");

    let shot = |name: &str| shot(&shots, name);
    let start = shot("start");
    let colours: std::collections::BTreeSet<_> = start.pixels().map(|p| p.0).collect();
    assert!(colours.len() > 500, "the canvas is not blank: {} colours", colours.len());
    // Each of these changes what is seen, and a reset takes it back to the last bit but rounding.
    for name in [
        "dragged",
        "zoomed",
        "keyed",
        "panned",
        "no-rays",
        "no-receiver",
        "matte",
        "stretched",
        "block",
        "picture",
        "pinched",
    ] {
        let share = changed(&start, &shot(name));
        assert!(share > 0.005, "{name} changes {share} of the picture");
    }
    for name in ["dragged", "keyed", "stretched", "picture", "pinched"] {
        let share = changed(&start, &shot(&format!("{name}-reset")));
        assert!(share < 1e-4, "after {name}, a reset leaves {share} of the picture changed");
    }
    // Rays end on the picture: where it is, it is the same with them and without.
    let (bare, unlit) = (shot("bare"), shot("no-rays"));
    let differ = |a: &RgbaImage, b: &RgbaImage, x: u32, y: u32, by: u8| {
        (0..3).any(|k| a.get_pixel(x, y)[k].abs_diff(b.get_pixel(x, y)[k]) > by)
    };
    let all = (0..start.height()).flat_map(|y| (0..start.width()).map(move |x| (x, y)));
    let picture: Vec<(u32, u32)> = all.filter(|&(x, y)| differ(&bare, &unlit, x, y, 24)).collect();
    let crossed = picture.iter().filter(|&&(x, y)| differ(&start, &unlit, x, y, 3)).count();
    assert!(picture.len() > 5_000, "{} pixels of the picture", picture.len());
    assert!(crossed * 50 < picture.len(), "rays cross {crossed} of {} pixels of the picture", picture.len());
    // What is zoomed in fills more of the canvas.
    assert!(changed(&shot("dragged"), &shot("zoomed")) > 0.005);

    let (light, dark) = (shot("page-light"), shot("page-dark"));
    assert!(brightness(&light) > 0.7 && brightness(&dark) < 0.4, "{} {}", brightness(&light), brightness(&dark));
    for name in ["contours", "slope", "light"] {
        let [day, night] = ["light", "dark"].map(|scheme| shot(&format!("{name}-{scheme}")));
        let alike = correlation(&day, &night);
        assert!(alike > 0.98, "{name} by night is {alike} like that by day");
    }
    assert!(found["pdf-pages"].as_u64().is_some_and(|pages| (2..=20).contains(&pages)), "{found}");
    // Without WebGL 2 there is a still picture and a word about it, and no complaint.
    assert_eq!(found["still"], "fine");
    assert_eq!(found["unscripted"], "fine");
}

#[test]
fn a_report_is_written_beside_the_block_where_it_is_named_or_not_at_all() {
    let workshop = Workshop::new();
    let design = "design picture.png -o block.stl --nodes 65 --no-verify";
    assert_eq!(workshop.run(design).code, FINE);
    let html = fs::read_to_string(workshop.path("block.report.html")).unwrap();
    assert!(html.contains("As the solver itself sees it") && html.contains("How the solver converged"));
    // It speaks of flags, as the terminal does.
    assert!(html.contains("One warning") && html.contains("--source-size sun") && !html.contains("`source-size`"));
    fs::remove_file(workshop.path("block.report.html")).unwrap();
    assert_eq!(workshop.run(&format!("{design} --no-report")).code, FINE);
    assert!(!workshop.path("block.report.html").exists());
    assert_eq!(workshop.run(&format!("{design} --report other.html")).code, FINE);
    assert!(workshop.path("other.html").exists() && !workshop.path("block.report.html").exists());
    workshop.refuses("design picture.png --report page.pdf", REFUSED, &["page.pdf", ".html"]);
    workshop.refuses("design picture.png --report nowhere/page.html", FILE, &["nowhere"]);
    workshop.refuses("design picture.png --report a.html --no-report", REFUSED, &["--no-report"]);
}

#[test]
fn found_and_milled_blocks_have_reports_if_they_are_asked_for() {
    let workshop = Workshop::new();
    assert_eq!(workshop.run("design picture.png -o block.stl --nodes 65 --transfer linear --no-report").code, FINE);
    let verified = workshop.run("verify block.stl --photons 100000 --report found.html");
    assert_eq!(verified.code, FINE, "{}", verified.err);
    let html = fs::read_to_string(workshop.path("found.html")).unwrap();
    for part in [
        "as it was found in block.stl",
        "triangles with smooth normals",
        "Judgement",
        "Relative RMS error",
        "block.stl",
    ] {
        assert!(html.contains(part), "{part}");
    }
    let milled = workshop.run("mill block.stl --cutter ball:3mm --step-over 0.5mm --polish 0.3mm --report milled.html");
    assert_eq!(milled.code, FINE, "{}", milled.err);
    let html = fs::read_to_string(workshop.path("milled.html")).unwrap();
    for part in ["Light after the work", "milled with ball, 6 mm diameter", "Scallops", "min at 2000 mm/min"] {
        assert!(html.contains(part), "{part}");
    }
    let files = workshop.files();
    assert_eq!(workshop.run("verify block.stl --photons 100000").code, FINE);
    assert_eq!(workshop.files(), files, "nothing is written unasked");
}

#[test]
fn a_preview_says_what_would_come() {
    let workshop = Workshop::new();
    let outcome = workshop.run("preview picture.png --transfer linear --distance 40cm -o look.html -o look.png");
    assert_eq!(outcome.code, FINE, "{}", outcome.err);
    for word in ["not to be made", "relief", "thinnest place", "expected error", "look.html, look.png"] {
        assert!(outcome.out.contains(word), "'{word}' is not in\n{}", outcome.out);
    }
    let html = fs::read_to_string(workshop.path("look.html")).unwrap();
    assert!(html.contains("A preview: a draft on 257 × 172 nodes") && html.contains("400"));
    assert!(image::open(workshop.path("look.png")).unwrap().width() > 900);
    assert!(workshop.files().iter().all(|name| !name.ends_with(".stl") && !name.ends_with(".toml")), "no block");
    // The relief is that of the block to what is printed of it.
    let relief = |text: &str| -> f64 {
        let line = text.lines().find(|line| line.contains("relief")).unwrap();
        line.split_once("relief").unwrap().1.split_whitespace().next().unwrap().parse().unwrap()
    };
    let block =
        workshop.run("design -v picture.png --transfer linear --distance 40cm --no-verify --no-report -o block.stl");
    let (coarse, fine) = (relief(&outcome.out), relief(&block.out));
    // A unit of the last digit that is printed; rounding may make two of it.
    at_worst(5e-3, (coarse / fine - 1.0).abs(), format_args!("{coarse} mm for {fine} mm"));
    workshop.refuses("preview picture.png -o look.stl", REFUSED, &["look.stl", ".html or .png"]);
    workshop.refuses("preview picture.png --distance 1ly", REFUSED, &["unknown unit 'ly'"]);
}
