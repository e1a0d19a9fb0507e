//! Cutters before an independent judge, and the commands `check` and `mill` as a person types them.

mod common;

use common::{
    measured::{at_worst, prints_at_worst, prints_within_tenth_of, within_tenth_of},
    workshop::{FILE, FINE, MESH, REFUSED, SHORT, Workshop},
};
use glam::DVec2;
use glasswarp::{
    fabricate::{Cutter, DropCutter, Milled, Pass},
    grid::{Extent, Field},
    surface::{Finish, HeightField, Polish, SurfaceSpline},
};
use std::{fs, process::Stdio};

/// Reads a height field (columns, rows, width, height, then heights) and lines "kind radius corner
/// x y", and prints the tip heights of OpenCAMLib's drop-cutter on the triangulated field.
const DROP: &str = r"
import sys, opencamlib as ocl
words = iter(sys.stdin.read().split())
nx, ny = int(next(words)), int(next(words))
width, height = float(next(words)), float(next(words))
z = [[float(next(words)) for _ in range(nx)] for _ in range(ny)]
p = lambda i, j: ocl.Point((i / (nx - 1) - 0.5) * width, (j / (ny - 1) - 0.5) * height, z[j][i])
surface = ocl.STLSurf()
for j in range(ny - 1):
    for i in range(nx - 1):
        a, b, c, d = p(i, j), p(i + 1, j), p(i + 1, j + 1), p(i, j + 1)
        surface.addTriangle(ocl.Triangle(a, b, c))
        surface.addTriangle(ocl.Triangle(a, c, d))
groups = {}
for kind in words:
    radius, corner, x, y = (float(next(words)) for _ in range(4))
    groups.setdefault((kind, radius, corner), []).append((x, y))
for (kind, radius, corner), points in groups.items():
    cutter = {'ball': lambda: ocl.BallCutter(2 * radius, 50), 'flat': lambda: ocl.CylCutter(2 * radius, 50),
              'bull': lambda: ocl.BullCutter(2 * radius, corner, 50)}[kind]()
    drop = ocl.BatchDropCutter()
    drop.setSTL(surface)
    drop.setCutter(cutter)
    for x, y in points:
        drop.appendPoint(ocl.CLPoint(x, y, -100))
    drop.run()
    for point in drop.getCLPoints():
        print('%.6f %.6f %.12f' % (point.x, point.y, point.z))
";

#[test]
fn opencamlib_drops_cutters_as_low() {
    let Some(mut python) = common::python(&["opencamlib"], DROP) else { return };
    let (extent, (nx, ny)) = (Extent::new(20.0, 16.0), (401, 321));
    let surface = HeightField::new(
        extent,
        Field::from_fn(nx, ny, |i, j| {
            let p = extent.node(i, j, nx, ny);
            0.25 * (0.8 * p.x).sin() * (0.9 * p.y + 0.4).cos() + 0.04 * p.x - 0.003 * p.y * p.y
        }),
    );
    let mut input = format!("{nx} {ny} {} {}\n", extent.width_mm, extent.height_mm);
    surface.heights_mm().as_slice().iter().for_each(|z| input += &format!("{z:.15}\n"));
    let mut ours = Vec::new();
    for cutter in ["ball:3mm", "ball:1mm", "flat:2mm", "bull:3mm,1mm"] {
        let parsed: Cutter = cutter.parse().unwrap();
        let drop = DropCutter::new(&surface, parsed);
        for k in 0..50 {
            // Over the block, at its border, and beside it.
            let axis = glam::DVec2::new(-10.6 + 0.43 * f64::from(k), -8.5 + 17.0 * f64::from(k * 19 % 50) / 49.0);
            let Some(contact) = drop.drop(axis, axis) else { continue };
            let kind = cutter.split(':').next().unwrap();
            input += &format!("{kind} {} {} {} {}\n", parsed.radius_mm(), parsed.corner_mm(), axis.x, axis.y);
            ours.push((cutter, axis, contact.tip_mm));
        }
    }
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("drops"), input).unwrap();
    let text = common::output(python.stdin(Stdio::from(fs::File::open(folder.path().join("drops")).unwrap())));
    let theirs: Vec<[f64; 3]> = text
        .lines()
        .map(|line| {
            let numbers: Vec<f64> = line.split_whitespace().map(|word| word.parse().unwrap()).collect();
            numbers.try_into().unwrap()
        })
        .collect();
    assert_eq!(theirs.len(), ours.len());
    // The triangles of a spacing of 0.05 mm lie up to 0.05^2 / (8 r) below a face of radius r, and
    // the cutter with them; a sharp rim meets them anywhere. Radii go down to 2.5 mm here.
    for ((cutter, axis, ours), [x, y, theirs]) in ours.iter().zip(theirs) {
        assert!((axis.x - x).abs() < 1e-5 && (axis.y - y).abs() < 1e-5, "the drops come back in another order");
        let off = 1e3 * (ours - theirs);
        at_worst(0.109, off.abs(), format_args!("{cutter} at {axis}: {ours} mm, OpenCAMLib {theirs} mm, um"));
    }
}

