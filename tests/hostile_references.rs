//! Picture files that lie, before the verifier's own reader: it never panics, and takes no more
//! memory than a file's length pays for.
//!
//! The corpus is the chart in every format, depth, profile and orientation (`common/chart.rs`), and
//! the pictures of tests/pictures that are read, damaged at random (`common/fuzz.rs`); the long run
//! is `GLASSWARP_FUZZ_CASES=1000000 cargo test --release --test hostile_references --
//! --nocapture`.

#[path = "common/chart.rs"]
mod chart;
#[path = "common/corpus.rs"]
mod corpus;
#[path = "common/fuzz.rs"]
mod fuzz;

use corpus::files_of;
use fuzz::{Read, Target, cases, most_time, timed, turn};
use glasswarp_verify::reference::{ReadOptions, Reference};

/// Small files may be of any number of pixels below 65536; beyond that a byte of deflate stands for
/// some thousand samples, and each of these is held as a number, as light, and as what is done to
/// it.
fn memory(length: usize) -> usize {
    (24 << 20) + 40_000 * length
}

fn read(bytes: &[u8]) -> Read {
    let mut options = ReadOptions::default();
    options.svg_width = 48;
    Read::of(Reference::parse(bytes, &options))
}

fn hostile(extensions: &[&str], mend: Option<fn(&mut Vec<u8>)>, usual: usize) {
    let charts = chart::cases().into_iter().filter(|case| extensions.contains(&case.extension));
    let mut corpus: Vec<Vec<u8>> = charts.map(|case| case.bytes).collect();
    assert!(!corpus.is_empty());
    corpus.extend(files_of("tests/pictures", extensions).into_iter().filter(|file| matches!(read(file), Read::Taken)));
    let name = format!("reference, {}", extensions[0]);
    Target { name: &name, corpus, mend, memory }.run(cases(usual), read);
}

#[test]
fn png() {
    hostile(&["png"], Some(|file| chart::mend_png(file)), 4000);
}

#[test]
fn jpeg() {
    hostile(&["jpg"], None, 4000);
}

#[test]
fn tiff() {
    hostile(&["tif"], None, 4000);
}

#[test]
fn webp() {
    hostile(&["webp"], None, 4000);
}

#[test]
fn bmp() {
    hostile(&["bmp"], None, 4000);
}

#[test]
fn gif() {
    hostile(&["gif"], None, 4000);
}

#[test]
fn pnm() {
    hostile(&["pgm", "ppm", "pam", "pbm"], None, 4000);
}

#[test]
fn exr() {
    hostile(&["exr"], None, 2000);
}

#[test]
fn svg() {
    hostile(&["svg"], None, 1500);
}

#[test]
fn claims_beyond_the_length_of_a_file_are_refused_at_once() {
    let mut png = chart::cases().remove(0).bytes;
    png[16..24].copy_from_slice(&[0, 1, 0, 0, 0, 1, 0, 0]);
    chart::mend_png(&mut png);
    let bomb = br#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1 100000000"><path d="M0 0h1v9h-1z"/></svg>"#;
    let lies: [&[u8]; 5] = [
        &png,
        b"P5 65000 65000 255\n1",
        b"P7\nWIDTH 65000\nHEIGHT 65000\nDEPTH 4\nMAXVAL 65535\nENDHDR\n1",
        b"GIF89a\xff\xff\xff\xff\x80\0\0\0\0\0\xff\xff\xff,\0\0\0\0\xff\xff\xff\xff\0\x02\x02\x44\x01\0;",
        bomb,
    ];
    let _turn = turn();
    for lie in lies {
        let (outcome, took) = timed(lie.len(), || read(lie));
        assert!(matches!(outcome, Read::Refused), "{}", String::from_utf8_lossy(&lie[..20]));
        assert!(took < most_time(lie.len()), "{took:?} for {}", String::from_utf8_lossy(&lie[..20]));
    }
}

/// Drawings of some hundred bytes to some ten thousand: of elements that repeat each other a million
/// million times, of a filter of a hundred million octaves, of lines in dashes of micrometres, of
/// groups ten thousand deep.
#[test]
fn drawings_that_would_take_years_are_refused_at_once() {
    let _turn = turn();
    for name in ["laughs", "octaves", "dashes", "deep"] {
        let drawing = std::fs::read(format!("{}/tests/pictures/{name}.svg", env!("CARGO_MANIFEST_DIR"))).unwrap();
        let (outcome, took) = timed(drawing.len(), || Reference::parse(&drawing, &ReadOptions::default()).map(drop));
        let error = outcome.expect_err(name).to_string();
        assert!(error.contains("simplify it"), "{name}: {error}");
        assert!(took < most_time(drawing.len()), "{name}: {took:?}");
    }
}
