//! The test coupon, read as a person reads it from light that was traced through its exported file:
//! polish, index, step-over and direction of the rows are found again, whatever they were.

mod common;

use common::{
    measured::at_worst,
    workshop::{FINE, REFUSED, Workshop},
};
use glam::{DVec2, DVec3};
use glasswarp::{
    export::{Format, export},
    fabricate::{CHORD_MM, Cutter, Direction, FaceShape, Machining, Pass, Post},
    solid::{Shape, Solid, Stock},
    study::coupon::{Coupon, CouponPlan, CouponState, Polished, Reading},
    surface::{Polish, SurfaceSpline},
};
use glasswarp_verify::{Block, load, solid};
use std::{path::Path, sync::OnceLock};

/// Photons to a sheet; they are the same on every machine.
const PHOTONS: u64 = 1 << 22;

fn plan(diameter_mm: f64) -> CouponPlan {
    CouponPlan {
        ior: 1.49,
        distance_mm: 1000.0,
        lamp_mm: 3000.0,
        lamp_diameter_mm: 3.0,
        cutter: Cutter::ball(0.5 * diameter_mm).unwrap(),
        stock: Stock::thinnest_sheet(),
    }
}

fn write(coupon: &Coupon, path: &Path) {
    export(path, &coupon.solid, &coupon.export_design()).unwrap();
}

/// The coupon for a ball of 6 mm, and what a stranger finds in its STL.
fn coupon() -> &'static (Coupon, Block) {
    static COUPON: OnceLock<(Coupon, Block)> = OnceLock::new();
    COUPON.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("coupon.stl");
        let coupon = Coupon::of(plan(6.0), Shape::default()).unwrap();
        write(&coupon, &path);
        let mesh = load::read(&path).unwrap();
        let block = Block::from_mesh(&mesh).unwrap();
        (coupon, block)
    })
}

fn read(state: &CouponState) -> Reading {
    let (coupon, block) = coupon();
    let image = coupon.seen(block, state, PHOTONS).unwrap();
    Reading::of(coupon, &image, &Coupon::window()).unwrap()
}

fn polish_in(reading: &Reading) -> Polished {
    reading.ladder.as_ref().expect("a ladder").polish
}

fn polish(sigma_mm: f64) -> Option<Polish> {
    Some(Polish::new(sigma_mm).unwrap())
}

fn pass(step_over_mm: f64, degrees: f64) -> Option<Pass> {
    let (cutter, direction) = (plan(6.0).cutter, Direction::at(degrees));
    Some(Pass { cutter, step_over_mm, direction, allowance_mm: 0.0 })
}

#[test]
fn five_polishes_are_read_from_the_ladder() {
    for sigma in [0.06, 0.09, 0.15, 0.25, 0.4] {
        let reading = read(&CouponState { ior: 1.491, pass: None, polish: polish(sigma) });
        let error = (polish_in(&reading).sigma_mm() / sigma - 1.0).abs();
        eprintln!("sigma {sigma}: {:?}, off by {:.1} %", polish_in(&reading), 100.0 * error);
        assert!(matches!(polish_in(&reading), Polished::Between { .. }));
        at_worst(0.0135, error, format_args!("sigma {sigma}"));
    }
}

#[test]
fn a_polish_beyond_the_ladder_is_said_to_be() {
    let unpolished = read(&CouponState { ior: 1.49, pass: None, polish: None });
    assert!(matches!(polish_in(&unpolished), Polished::Below { .. }), "{:?}", polish_in(&unpolished));
    let fine = read(&CouponState { ior: 1.49, pass: None, polish: polish(0.035) });
    let Polished::Below { sigma_mm } = polish_in(&fine) else { panic!("{:?}", polish_in(&fine)) };
    eprintln!("sigma 0.035, below the ladder: {sigma_mm:.4}");
    at_worst(0.061, (sigma_mm / 0.035 - 1.0).abs(), "below the ladder");
    let coarse = read(&CouponState { ior: 1.49, pass: None, polish: polish(0.6) });
    assert!(matches!(polish_in(&coarse), Polished::Above { .. }), "{:?}", polish_in(&coarse));
}

#[test]
fn three_indices_are_read_from_the_uprights() {
    // Planned for 1.49 all the same, and polished.
    for (ior, sigma) in [(1.4585, 0.1), (1.491, 0.2), (1.585, 0.1)] {
        let reading = read(&CouponState { ior, pass: None, polish: polish(sigma) });
        let error = (reading.ior - ior).abs();
        eprintln!("index {ior}: {:.2} mm apart, {:.4}; {:?}", reading.uprights_mm, reading.ior, polish_in(&reading));
        at_worst(1.4e-4, error, format_args!("index {ior}"));
        // What lies out of focus at another index than that of the plan still tells the polish.
        at_worst(0.038, (polish_in(&reading).sigma_mm() / sigma - 1.0).abs(), format_args!("polish at index {ior}"));
    }
}