/// A small block with its side file.
fn block(workshop: &Workshop, flags: &str) {
    workshop.draw_chiral_picture();
    let line = format!("design chiral.png -o block.stl --size 30mm --distance 120mm --nodes 129 --no-verify {flags}");
    let made = workshop.run(&line);
    assert_eq!(made.code, FINE, "{}", made.err);
}

/// Relative RMS error and SSIM on the line that begins with `name`.
fn row(text: &str, name: &str) -> [f64; 2] {
    let line =
        text.lines().find(|line| line.trim_start().starts_with(name)).unwrap_or_else(|| panic!("{name}:\n{text}"));
    let numbers: Vec<f64> = line.trim_start()[name.len()..].split_whitespace().filter_map(|w| w.parse().ok()).collect();
    [numbers[0], numbers[1]]
}

#[test]
fn a_block_is_milled_polished_and_written() {
    let workshop = Workshop::new();
    block(&workshop, "");
    let line = "mill block.stl --cutter ball:3mm --step-over 0.1mm --polish 0.1mm -o milled.stl -o steps.png";
    let outcome = workshop.run(line);
    assert_eq!(outcome.code, FINE, "{}", outcome.err);
    let designed = row(&outcome.out, "as designed");
    let milled = row(&outcome.out, "milled with ball, 6 mm diameter, rows 0.1 mm apart");
    let polished = row(&outcome.out, "and polished, sigma 0.1 mm");
    for (measured, [found, _], step) in
        [(0.0001, designed, "designed"), (0.0594, milled, "milled"), (0.0012, polished, "polished")]
    {
        prints_within_tenth_of(measured, found, step);
    }
    assert_eq!(image::open(workshop.path("steps.png")).unwrap().width(), 3 * 420 + 4 * 16);
    // The file is what was judged, its side file says so, and the verifier agrees.
    let side = fs::read_to_string(workshop.path("milled.toml")).unwrap();
    assert!(side.contains(
        "milled in simulation with ball, 6 mm diameter, rows 0.1 mm apart along x, polished with sigma 0.1 mm"
    ));
    let verified = workshop.run("verify milled.stl --photons 100000");
    assert!(verified.code == FINE && verified.err.is_empty(), "{}", verified.err);
    let error = verified.out.lines().find(|line| line.contains("relative RMS  ")).unwrap();
    let error: f64 = error.split_whitespace().last().unwrap().parse().unwrap();
    prints_at_worst(0.0002, (error - polished[0]).abs(), format_args!("{error} for {}", polished[0]));
    let strict = workshop.run(&format!("mill block.stl --step-over 0.1mm --max-error {}", 0.5 * milled[0]));
    assert!(strict.code == SHORT && strict.err.contains("--max-error"), "{}", strict.err);
    // Rows along y spoil the picture as much as rows along x, the other way round.
    let across = workshop.run("mill block.stl --step-over 0.1mm --direction y");
    let across = row(&across.out, "milled with ball, 6 mm diameter, rows 0.1 mm apart");
    prints_within_tenth_of(0.0507, across[0], "rows along y");
}

