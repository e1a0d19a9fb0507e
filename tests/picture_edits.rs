//! Pictures on their way into a block: turned, cropped, shaded, and the same again from the side
//! file.

#[path = "common/workshop.rs"]
mod workshop;

use std::{fs, path::Path};
use workshop::{FILE, FINE, REFUSED, Workshop};

/// Few nodes: what is asked here is asked of the picture.
const SMALL: &str = "--nodes 33 --no-verify --no-report --size 40mm --distance 150mm";

fn borrow(workshop: &Workshop, name: &str) {
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/pictures").join(name);
    fs::copy(from, workshop.path(name)).unwrap();
}

/// The triangles of an STL, behind the head that names the picture.
fn block(workshop: &Workshop, name: &str) -> Vec<u8> {
    fs::read(workshop.path(name)).unwrap().split_off(80)
}

#[test]
fn a_picture_that_was_stored_sideways_makes_the_block_of_the_upright_one() {
    let workshop = Workshop::new();
    for name in ["rgb8.png", "turned6.png"] {
        borrow(&workshop, name);
    }
    let upright = workshop.run(&format!("design -v rgb8.png -o upright.stl {SMALL}"));
    assert_eq!(upright.code, FINE, "{}", upright.err);
    assert!(!upright.out.contains("picture   "), "{}", upright.out);
    let turned = workshop.run(&format!("design -v turned6.png -o turned.stl {SMALL}"));
    assert!(
        turned.out.contains("picture        26 x 18 pixels, turned upright (EXIF orientation 6)"),
        "{}",
        turned.out
    );
    assert!(block(&workshop, "upright.stl") == block(&workshop, "turned.stl"));
}

#[test]
fn an_edited_block_is_made_again_by_its_side_file_and_judged_by_the_edited_picture() {
    let workshop = Workshop::new();
    workshop.draw_chiral_picture();
    let edits = "--crop 4,2,40,26 --rotate 90deg --flip horizontal --levels 0.1,0.95,1.2 --invert --background white";
    let made =
        workshop.run(&format!("design -v chiral.png -o edited.stl {edits} --nodes 65 --size 40mm --distance 150mm"));
    assert_eq!(made.code, FINE, "{}", made.err);
    let said = "picture        26 x 40 pixels, cropped to 4,2,40,26, turned by 90deg clockwise, flipped horizontally, levels 0.1,0.95,1.2, inverted";
    assert!(made.out.contains(said), "{}", made.out);
    let page = fs::read_to_string(workshop.path("edited.report.html")).unwrap();
    for words in ["cropped to 4,2,40,26", "turned by 90deg clockwise", "Black, white", "48 × 32 pixels"] {
        assert!(page.contains(words), "{words}");
    }
    let side = fs::read_to_string(workshop.path("edited.toml")).unwrap();
    let written = [
        "crop = \"4,2,40,26\"",
        "rotate = \"90deg\"",
        "flip = \"horizontal\"",
        "levels = \"0.1,0.95,1.2\"",
        "invert = true",
        "background = \"white\"",
    ];
    assert!(written.iter().all(|line| side.contains(line)) && !side.contains("transfer"), "{side}");
    let again = workshop.run("design -v edited.toml -o again.stl --no-report");
    assert_eq!(again.code, FINE, "{}", again.err);
    assert!(block(&workshop, "edited.stl") == block(&workshop, "again.stl"));
    // A flag goes before the file.
    let upright =
        workshop.run("design -v edited.toml -o other.stl --no-verify --no-report --invert=false --rotate 180deg");
    assert!(upright.out.contains("turned by 180deg clockwise") && !upright.out.contains("inverted"), "{}", upright.out);
}

#[test]
fn flat_pictures_are_refused_with_what_made_them_flat() {
    let workshop = Workshop::new();
    image::RgbaImage::from_fn(40, 40, |x, _| image::Rgba([0, 0, 0, if x < 20 { 255 } else { 0 }]))
        .save(workshop.path("logo.png"))
        .unwrap();
    image::GrayImage::from_pixel(40, 40, image::Luma([128])).save(workshop.path("grey.png")).unwrap();
    image::GrayImage::from_fn(40, 40, |x, _| image::Luma([if x < 20 { 128 } else { 129 }]))
        .save(workshop.path("faint.png"))
        .unwrap();
    image::GrayImage::from_fn(40, 40, |x, _| image::Luma([if x < 20 { 40 } else { 90 }]))
        .save(workshop.path("dark.png"))
        .unwrap();
    workshop.refuses(
        "design logo.png -o a.stl",
        REFUSED,
        &["the same light everywhere", "black", "--background white"],
    );
    workshop.refuses("preview logo.png", REFUSED, &["--background white"]);
    workshop.refuses("design grey.png -o a.stl", REFUSED, &["every pixel is 0.216 of white"]);
    workshop.refuses("design dark.png -o a.stl --levels 0.5,1", REFUSED, &["levels 0.5,1", "between 0.157 and 0.353"]);
    workshop.refuses("design dark.png -o a.stl --crop 0,0,15,40", REFUSED, &["--crop 0,0,15,40"]);
    let white = workshop.run(&format!("design -v logo.png -o white.stl --background white {SMALL}"));
    assert_eq!(white.code, FINE, "{}", white.err);
    assert!(white.out.contains("its transparent parts on white"), "{}", white.out);
    let faint = workshop.run(&format!("design faint.png -o faint.stl {SMALL}"));
    assert_eq!(faint.code, FINE, "{}", faint.err);
    assert!(faint.err.contains("nearly flat") && faint.err.contains("--levels 0.501,0.506"), "{}", faint.err);
}

#[test]
fn refusals_are_one_sentence_with_the_remedy() {
    let workshop = Workshop::new();
    for name in ["two_layers.exr", "photo.heic", "page.png", "cut_short.jpg"] {
        borrow(&workshop, name);
    }
    let cases: [(&str, i32, &[&str]); 7] = [
        ("design two_layers.exr", REFUSED, &["'ViewLayer.Combined', 'ViewLayer.DiffCol'", "--layer"]),
        ("design photo.heic", FILE, &["photo.heic is not a readable picture: HEIC files are not read", "heif-convert"]),
        ("design page.png", FILE, &["no picture of a kind that is read", "save it as PNG"]),
        ("design cut_short.jpg", FILE, &["ends before its picture does"]),
        ("design picture.png --layer Z", REFUSED, &["the picture is PNG"]),
        ("design picture.png --crop 0,0,100,10", REFUSED, &["48 x 32", "within it"]),
        ("design nothing.png", FILE, &["nothing.png cannot be read"]),
    ];
    for (line, code, words) in cases {
        workshop.refuses(line, code, words);
        let said = workshop.run(line).err;
        assert!(line.contains("nothing") || !said.contains("because"), "{said}");
    }
    let chosen = workshop.run(&format!("design -v two_layers.exr -o a.stl --layer ViewLayer.Combined {SMALL}"));
    assert!(chosen.out.contains("layer 'ViewLayer.Combined'"), "{}{}", chosen.out, chosen.err);
}

#[test]
fn a_drawing_is_as_sharp_as_the_nodes_can_draw() {
    let workshop = Workshop::new();
    borrow(&workshop, "letter.svg");
    for (nodes, width) in [(65, 32), (97, 48)] {
        let made = workshop.run(&format!("design -v letter.svg -o a.stl --nodes {nodes} --no-verify --no-report"));
        assert_eq!(made.code, FINE, "{}", made.err);
        assert!(made.out.contains(&format!("picture        {width} x ")), "{}", made.out);
    }
}
