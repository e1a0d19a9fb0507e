//! Every key that a side file has is explained in docs/side-file.md, and every key there is written
//! by some command.

mod common;

use common::workshop::{FINE, Workshop};
use image::{GrayImage, Luma};
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};
use toml::Table;

/// Commands that together write every key.
const COMMANDS: [&str; 11] = [
    "design chiral.png -o a.stl --height-map a.exr --tilt 10deg --receiver-tilt 10deg,90deg --shift 5mm,0mm --window 65mm --rim 8mm,-4mm --mark 4mm --origin corner --material pmma --wavelength 532nm --step-tolerance 0.5 --min-thickness 4mm --skirt 3mm",
    "design chiral.png -o b.stl --source-distance 200mm --emission lamp.ies",
    "design chiral.png -o c.stl --source-distance 200mm --emission gaussian:20deg --source-size 1mm --roughness 0.02deg --psf speck.png,0.2mm --deconvolution window --deconvolution-rounds 2",
    "design chiral.png -o d.stl --mirror --light point --beam beam.png --thickness 20mm",
    "design chiral.png -o e.stl --height-map e.png --outline circle --margin 0.05 --vignette circle:0.2 --transfer linear --offset 0.2 --ior 1.6",
    "design chiral.png -o f.stl --finish polish=0.05mm --min-radius 0.5mm --quality draft",
    "design chiral.png -o g.stl --solver warping --caustic-mesh mesh.obj",
    "design chiral.png -o h.stl",
    "design layers.exr -o i.stl --layer ViewLayer.DiffCol --background white --crop 10%,10%,80%,80% --rotate 90deg --flip horizontal --levels 0.1,0.9,1.1 --invert",
    "design chiral.png -o j.stl --behind h.stl,30mm",
    "mill h.stl --cutter ball:3mm --step-over 0.3mm --polish 0.3mm -o milled.stl",
];

/// Keys by their tables; all height maps are one table, and the names of files are no keys.
fn written(text: &str) -> BTreeMap<String, BTreeSet<String>> {
    let mut tables = BTreeMap::new();
    for (name, table) in text.parse::<Table>().unwrap() {
        let table = table.as_table().unwrap();
        let keys = |table: &Table| table.keys().cloned().collect::<BTreeSet<_>>();
        match name.as_str() {
            "files" => {}
            "height-maps" => {
                for map in table.values() {
                    tables.entry(name.clone()).or_insert_with(BTreeSet::new).extend(keys(map.as_table().unwrap()));
                }
            }
            _ => tables.entry(name).or_insert_with(BTreeSet::new).extend(keys(table)),
        }
    }
    tables
}

/// The keys in the first columns of the page's tables, by its headings.
fn explained(page: &str) -> BTreeMap<String, BTreeSet<String>> {
    let mut tables = BTreeMap::new();
    for section in page.split("\n## `[").skip(1) {
        let name = section.split(['.', ']']).next().unwrap();
        let rows = section.lines().take_while(|line| !line.starts_with("## ")).filter(|line| line.starts_with("| `"));
        let keys = rows.flat_map(|row| row.split('|').nth(1).unwrap().split('`').skip(1).step_by(2));
        let keys: BTreeSet<String> = keys.map(str::to_owned).collect();
        if !keys.is_empty() {
            tables.insert(name.to_owned(), keys);
        }
    }
    tables
}

#[test]
fn every_key_is_on_the_page_and_every_key_of_the_page_is_written() {
    let workshop = Workshop::new();
    workshop.draw_chiral_picture();
    let lamp = "IESNA:LM-63-2002\nTILT=NONE\n1 100 1 4 1 1 2 0 0 0\n1 1 1\n0 10 20 40\n0\n100 90 60 5\n";
    fs::write(workshop.path("lamp.ies"), lamp).unwrap();
    GrayImage::from_fn(8, 8, |x, _| Luma([180 + 2 * x as u8])).save(workshop.path("beam.png")).unwrap();
    GrayImage::from_fn(9, 9, |x, y| Luma([if x.abs_diff(4) + y.abs_diff(4) < 3 { 200 } else { 0 }]))
        .save(workshop.path("speck.png"))
        .unwrap();
    let layers = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/pictures/two_layers_chosen.exr");
    fs::copy(layers, workshop.path("layers.exr")).unwrap();
    let mut mesh = String::new();
    for k in 0..36 {
        mesh += &format!("v {} {} 0\n", f64::from(k % 6 * 12 - 30), f64::from(k / 6 * 8 - 20));
    }
    for k in (0..30).filter(|k| k % 6 < 5) {
        mesh += &format!("f {} {} {} {}\n", k + 1, k + 2, k + 8, k + 7);
    }
    fs::write(workshop.path("mesh.obj"), mesh).unwrap();
    let mut all: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for command in COMMANDS {
        let usual = "--size 60mm --distance 150mm --nodes 65 --no-verify --no-report";
        let line = if command.starts_with("design") { format!("{command} {usual}") } else { command.to_owned() };
        let outcome = workshop.run(&line);
        assert_eq!(outcome.code, FINE, "{line}: {}", outcome.err);
        let block = command.split(" -o ").nth(1).unwrap().split_whitespace().next().unwrap();
        let side = fs::read_to_string(workshop.path(&block.replace(".stl", ".toml"))).unwrap();
        for (table, keys) in written(&side) {
            all.entry(table).or_default().extend(keys);
        }
    }
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/side-file.md")).unwrap();
    let page = explained(&page);
    for (table, keys) in &all {
        let told = page.get(table).cloned().unwrap_or_default();
        let missing: Vec<_> = keys.difference(&told).collect();
        assert!(missing.is_empty(), "docs/side-file.md does not explain {missing:?} of [{table}]");
    }
    for (table, keys) in &page {
        let never: Vec<_> = keys.difference(all.get(table).unwrap_or(&BTreeSet::new())).cloned().collect();
        assert!(
            never.is_empty(),
            "no command of this test writes {never:?} of [{table}], which docs/side-file.md explains"
        );
    }
}