#[test]
fn the_cheapest_cutter_is_found_or_none() {
    let workshop = Workshop::new();
    block(&workshop, "");
    let list = "[[cutter]]\nname = \"small\"\ncutter = \"ball:1mm\"\nfeed = \"1m\"\nstep-overs = [0.05, 0.1, 0.2]\n\n\
                [[cutter]]\ncutter = \"ball:d6mm\"\nfeed = 2000\nstep-overs = [\"0.05mm\", \"0.1mm\", \"0.2mm\"]\n";
    fs::write(workshop.path("cutters.toml"), list).unwrap();
    let found = workshop.run("mill block.stl --cutters cutters.toml --want-error 0.5 --polish 0.1mm");
    assert_eq!(found.code, FINE, "{}", found.err);
    // Everything is good enough for that: the fastest is the coarsest at the greater feed.
    assert!(found.out.contains("Cheapest: ball, 6 mm diameter; 0.2 mm from row to row"), "{}", found.out);
    let none = workshop.run("mill block.stl --cutters cutters.toml --want-error 0.0001 --polish 0.1mm");
    assert!(none.code == SHORT && none.err.contains("no cutter") && none.err.contains("least met"), "{}", none.err);
    workshop.refuses("mill block.stl --cutters cutters.toml", REFUSED, &["--want-error"]);
    fs::write(workshop.path("wrong.toml"), list.replace("ball:1mm", "cone:1mm")).unwrap();
    workshop.refuses("mill block.stl --cutters wrong.toml --want-error 0.1", REFUSED, &["cone", "ball:d6mm"]);
    fs::write(workshop.path("slow.toml"), list.replace("2000", "-5")).unwrap();
    workshop.refuses("mill block.stl --cutters slow.toml --want-error 0.1", REFUSED, &["feed", "-5"]);
    workshop.refuses("mill block.stl --cutters nothing.toml --want-error 0.1", FILE, &["nothing.toml"]);
}

#[test]
fn a_block_designed_for_its_polish_is_better_after_it() {
    let workshop = Workshop::new();
    block(&workshop, "");
    let plain = row(
        &workshop.run("mill block.stl --cutter ball:6mm --step-over 0.1mm --polish 0.2mm").out,
        "polished alone, sigma 0.2 mm",
    );
    block(&workshop, "--finish polish=0.2mm");
    let side = fs::read_to_string(workshop.path("block.toml")).unwrap();
    assert!(side.contains("finish = \"polish=0.2mm,gain=6\""), "{side}");
    let outcome = workshop.run("mill block.stl --cutter ball:6mm --step-over 0.1mm --polish 0.2mm").out;
    let [as_cut, finished] = ["as designed", "polished alone, sigma 0.2 mm"].map(|name| row(&outcome, name));
    for (measured, [found, _], what) in [
        (0.0030, plain, "not made for its polish"),
        (0.0002, finished, "made for it"),
        (0.0264, as_cut, "made for it, as cut"),
    ] {
        prints_within_tenth_of(measured, found, what);
    }
}

/// The mean height of ridges against the face that a ball leaves, both after a polish as wide as the
/// rows are apart.
#[test]
fn ridges_are_as_high_on_average_as_those_of_milled_faces() {
    let extent = Extent::new(12.0, 12.0);
    // Waves of 2.5 mm, whose hollows have a radius of 4 mm.
    let wave = |at: DVec2| 0.02 * ((2.5 * at.x).cos() + (2.5 * at.y).cos()) + 0.05 * at.y;
    let face = HeightField::new(extent, Field::from_fn(121, 121, |i, j| wave(extent.node(i, j, 121, 121))));
    let (polish, radius_mm, step_over_mm) = (Polish::new(0.2).unwrap(), 3.0, 0.2);
    let pass = Pass::finishing(Cutter::ball(radius_mm).unwrap(), step_over_mm);
    let milled = polish.polished(&Milled::of(&face, pass).unwrap().surface);
    let expected = Finish::new(polish).with_ball(radius_mm, step_over_mm).finished(&face);
    let plain = polish.polished(&face);
    let spline = SurfaceSpline::through(&milled);
    let inner: Vec<(usize, usize)> = (20..101).flat_map(|j| (20..101).map(move |i| (i, j))).collect();
    let rms_um = |of: &HeightField| {
        let off: Vec<f64> = inner
            .iter()
            .map(|&(i, j)| of.heights_mm()[(i, j)] - spline.sample(extent.node(i, j, 121, 121)).height_mm)
            .collect();
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        1e3 * (off.iter().map(|off| (off - mean).powi(2)).sum::<f64>() / off.len() as f64).sqrt()
    };
    within_tenth_of(0.1498, rms_um(&plain), "um from the milled face without ridges");
    within_tenth_of(0.0070, rms_um(&expected), "um from the milled face with their mean");
}

