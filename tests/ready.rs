//! Go or no-go: what the commands say of one block does not contradict each other.

mod common;

use common::workshop::{FINE, SHORT, Workshop};
use image::imageops::FilterType;
use serde_json::Value;
use std::{fs, path::Path, process::Command};

/// A photograph of 128 pixels.
fn shop_with_photograph() -> Workshop {
    let shop = Workshop::new();
    let picture = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/camera/target.png");
    image::open(picture).unwrap().resize_exact(128, 128, FilterType::Triangle).save(shop.path("photo.png")).unwrap();
    shop
}

fn result(shop: &Workshop, line: &str, codes: &[i32]) -> Value {
    let outcome = shop.run(&format!("{line} --json"));
    assert!(codes.contains(&outcome.code), "{line}: {}\n{}", outcome.code, outcome.err);
    serde_json::from_str::<Value>(&outcome.out).unwrap()["result"].take()
}

fn answer(result: &Value) -> &str {
    result["verdict"]["answer"].as_str().unwrap()
}

fn concern<'a>(result: &'a Value, question: &str) -> Option<&'a str> {
    let concerns = result["verdict"]["concerns"].as_array().unwrap();
    concerns.iter().find(|concern| concern["question"] == question)?["answer"].as_str()
}

/// Pages of a page of HTML as a browser prints it, if there is a browser.
fn printed_pages(shop: &Workshop, page: &str) -> Option<usize> {
    let pdf = shop.path("printed.pdf");
    let mut browser = Command::new(common::browser()?);
    browser.args(["--headless", "--no-sandbox", "--disable-gpu", "--no-pdf-header-footer"]);
    common::output(browser.arg(format!("--print-to-pdf={}", pdf.display())).arg(shop.path(page)));
    let pdf = fs::read(pdf).unwrap();
    let begins = |at: usize, word: &[u8]| pdf[at..].starts_with(word);
    Some((0..pdf.len()).filter(|&at| begins(at, b"/Type /Page") && !begins(at, b"/Type /Pages")).count())
}

/// Structural similarities that the words begin at, as the library states them.
fn band(ssim: f64) -> usize {
    glasswarp::study::verdict::BANDS.iter().position(|(least, ..)| ssim >= *least).unwrap()
}

#[test]
fn presets_and_commands_do_not_contradict_each_other() {
    let shop = shop_with_photograph();
    for preset in ["sunlit-window", "wall-mirror", "torch-on-table", "desk-demo"] {
        let line =
            format!("design photo.png --preset {preset} --nodes 193 --no-report -o {preset}.stl -o {preset}.step");
        let design = result(&shop, &line, &[FINE]);
        // A preset that does not work in its own light is none.
        assert_ne!(concern(&design, "picture"), Some("no"), "{preset}: {}", design["verdict"]["says"]);
        assert_eq!(concern(&design, "light"), Some("yes"), "{preset} says which light it is for");
        assert_eq!(answer(&design), "not yet asked", "{preset}: cutter and polish are open");

        let finish = "--cutter ball:d6mm --step-over 0.1mm --polish 0.1mm";
        let check = result(&shop, &format!("check {preset}.step {finish}"), &[FINE, SHORT]);
        let mill = result(&shop, &format!("mill {preset}.step {finish} --pixels 128"), &[FINE]);
        // The desk's laser takes the place of the sun.
        let light = if preset == "desk-demo" { "--light sun" } else { "" };
        let ready = result(&shop, &format!("ready {preset}.step {finish} --pixels 128 {light}"), &[FINE, SHORT]);
        // A sheet for the shop is one sheet, however much there is to say.
        if let Some(pages) = printed_pages(&shop, &format!("{preset}.ready.html")) {
            assert_eq!(pages, 1, "{preset}");
        }
        let says = |of: &Value| of["verdict"]["says"].as_str().unwrap().to_owned();
        eprintln!("{preset}:\n  {}\n  {}\n  {}\n  {}", says(&design), says(&check), says(&mill), says(&ready));
        // What keeps the block from being made does so wherever it is asked.
        let cannot = |of: &Value| concern(of, "making").is_none();
        assert_eq!(cannot(&check), cannot(&ready), "{preset}");
        assert_eq!(cannot(&check), answer(&check) == "no", "{preset}");
        if cannot(&ready) {
            assert_eq!(answer(&ready), "no");
        }
        // The picture of a finished face in spread light is none better than in perfect light,
        // unless the face was made for that light.
        let last = mill["steps"].as_array().unwrap().last().unwrap()["ssim"].as_f64().unwrap();
        let seen = ready["ssim"].as_f64().unwrap();
        if preset == "desk-demo" {
            assert!(seen <= last + 0.01, "{preset}: {seen} in the sun, {last} in perfect light");
        }
        let words = ["yes", "yes", "yes, but", "yes, but", "no"];
        assert_eq!(concern(&ready, "picture"), Some(words[band(seen)]), "{preset}: {seen}");
        assert_eq!(concern(&mill, "picture"), Some(words[band(last)]), "{preset}: {last}");
    }
}