#[test]
fn step_over_and_direction_are_read_from_the_streak() {
    for (step_over, degrees) in [(0.1, 0.0), (0.2, 0.0), (0.1, 90.0), (0.2, 90.0), (0.15, 30.0)] {
        let reading = read(&CouponState { ior: 1.491, pass: pass(step_over, degrees), polish: None });
        let streak = reading.streak.expect("a streak");
        eprintln!("rows {step_over} mm apart at {degrees} degrees: {streak:?}");
        at_worst(0.036, (streak.step_over_mm / step_over - 1.0).abs(), format_args!("{step_over} at {degrees}"));
        // Rows of another direction than along x make the bars longer: they say nothing of polish.
        assert_eq!(reading.ladder.is_some(), degrees == 0.0, "{:?}", reading.ladder);
        let off = (streak.rows_deg - degrees + 90.0).rem_euclid(180.0) - 90.0;
        at_worst(if degrees == 30.0 { 0.356 } else { 0.052 }, off.abs(), format_args!("direction {degrees}"));
    }
}

#[test]
fn a_milled_coupon_tells_the_polish_after_it() {
    // Rows along x, as the page asks for: their scallops throw light across the bars.
    for (step_over, sigma) in [(0.1, 0.1), (0.2, 0.07)] {
        let state = CouponState { ior: 1.491, pass: pass(step_over, 0.0), polish: polish(sigma) };
        let reading = read(&state);
        eprintln!("milled {step_over}, polished {sigma}: index {:.4}, {:?}", reading.ior, polish_in(&reading));
        at_worst(0.0057, (polish_in(&reading).sigma_mm() / sigma - 1.0).abs(), format_args!("sigma {sigma}"));
        at_worst(1.2e-4, (reading.ior - 1.491).abs(), "index");
    }
}

#[test]
fn a_wrong_distance_enters_as_the_page_says() {
    // The page says 0.5 units of the third decimal for a millimetre in a metre.
    let (coupon, _) = coupon();
    let further = Coupon::of(CouponPlan { distance_mm: 1001.0, ..coupon.plan }, Shape::default()).unwrap();
    assert!(further.distance_mm() > coupon.distance_mm());
    let seen = coupon.uprights_mm(1.491);
    let per_mm = coupon.ior_per_mm(1.491);
    // By the traced light of the same glass one millimetre further away.
    let (_, block) = self::coupon();
    let mut scene = coupon.scene(1.491);
    scene.distance_mm += 1.0;
    let tracer = glasswarp_verify::Tracer::for_block(block, &scene).unwrap();
    let plan = glasswarp_verify::PhotonPlan::new(PHOTONS, 1).with_replicates(2);
    let image = glasswarp_verify::photons(&tracer, &plan).unwrap().image();
    let reading = Reading::of(coupon, &image, &Coupon::window()).unwrap();
    eprintln!(
        "1 mm further: {:.3} for {seen:.3} mm apart, index {:.5}, {per_mm:.5} per mm",
        reading.uprights_mm, reading.ior
    );
    at_worst(1.0e-4, (reading.ior - 1.491 - per_mm).abs(), "a millimetre");
}

#[test]
fn the_face_is_within_reach_of_its_cutter() {
    for diameter in [2.0, 3.0, 6.0, 8.0] {
        let coupon = Coupon::of(plan(diameter), Shape::default()).unwrap();
        let sharpest = FaceShape::of(coupon.surface()).sharpest().radius_mm;
        let rulings = (coupon.rulings[0].sigma_mm, coupon.rulings[15].sigma_mm);
        eprintln!("ball of {diameter} mm: hollows of {sharpest:.2} mm and more, sigma {rulings:?}");
        assert!(sharpest >= 0.5 * diameter, "{sharpest} for a ball of {diameter} mm");
        for pair in coupon.rulings.windows(2) {
            let ratio = pair[0].sigma_mm / pair[1].sigma_mm;
            assert!(ratio > 1.0 && ratio < 1.16, "{ratio}");
        }
    }
}