#[test]
fn a_check_gives_a_verdict_per_line_and_fails_with_its_own_code() {
    let workshop = Workshop::new();
    block(&workshop, "");
    let good = workshop.run("check block.stl --cutter ball:d6mm --step-over 0.05mm --polish 0.1mm -o check.png");
    assert_eq!(good.code, FINE, "{}{}", good.out, good.err);
    for word in ["hollows", "slope", "light", "relief", "thickness", "scallops", "facets", "least concave radius"] {
        assert!(good.out.contains(word), "'{word}' is not in\n{}", good.out);
    }
    assert!(!good.out.contains("FAIL"), "{}", good.out);
    assert!(workshop.path("check.png").exists());
    for (flags, line) in [
        ("--cutter ball:14mm --step-over 0.05mm --polish 0.1mm --max-blur 0.001um", None),
        ("--step-over 0.4mm", Some("FAIL  scallops")),
        ("--polish 0.1mm --max-slope 0.5deg", Some("FAIL  slope")),
        ("--polish 0.1mm --stock 3mm", Some("FAIL  thickness")),
        ("--polish 0.1mm --min-thickness 14mm", Some("FAIL  thickness")),
        ("--polish 0.1mm --ior 12", None),
        ("--cutter flat:3mm", Some("FAIL  hollows")),
    ] {
        let outcome = workshop.run(&format!("check block.stl {flags}"));
        match line {
            Some(line) => {
                assert!(outcome.code == SHORT && outcome.out.contains(line), "{flags}: {}{}", outcome.out, outcome.err);
            }
            None => assert_eq!(outcome.code, REFUSED, "{flags}: {}{}", outcome.out, outcome.err),
        }
    }
    // What fails says what would do.
    for (flags, words) in [
        ("--cutter flat:d6mm", &["--cutter ball:d6mm would do", "with --step-over"][..]),
        ("--polish 0.1mm --max-slope 0.5deg", &["a design with --distance"][..]),
        ("--polish 0.1mm --stock 3mm", &["a stock of"][..]),
        ("--polish 0.1mm --min-thickness 14mm", &["a design with --thickness"][..]),
        ("--polish 0.1mm --max-blur 0.02mm", &["a design with --nodes", "or a STEP", "um in the CAM program"][..]),
        ("--polish 0.1mm --max-blur 0.001mm", &["a STEP would do", "um in the CAM program"][..]),
        ("--step-over 0.4mm", &["a step-over of", "or a polish of"][..]),
    ] {
        let outcome = workshop.run(&format!("check block.stl {flags}"));
        let failed: String = outcome.out.lines().filter(|line| line.contains("FAIL")).collect();
        assert!(words.iter().all(|words| failed.contains(*words)), "{flags}: {failed}");
    }
    // A STEP has no triangles.
    let made = workshop.run(
        "design chiral.png -o block.step --size 30mm --distance 120mm --nodes 129 --no-verify --no-report --force",
    );
    assert_eq!(made.code, FINE, "{}", made.err);
    let smooth = workshop.run("check block.step --polish 0.1mm --max-blur 0.001mm");
    assert!(smooth.out.contains("ok    facets      none: the file holds the smooth face"), "{}", smooth.out);
    // A design file, and a block without a side file.
    fs::write(workshop.path("design.toml"), "[design]\npicture = \"chiral.png\"\nsize = \"30mm\"\nnodes = 129\n")
        .unwrap();
    assert_eq!(workshop.run("check design.toml --polish 0.1mm").code, FINE);
    fs::remove_file(workshop.path("block.toml")).unwrap();
    workshop.refuses("check block.stl", REFUSED, &["side file", "--ior"]);
    assert_eq!(workshop.run("check block.stl --ior 1.5 --distance 120mm --polish 0.1mm").code, FINE);
}

