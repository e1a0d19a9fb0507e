//! A tracer that was written from docs/side-file.md, in another language, finds in an STL and its
//! side file what the verifier does.

mod common;

use common::{
    measured::{at_worst, within_tenth_of},
    workshop::{FINE, Workshop},
};
use image::{GrayImage, Luma};
use std::{fs, path::Path};

/// Every kind of light, receiver, outline and row of blocks that the page tells of; the relative RMS
/// of the light from the picture as the verifier finds it and as the script does, and of its image
/// from the verifier's. The k-th bench makes `k.stl`, behind which a later one may stand; of a stack
/// the last plate is looked at.
///
/// The two differ most beyond the outline of round blocks, where each continues the face in its own
/// way.
const BENCHES: [(&str, f64, f64, f64); 20] = [
    ("--ior 1.49", 1.22e-4, 1.96e-4, 2.22e-4),
    ("--ior 1.49 --tilt 20deg,60deg --rim 8mm,-4mm --mark 4mm --origin corner", 4.38e-4, 3.51e-4, 2.64e-4),
    ("--ior 1.49 --tilt 15deg --receiver-tilt 20deg,120deg --shift 10mm,-5mm --window 70mm", 5.44e-4, 4.75e-4, 2.49e-4),
    ("--ior 1.49 --source-distance 200mm --tilt 10deg,200deg --emission gaussian:12deg", 2.04e-4, 2.64e-4, 2.20e-4),
    ("--ior 1.5 --source-distance 250mm --tilt 5deg --emission lamp.ies", 1.20e-4, 2.01e-4, 2.21e-4),
    (
        "--ior 1.5 --source-distance 180mm --tilt 15deg,300deg --emission lambertian --receiver-tilt 10deg",
        1.15e-4,
        2.18e-4,
        2.38e-4,
    ),
    ("--ior 1.5 --source-distance 150mm", 1.30e-4, 2.14e-4, 2.21e-4),
    ("--mirror --tilt 25deg,45deg", 1.30e-4, 1.99e-4, 2.34e-4),
    ("--mirror --source-distance 250mm --tilt 10deg --receiver-tilt 15deg", 1.11e-4, 2.21e-4, 2.46e-4),
    ("--ior 1.5 --beam beam.png --tilt 12deg", 5.22e-4, 4.77e-4, 2.50e-4),
    ("--ior 1.5 --beam beam.png --light point --source-distance 220mm --tilt 8deg,90deg", 1.75e-4, 2.48e-4, 2.31e-4),
    ("--ior 1.5 --outline circle", 27.70e-4, 35.61e-4, 17.48e-4),
    ("--ior 1.5 --outline circle --tilt 12deg --rim 6mm,2mm", 32.90e-4, 26.61e-4, 8.93e-4),
    ("--ior 1.5 --outline rounded:8mm --source-distance 300mm", 27.40e-4, 30.95e-4, 9.45e-4),
    ("--ior 1.5 --margin 0.1 --vignette circle:0.3 --transfer linear --offset 0.3", 1.91e-4, 3.04e-4, 3.92e-4),
    ("--ior 1.6 --behind 0.stl,30mm", 2.43e-4, 2.17e-4, 1.98e-4),
    ("--ior 1.6 --behind 0.stl,45mm --receiver-tilt 10deg,120deg --origin corner", 2.69e-4, 2.27e-4, 1.98e-4),
    ("--ior 1.5 --source-distance 250mm --window 60mm --then picture.png", 1.63e-4, 1.65e-4, 1.16e-4),
    (
        "--ior 1.5 --source-distance 250mm --window 60mm --rim 8mm,2mm --origin stock-top --gap 40mm --then picture.png",
        1.75e-4,
        1.76e-4,
        1.16e-4,
    ),
    ("--ior 1.49 --source-size none --then picture.png --then chiral.png", 2.19e-4, 1.92e-4, 1.93e-4),
];

const MODULES: [&str; 2] = ["numpy", "tomllib"];
/// Runs a script that stands beside its modules.
const RUN: &str = "import os, runpy, sys; sys.argv = sys.argv[1:]; sys.path.insert(0, os.path.dirname(sys.argv[0])); runpy.run_path(sys.argv[0], run_name='__main__')";

#[test]
fn a_tracer_written_from_the_page_sees_what_the_verifier_sees() {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/third_opinion/trace.py");
    if common::python(&MODULES, RUN).is_none() {
        return;
    }
    let workshop = Workshop::new();
    workshop.draw_chiral_picture();
    let lamp =
        "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 7 1 1 2 0 0 0\n1 1 10\n0 5 10 20 30 45 90\n0\n1000 950 850 600 300 80 0\n";
    fs::write(workshop.path("lamp.ies"), lamp).unwrap();
    // Brighter towards one corner.
    GrayImage::from_fn(32, 24, |x, y| Luma([(128.0 + 2.6 * f64::from(x) + 1.8 * f64::from(y)) as u8]))
        .save(workshop.path("beam.png"))
        .unwrap();
    for (k, (flags, of_verifier, of_picture, of_image)) in BENCHES.into_iter().enumerate() {
        let [file, light] = [format!("{k}.stl"), format!("{k}.exr")];
        let design = "--size 60mm --distance 150mm --nodes 129 --facing 0mm --no-verify --no-report";
        let made = workshop.run(&format!("design chiral.png -o {file} {design} {flags}"));
        assert_eq!(made.code, FINE, "{flags}: {}", made.err);
        let more_plates = flags.matches("--then").count();
        let block = if more_plates == 0 { file } else { format!("{k}.{}.stl", more_plates + 1) };
        let seen = workshop.run(&format!("verify {block} -o {light} --photons 100000 --replicates 4 --json"));
        assert_eq!(seen.code, FINE, "{flags}: {}", seen.err);
        let seen: serde_json::Value = serde_json::from_str(&seen.out).unwrap();
        let verifier = seen["result"]["judgement"]["picture"]["rel_rms"].as_f64().unwrap();
        let mut python = common::python(&MODULES, RUN).unwrap();
        python.current_dir(workshop.root()).arg(&script).args([block.as_str(), "--image", light.as_str()]);
        let said = common::output(&mut python);
        let figures: Vec<f64> = said.lines().map(|line| line.rsplit(' ').next().unwrap().parse().unwrap()).collect();
        within_tenth_of(of_verifier, verifier, format_args!("{flags}, the verifier"));
        // 0.003 is asked for.
        at_worst(7.9e-4, (figures[0] - verifier).abs(), format_args!("{flags}: {figures:?}, verifier {verifier}"));
        within_tenth_of(of_picture, figures[0], format!("{flags}, the picture"));
        within_tenth_of(of_image, figures[1], format!("{flags}, the image"));
    }
}