#[test]
fn what_cannot_be_a_coupon_is_refused_with_a_remedy() {
    let refused = |plan: CouponPlan, words: &[&str]| {
        let error = Coupon::of(plan, Shape::default()).unwrap_err().to_string();
        for word in words {
            assert!(error.contains(word), "{word} is not in: {error}");
        }
    };
    let fine = plan(6.0);
    refused(CouponPlan { cutter: Cutter::flat(3.0).unwrap(), ..fine }, &["flat", "ball"]);
    refused(CouponPlan { cutter: Cutter::ball(12.0).unwrap(), ..fine }, &["smaller cutter"]);
    refused(CouponPlan { lamp_diameter_mm: 9.0, ..fine }, &["9 mm", "6000 mm away"]);
    refused(CouponPlan { lamp_diameter_mm: f64::NAN, ..fine }, &["lamp"]);
    refused(CouponPlan { ior: 1.0, ..fine }, &["1.3", "2"]);
    refused(CouponPlan { distance_mm: 100.0, ..fine }, &["100", "500"]);
    refused(CouponPlan { lamp_mm: f64::INFINITY, ..fine }, &["inf"]);
    refused(CouponPlan { stock: Stock::of_thickness(4.0), ..fine }, &["4 mm", "mm"]);
}

#[test]
fn the_files_are_sound() {
    let folder = tempfile::tempdir().unwrap();
    let (coupon, block) = coupon();
    assert_eq!(block.size_mm(), DVec2::new(32.0, 40.0));
    for format in Format::ALL {
        let path = folder.path().join(format!("coupon.{format}"));
        write(coupon, &path);
        let mesh = load::read(&path).unwrap();
        let report = solid::check(&mesh);
        assert!(report.is_closed(), "{format}: {report:?}");
    }
    let Some(mut admesh) = common::program("admesh", "Debian package admesh") else { return };
    let report = common::output(admesh.arg(folder.path().join("coupon.stl")));
    for fault in ["Total disconnected facets", "Facets reversed", "Edges fixed", "Facets removed", "Degenerate facets"]
    {
        let line = report.lines().find(|line| line.trim_start().starts_with(fault)).expect(fault);
        let figure = line.rsplit(':').next().and_then(|figure| figure.split_whitespace().next());
        assert_eq!(figure, Some("0"), "{fault}\n{report}");
    }
}

#[test]
fn a_kernel_that_is_not_opencascade_finds_a_closed_shell() {
    use truck_stepio::r#in::{Table, alias};
    use truck_topology::shell::ShellCondition;

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("coupon.step");
    write(&coupon().0, &path);
    let text = std::fs::read_to_string(&path).unwrap();
    let exchange = ruststep::parser::parse(&text).unwrap();
    let table = Table::from_data_section(&exchange.data[0]);
    let holder = table.shell.values().next().expect("a shell").clone();
    let shell = table.to_compressed_shell(&holder).unwrap();
    assert_eq!(shell.faces.len(), 6);
    type Shell = truck_topology::Shell<truck_meshalgo::prelude::Point3, alias::Curve3D, alias::Surface>;
    assert_eq!(Shell::extract(shell).unwrap().shell_condition(), ShellCondition::Closed);
}

/// The numbers in brackets of a line of the interpreter.
fn place(line: &str) -> DVec3 {
    let inside = line.split(['(', ')']).nth(1).unwrap_or_default();
    let numbers: Vec<f64> = inside.split(',').filter_map(|number| number.trim().parse().ok()).collect();
    DVec3::new(numbers[0], numbers[1], numbers[2])
}