#[test]
fn the_wall_of_a_rim_keeps_a_cutter_from_the_face() {
    let workshop = Workshop::new();
    block(&workshop, "--rim 4mm,0.5mm");
    let checked = workshop.run("check block.stl --polish 0.1mm");
    let line = checked.out.lines().find(|line| line.contains("FAIL  rim")).expect("a rim that does not fail");
    let share: f64 = line
        .split_whitespace()
        .zip(line.split_whitespace().skip(1))
        .find(|(_, unit)| *unit == "%")
        .unwrap()
        .0
        .parse()
        .unwrap();
    // At most all that is 3 mm from a wall of the 30 mm, and more than what is 1 mm from it.
    within_tenth_of(33.7, share, line);
    assert!(line.contains("a flange below the face (--rim WIDTH,-"), "{line}");
    let milled = workshop.run("mill block.stl --step-over 0.2mm --polish 0.2mm -o milled.stl");
    assert_eq!(milled.code, FINE, "{}", milled.err);
    assert!(
        milled.out.contains(&format!("rim            its wall keeps the cutter from {share:.1} % of the face")),
        "{}",
        milled.out
    );
    // What is lost beside the wall is seen, in the study as in the file.
    let [designed, polished] = ["as designed", "and polished, sigma 0.2 mm"].map(|step| row(&milled.out, step)[0]);
    prints_within_tenth_of(0.0001, designed, "in a rim, as designed");
    prints_within_tenth_of(0.5932, polished, "in a rim, milled and polished");
    let verified = workshop.run("verify milled.stl --photons 100000");
    assert_eq!(verified.code, FINE, "{}", verified.err);
    block(&workshop, "--thickness 12mm --rim 4mm,-9mm --force");
    let checked = workshop.run("check block.stl --polish 0.1mm");
    assert!(!checked.out.contains("FAIL  rim"), "{}", checked.out);
    let milled = workshop.run("mill block.stl --step-over 0.2mm --polish 0.2mm");
    assert!(milled.code == FINE && !milled.out.contains("its wall keeps"), "{}{}", milled.out, milled.err);
}

#[test]
fn tolerances_are_traced_and_the_focus_is_found() {
    let workshop = Workshop::new();
    block(&workshop, "");
    let line = "check block.stl --polish 0.1mm --tolerance --source-size 0.53deg --pixels 48 --distance-off 4mm -o tolerance.png";
    let outcome = workshop.run(line);
    assert_eq!(outcome.code, FINE, "{}{}", outcome.out, outcome.err);
    let error = |name: &str| row(&outcome.out, name)[0];
    let designed = error("as designed");
    for (measured, worse) in [
        (0.0207, "receiver at 116 mm (-4)"),
        (0.0212, "receiver at 124 mm (+4)"),
        (0.0471, "light 0.53 degrees across"),
    ] {
        prints_within_tenth_of(measured, error(worse), worse);
    }
    // Straight light does not care how thick the block is.
    assert_eq!(error("stock 0.5 mm thicker, receiver where it was"), designed, "{}", outcome.out);
    assert!(outcome.out.contains("Depth of focus"), "{}", outcome.out);
    // At its ends the verifier finds the error that it was asked for.
    let focus = outcome.out.lines().find(|line| line.starts_with("Depth of focus")).unwrap();
    let numbers: Vec<f64> = focus.split([' ', ')']).filter_map(|word| word.parse().ok()).collect();
    let [limit, near, far] = numbers[..] else { panic!("{focus}") };
    within_tenth_of(0.04, 120.0 - near, focus);
    within_tenth_of(0.04, far - 120.0, focus);
    // Printed are four decimals of both.
    assert!((limit - 2.0 * designed).abs() < 1.51e-4, "{focus}");
    for distance in [near, far] {
        let seen = workshop.run(&format!("verify block.stl --distance {distance}mm --photons 100000")).out;
        let line = seen.lines().find(|line| line.contains("relative RMS  ")).unwrap();
        let error: f64 = line.split_whitespace().last().unwrap().parse().unwrap();
        prints_at_worst(0.0, (error - limit).abs(), format_args!("{distance}: {error} for {limit}"));
    }
    let impossible = workshop
        .run("check block.stl --polish 0.1mm --tolerance --source-size 0.53deg --pixels 48 --focus-error 0.00001");
    assert!(impossible.code == SHORT && impossible.err.contains("--focus-error"), "{}", impossible.err);
    workshop.refuses("check block.stl --tolerance --tilt-off 80deg", REFUSED, &["--tilt-off", "80"]);
}

