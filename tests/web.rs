//! The page in a browser: it makes the blocks that the program makes, and says of them what the
//! program says.
//!
//! `web/build.sh` builds the page, which `.ci/run` does first.

mod common;

use common::workshop::{FINE, Workshop};
use serde_json::Value;
use std::{
    collections::HashMap,
    fs,
    path::{Path, PathBuf},
};

/// Goes through the page as a person would.
const DRIVE: &str =
    "const [file, ...rest] = process.argv.slice(1); process.argv = [process.argv[0], file, ...rest]; require(file);";

/// The page, where it was built.
fn page() -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("web");
    if root.join("dist/glasswarp.html").exists() {
        return Some(root.join("test/app.cjs"));
    }
    common::program("the built page", "web/build.sh").and(None)
}

#[test]
fn the_page_makes_and_judges_the_blocks_that_the_program_does() {
    let (Some(script), Some(browser)) = (page(), common::browser()) else { return };
    let Some(mut node) = common::node(&["puppeteer-core"], DRIVE) else { return };
    let workshop = Workshop::new();
    let picture = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/camera/target.png");
    let said = common::output(node.arg(script).arg(browser).arg(&picture).arg(workshop.root()));
    let found: Value = serde_json::from_str(&said).unwrap_or_else(|error| panic!("{error} in\n{said}"));
    for way in ["hosted", "disk"] {
        fs::copy(&picture, workshop.path(way).join("camera.png")).unwrap();
        let verified = workshop.run(&format!("--json verify {way}/camera.stl"));
        assert_eq!(verified.code, FINE, "{}", verified.err);
        let document: Value = serde_json::from_str(&verified.out).unwrap();
        let judged = &document["result"]["judgement"]["picture"];
        for figure in ["rel_rms", "ssim"] {
            let [page, program] = [&found[way]["block"][figure], &judged[figure]].map(|value| value.as_f64().unwrap());
            assert!((page - program).abs() < 1e-6, "{way}, {figure}: the page says {page}, the program {program}");
        }
        // The side file is a design file too: the program makes the same block of it.
        let made = workshop.run(&format!("design {way}/camera.toml -o {way}/native.stl --no-verify --no-report"));
        assert_eq!(made.code, FINE, "{}", made.err);
        let [page, program] = ["camera.stl", "native.stl"].map(|name| heights(&workshop.path(way).join(name)));
        assert_eq!(page.len(), program.len());
        let apart = page.iter().map(|(place, z)| (z - program[place]).abs()).fold(0.0, f64::max);
        // A nanometre: the last bit of ten millimetres in single precision.
        assert!(apart <= 1e-6, "{way}: heights {apart} mm apart");
    }
    let ready = workshop.run("--json ready hosted/camera.stl --polish 0.1mm -o hosted/native.html");
    let document: Value = serde_json::from_str(&ready.out).unwrap();
    let (page, program) = (&found["hosted"]["ready"], &document["result"]["verdict"]);
    assert_eq!(page["answer"], program["answer"]);
    // Settings are flags on a command line, and stand as code on a page.
    let bare = |text: &Value| text.as_str().unwrap().replace(['`', '\''], "").replace("--", "");
    let said = |concern: &Value| ["question", "answer", "says"].map(|name| bare(&concern[name]));
    let program: Vec<[String; 3]> = program["concerns"].as_array().unwrap().iter().map(said).collect();
    let shown = |row: &Value| [0, 1, 2].map(|cell| bare(&row[cell]));
    let page: Vec<[String; 3]> = page["concerns"].as_array().unwrap().iter().map(shown).collect();
    assert_eq!(page, program);
    let errors = found["hosted"]["poses"]["errors"].as_array().unwrap();
    assert_eq!(errors.len(), 5);
    for error in errors {
        assert!(
            error.as_f64().is_some_and(|error| error <= 0.03),
            "the moving light is off the verifier's by {errors:?}"
        );
    }
}

/// The highest vertex of a file of triangles at every place, mm: the exit face. Which way a cell is
/// cut in two may hang on the last bit.
fn heights(path: &Path) -> HashMap<[u32; 2], f64> {
    let bytes = fs::read(path).unwrap();
    let mut heights = HashMap::new();
    for corner in bytes[84..].chunks_exact(50).flat_map(|triangle| triangle[12..48].chunks_exact(12)) {
        let [x, y, z] = [0, 4, 8].map(|at| f32::from_le_bytes(corner[at..at + 4].try_into().unwrap()));
        let highest = heights.entry([x, y].map(f32::to_bits)).or_insert(f64::NEG_INFINITY);
        *highest = f64::from(z).max(*highest);
    }
    heights
}