#[test]
fn the_program_keeps_to_the_face_before_the_interpreter_of_linuxcnc() {
    const SAFE_MM: f64 = 5.0;
    // rs274 prints four decimals.
    const PRINTED_MM: f64 = 6e-5;
    let (coupon, _) = coupon();
    let folder = tempfile::tempdir().unwrap();
    let top = Solid::highest_mm(coupon.surface());
    let cutter = coupon.plan.cutter;
    let spline = SurfaceSpline::through(coupon.surface());
    let half = 0.5 * coupon.surface().extent().as_vec();
    for (degrees, origin) in [(0.0, DVec3::ZERO), (90.0, DVec3::new(-16.0, -20.0, -5.0)), (30.0, DVec3::ZERO)] {
        let pass = Pass { cutter, step_over_mm: 1.0, direction: Direction::at(degrees), allowance_mm: 0.0 };
        let machining = Machining {
            feed_mm_per_min: 1000.0,
            spindle_per_min: 18_000.0,
            safe_mm: SAFE_MM,
            chord_mm: CHORD_MM,
            arcs: false,
            post: Post::LinuxCnc,
        };
        let mut program = Vec::new();
        let (mut whole, header) = (coupon.program(pass, machining), ["a test (of brackets)".to_owned()]);
        whole.place.origin_mm = origin;
        whole.write(&mut program, "coupon", &header).unwrap();
        let path = folder.path().join("coupon.ngc");
        std::fs::write(&path, &program).unwrap();
        let strokes = String::from_utf8(program).unwrap().lines().filter(|line| line.starts_with("G1 ")).count();
        let Some(mut interpreter) = common::program("rs274", "Debian package linuxcnc-uspace") else { return };
        let moves = common::output(interpreter.arg("-g").arg(&path));
        assert!(moves.contains("CANON_UNITS_MM") && moves.contains("CANON_PLANE_XY") && moves.contains("PROGRAM_END"));
        let is_move = |line: &&str| line.contains("STRAIGHT_TRAVERSE") || line.contains("STRAIGHT_FEED");
        let moves: Vec<(bool, DVec3)> =
            moves.lines().filter(is_move).map(|line| (line.contains("FEED"), place(line) + origin)).collect();
        assert_eq!(moves.iter().filter(|(feeds, _)| *feeds).count(), strokes);
        let safe = top + SAFE_MM;
        // Up before anything else, and fast only there.
        assert!(moves.iter().filter(|(feeds, _)| !feeds).all(|(_, to)| (to.z - safe).abs() < PRINTED_MM));
        assert!(!moves[0].0 && moves[0].1.truncate() == origin.truncate());
        let lowest = moves.iter().map(|(_, to)| to.z).fold(f64::INFINITY, f64::min);
        assert!(lowest > coupon.solid.entry_z_mm() + 3.0, "{lowest}");
        // No stroke is in the glass, and inside of the face every one touches it.
        let (mut deepest, mut furthest) = (f64::INFINITY, 0f64);
        for (_, tip) in moves.iter().filter(|(feeds, _)| *feeds).step_by(61) {
            let mut least = f64::INFINITY;
            for k in 0..61 * 61 {
                let off = 0.05 * DVec2::new(f64::from(k % 61 - 30), f64::from(k / 61 - 30));
                let at = tip.truncate() + off;
                if at.abs().cmple(half).all() && off.length() < cutter.radius_mm() {
                    let gap = tip.z + cutter.profile_mm(off.length()) - spline.sample(at).height_mm;
                    least = least.min(gap);
                }
            }
            deepest = deepest.min(least);
            if (tip.truncate().abs() + 1.0).cmple(half).all() {
                furthest = furthest.max(least);
            }
        }
        eprintln!("rows at {degrees} degrees: {strokes} strokes, {deepest:.6} mm in the glass, {furthest:.6} mm above");
        assert!(deepest > -PRINTED_MM, "{deepest}");
        // As much as a grid of 0.05 mm misses of the place where the cutter touches.
        assert!(furthest < 3e-4, "{furthest}");
    }
}

#[test]
fn the_command_writes_what_it_is_asked_for_and_says_what_is_read_from_it() {
    let workshop = Workshop::new();
    let files = "-o c.stl -o c.step -o c.ngc";
    let outcome = workshop.run(&format!("coupon {files} --step-over 0.2mm --origin corner --json"));
    assert_eq!(outcome.code, FINE, "{}", outcome.err);
    assert_eq!(workshop.files(), ["c.html", "c.ngc", "c.step", "c.stl", "picture.png"]);
    let document: serde_json::Value = serde_json::from_str(&outcome.out).unwrap();
    let coupon = &document["result"];
    assert_eq!(coupon["files"].as_array().unwrap().len(), 4);
    let readings = coupon["readings"].as_array().unwrap();
    let number = |reading: usize, key: &str| readings[reading][key].as_f64().unwrap();
    at_worst(0.0141, (number(0, "step_over_read_mm") / 0.2 - 1.0).abs(), "step-over");
    assert!(readings[0]["polish_read_mm"].is_null(), "{}", readings[0]);
    at_worst(0.00452, (number(1, "polish_read_mm") / 0.1 - 1.0).abs(), "polish");
    at_worst(3.31e-4, (number(3, "ior_read") - number(3, "ior")).abs(), "index");
    let page = std::fs::read_to_string(workshop.path("c.html")).unwrap();
    for words in ["--finish polish=", "--ior 1.49", "--step-over 0.2mm", "--direction x", "width: 196mm"] {
        assert!(page.contains(words), "{words}");
    }
    // Files of somebody's own stay, and what makes no sense is refused with a remedy.
    std::fs::write(workshop.path("own.ngc"), "mine").unwrap();
    workshop.refuses("coupon -o own.ngc", REFUSED, &["own.ngc", "--force"]);
    workshop.refuses("coupon -o c.dxf", REFUSED, &["dxf", ".ngc", ".html"]);
    workshop.refuses("coupon -o d.stl --cutter flat:d6mm", REFUSED, &["flat", "--cutter"]);
    workshop.refuses("coupon -o d.stl --lamp-diameter 20mm", REFUSED, &["--lamp-distance"]);
    workshop.refuses("coupon -o d.stl --feed 0mm", REFUSED, &["--feed"]);
    workshop.refuses("coupon -o d.stl --material butter", REFUSED, &["butter"]);
    workshop.refuses("coupon -o d.stl --step-over 0mm", REFUSED, &["step-over"]);
}