#[test]
fn what_cannot_be_milled_is_refused() {
    let workshop = Workshop::new();
    block(&workshop, "");
    for command in ["mill", "check"] {
        for (flags, words) in [
            ("--cutter ball:12mm", ["24 mm across", "30 x 20 mm"]),
            ("--cutter ball:-3mm", ["-3 mm", "0.01"]),
            ("--cutter cone:3mm", ["cone", "ball:d6mm"]),
            ("--step-over -0.1mm", ["-0.1 mm", "6 mm"]),
            ("--step-over 0", ["0 mm", "6 mm"]),
            ("--polish -1mm", ["-1 mm", "5 mm"]),
        ] {
            workshop.refuses(&format!("{command} block.stl {flags}"), REFUSED, &words);
        }
    }
    workshop.refuses("mill block.stl --direction up", REFUSED, &["up", "45deg"]);
    workshop.refuses("mill block.stl --feed 0", REFUSED, &["feed", "0 mm"]);
    workshop.refuses("mill block.stl --allowance=-1mm", REFUSED, &["allowance", "-1 mm"]);
    workshop.refuses("mill block.stl --step-over 0.002mm --direction 45deg", REFUSED, &["nodes", "larger step-over"]);
    workshop.refuses("mill block.stl -o milled.xyz", REFUSED, &[".xyz"]);
    workshop.refuses("check block.stl -o check.txt", REFUSED, &[".png"]);
    workshop.refuses("mill nothing.stl", FILE, &["nothing.stl"]);
    for finish in ["polish=-1mm", "cutter=flat:3mm", "gain=3"] {
        workshop.refuses(&format!("design picture.png -o b.stl --finish {finish}"), REFUSED, &["finish"]);
    }
    workshop.refuses(
        "design picture.png -o b.stl --solver warping --finish polish=0.1mm",
        REFUSED,
        &["--finish", "warping"],
    );
    // A corrupted file, and a solid that is no block.
    let bytes = fs::read(workshop.path("block.stl")).unwrap();
    fs::write(workshop.path("cut.stl"), &bytes[..bytes.len() / 2]).unwrap();
    let tetrahedron = "solid t\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 1 0 0\nendloop\nendfacet\n\
        facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1\nendloop\nendfacet\n\
        facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 1\nvertex 0 1 0\nendloop\nendfacet\n\
        facet normal 0 0 0\nouter loop\nvertex 1 0 0\nvertex 0 1 0\nvertex 0 0 1\nendloop\nendfacet\nendsolid t\n";
    fs::write(workshop.path("other.stl"), tetrahedron).unwrap();
    for command in ["mill", "check"] {
        workshop.refuses(&format!("{command} cut.stl --bench block.toml"), MESH, &["cut.stl", "truncated"]);
        workshop.refuses(&format!("{command} other.stl --bench block.toml"), MESH, &["other.stl", "no block"]);
    }
}