#[test]
fn the_sheet_says_what_the_terminal_says_and_a_no_ends_with_3() {
    let shop = shop_with_photograph();
    let made = shop.run("design photo.png --nodes 257 --source-size none --no-report -o p.stl -o p.step");
    assert_eq!(made.code, FINE, "{}", made.err);
    assert!(made.out.starts_with("Will it work? so far yes"), "{}", made.out);
    let lines = made.out.lines().count();
    assert!(lines <= 5, "{lines} lines:\n{}", made.out);

    let good = result(&shop, "ready p.step --step-over 0.1mm --polish 0.1mm --pixels 128", &[FINE]);
    assert!(answer(&good).starts_with("yes"), "{}", good["verdict"]["says"]);
    let sheet = fs::read_to_string(shop.path("p.ready.html")).unwrap();
    for words in
        ["Will it work?", "Stock to order", "cast acrylic", "Measure on arrival", "ball, 6 mm diameter", "0.1 mm"]
    {
        assert!(sheet.contains(words), "{words}");
    }
    // The side file stands for its block.
    let named = result(&shop, "ready p.toml --step-over 0.1mm --polish 0.1mm --pixels 128 -o named.html", &[FINE]);
    assert_eq!(named["file"], "p.stl");

    // Coarse rows without a polish leave nothing of the picture; what would do is told, and does.
    let bad = result(&shop, "ready p.step --step-over 2mm --pixels 128 -o bad.html", &[SHORT]);
    assert_eq!((answer(&bad), concern(&bad, "picture")), ("no", Some("no")));
    let says = bad["verdict"]["says"].as_str().unwrap();
    let remedy = says.split("; --").nth(1).and_then(|rest| rest.split(" gives SSIM").next());
    let remedy = remedy.unwrap_or_else(|| panic!("no remedy: {says}"));
    let finish =
        if remedy.starts_with("polish") { format!("--step-over 2mm --{remedy}") } else { format!("--{remedy}") };
    let promised: f64 = says.split("gives SSIM ").nth(1).unwrap().split(',').next().unwrap().parse().unwrap();
    let line = format!("ready p.step {finish} --pixels 128 -o mended.html");
    let mended = result(&shop, &line, &[FINE]);
    let kept = mended["ssim"].as_f64().unwrap();
    assert!((kept - promised).abs() < 1e-3, "promised {promised}, kept {kept}");

    // The sun through a block that was made for a laser.
    let sun = result(&shop, "ready p.step --polish 0.1mm --light sun --pixels 128 -o sun.html", &[FINE, SHORT]);
    assert_eq!(concern(&sun, "spread"), Some("yes"), "{}", sun["verdict"]["says"]);
    assert!(sun["ssim"].as_f64().unwrap() < good["ssim"].as_f64().unwrap());
}

#[test]
fn what_is_not_said_is_asked_for() {
    let shop = shop_with_photograph();
    let open = result(&shop, "design photo.png --nodes 129 --no-report -o p.stl", &[FINE]);
    assert_eq!(concern(&open, "light"), Some("not yet asked"));
    let pale = result(&shop, "design photo.png --nodes 129 --no-report --offset 2 -o pale.stl", &[FINE]);
    assert_eq!(concern(&pale, "contrast"), Some("yes, but"), "{}", pale["verdict"]["says"]);
    let unseen = result(&shop, "design photo.png --nodes 129 --no-report --no-verify -o unseen.stl", &[FINE]);
    assert_eq!(concern(&unseen, "picture"), Some("not yet asked"));
}

#[test]
fn the_sheet_to_order_leaves_what_is_faced_off() {
    let shop = shop_with_photograph();
    let design =
        |line: &str| result(&shop, &format!("design photo.png --nodes 65 --no-report --no-verify {line}"), &[FINE]);
    let thickness = |of: &Value| of["block"]["thickness_mm"].as_f64().unwrap();
    let plain = thickness(&design("-o a.stl"));
    let unfaced = thickness(&design("-o b.stl --facing 0mm"));
    assert!((plain.fract() - 0.5).abs() < 1e-9 && unfaced.fract() == 0.0, "{plain} {unfaced}");
    let said = shop.run("design photo.png --nodes 65 --no-report --no-verify --thickness 20mm -o c.stl");
    assert!(said.out.contains("25 mm sheet") && said.out.contains("20.000 mm thick everywhere"), "{}", said.out);
}
