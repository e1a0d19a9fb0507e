//! What a workshop does with blocks that are not rectangular: checks, height maps, milling, rims,
//! oblique light, other renderers.

mod common;

use common::{
    measured::{at_worst, prints_at_worst, prints_within_tenth_of, within_tenth_of},
    workshop::{FINE, REFUSED, Workshop},
};
use glam::{DVec2, DVec3};
use glasswarp::{
    bench::ExitFace,
    export::{Design, Format, HeightMap, export},
    fabricate::{Cutter, Direction, Milled, Pass, tool_offset},
    grid::{Extent, Field, Outline},
    solid::{Rim, Shape, Solid, Stock},
    surface::{HeightField, SurfaceSpline},
};
use glasswarp_verify::{Block, End, Light, Scene, Tracer, Window, beams, load};

const OUTLINES: [Outline; 2] = [Outline::Circle, Outline::Rounded { radius_mm: 6.0 }];
const EXTENT: Extent = Extent::new(40.0, 32.0);

fn face(outline: Outline, (nx, ny): (usize, usize), h: impl Fn(DVec2) -> f64) -> HeightField {
    HeightField::outlined(EXTENT, outline, Field::from_fn(nx, ny, |i, j| h(EXTENT.node(i, j, nx, ny))))
}

/// The top of a ball, as high as the mean of the face demands; the radius of the ball, mm.
const BALL_MM: f64 = 60.0;

fn dome(at: DVec2) -> f64 {
    (BALL_MM * BALL_MM - at.length_squared()).sqrt()
}

/// The picture of a workshop as a round block, 129 nodes across, and the relative RMS error that
/// its design prints.
fn round(workshop: &Workshop, more: &str) -> f64 {
    let design =
        "design -v picture.png -o round.stl --nodes 114 --transfer linear --outline circle --ior 1.5 --no-report";
    let made = workshop.run(&format!("{design} {more}"));
    assert_eq!(made.code, FINE, "{}{}", made.out, made.err);
    number(&made.out, "relative RMS")
}

/// The first number of the line that begins with these words.
fn number(out: &str, words: &str) -> f64 {
    let line = out.lines().find_map(|line| line.trim().strip_prefix(words)).unwrap_or_else(|| panic!("{words}\n{out}"));
    line.split_whitespace().find_map(|word| word.parse().ok()).unwrap_or_else(|| panic!("no number in {line}"))
}

#[test]
fn a_height_map_goes_on_beyond_the_outline_and_is_read_back_within_it() {
    let folder = tempfile::tempdir().unwrap();
    for outline in OUTLINES {
        let face =
            face(outline, (121, 97), |p| 0.3 * (0.21 * p.x).sin() * (0.17 * p.y + 0.4).cos() + 0.002 * p.x * p.x);
        let (spline, contour) = (SurfaceSpline::through(&face), face.contour());
        let map = HeightMap::of(&Solid::new(&face, Stock::default()).unwrap());
        let mask = map.mask().unwrap();
        let white = mask.pixels().map(|p| f64::from(p.0[0]) / 255.0).sum::<f64>() / (120.0 * 96.0);
        at_worst(1.5e-4, (white / contour.share_of_extent() - 1.0).abs(), format_args!("{outline:?}: {white}"));
        // Far from the face nothing is much deeper than it, and nothing higher but near its
        // outline.
        let ((low, high), (black, top)) = (face.range_mm(), map.range_mm());
        assert!(black > low - 0.1 * (high - low) && top < high + 0.1 * (high - low), "{black} to {top}");
        for name in ["heights.exr", "heights.png"] {
            let path = folder.path().join(name);
            map.write(&path).unwrap();
            let block = Block::from_mesh(&load::read(&path).unwrap()).unwrap();
            assert!(!block.is_rectangular());
            assert_eq!(block.nodes(), (121, 97));
            let window = Window { size_mm: DVec2::new(40.0, 32.0), centre_mm: DVec2::ZERO, nx: 50, ny: 40 };
            let tracer = Tracer::for_block(&block, &Scene::new(1.5, 100.0, window)).unwrap();
            // Steps of 16 bits over a relief of 1 mm are slopes of 5e-5; over 100 mm, half of it
            // bends light.
            let measured_mm = if name.ends_with("png") { 4.16e-3 } else { 2.39e-4 };
            for k in 0..1500 {
                let at = 0.5 * DVec2::new(40.0, 32.0) * DVec2::from_angle(0.4 * f64::from(k)) * (f64::from(k) / 1500.0);
                if !contour.contains(1.002 * at) {
                    continue;
                }
                let sample = spline.sample(at);
                let normal = (-sample.slope).extend(1.0).normalize();
                let cosine = normal.z;
                let refracted =
                    1.5 * DVec3::Z + ((1.0 - 2.25 * (1.0 - cosine * cosine)).sqrt() - 1.5 * cosine) * normal;
                let landing = at + refracted.truncate() * ((100.0 - sample.height_mm) / refracted.z);
                let End::Receiver(got) = tracer.path(at).end else { panic!("no landing at {at}") };
                at_worst(measured_mm, (got - landing).length(), format_args!("{outline:?} {name} {at}, mm"));
            }
            assert!(tracer.path(1.01 * DVec2::new(20.0, 0.0)).end == End::Beside);
        }
    }
}

#[test]
fn the_tip_of_a_cutter_over_a_round_face_goes_on_as_over_a_larger_one() {
    for outline in OUTLINES {
        let face = face(outline, (121, 97), dome);
        let offset_mm = dome(DVec2::ZERO) - SurfaceSpline::through(&face).sample(DVec2::ZERO).height_mm;
        let cutter = Cutter::ball(3.0).unwrap();
        let tips = tool_offset(&face.sheet(), cutter);
        let contour = face.contour();
        let mut worst = 0.0_f64;
        for k in 0..121 * 97 {
            let at = EXTENT.node(k % 121, k / 121, 121, 97);
            // The ball rolls over the ball of the face; up to a little beyond the outline.
            if contour.contains(at / 1.02) {
                let wanted = ((BALL_MM + 3.0).powi(2) - at.length_squared()).sqrt() - 3.0 - offset_mm;
                worst = worst.max((tips.as_slice()[k] - wanted).abs());
            }
        }
        at_worst(1.77e-7, worst, format_args!("{outline:?}, mm"));
    }
}

#[test]
fn rows_leave_scallops_and_no_more_up_to_the_outline() {
    for outline in OUTLINES {
        for direction in [Direction::X, Direction::at(30.0)] {
            let face = face(outline, (81, 65), dome);
            let pass = Pass { direction, ..Pass::finishing(Cutter::ball(3.0).unwrap(), 0.3) };
            let milled = Milled::of(&face, pass).unwrap();
            let (heights, contour) = (milled.surface.heights_mm(), face.contour());
            assert_eq!(milled.surface.outline(), outline);
            let (nx, ny) = (heights.nx(), heights.ny());
            let spline = SurfaceSpline::through(&face);
            let left = (0..nx * ny).filter(|k| contour.contains(EXTENT.node(k % nx, k / nx, nx, ny))).map(|k| {
                let at = EXTENT.node(k % nx, k / nx, nx, ny);
                let rim = contour.contains(1.02 * at);
                (heights.as_slice()[k] - spline.sample(at).height_mm, rim)
            });
            let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
            for (left, inner) in left {
                let k = usize::from(inner);
                (low[k], high[k]) = (low[k].min(left), high[k].max(left));
            }
            // On a bulge of radius R cusps are s^2 / 8 (1/r + 1/R) high; both are moved to the mean
            // 0. The way of a tip around an edge is known to 6e-5 of its radius.
            let cusp = 0.3 * 0.3 / 8.0 * (1.0 / 3.0 + 1.0 / BALL_MM);
            for k in 0..2 {
                let (least, most) = (low[k] - low[1], high[k] - low[1]);
                at_worst(1.07, most / cusp, format_args!("{outline:?}: {least} to {most} of {cusp}"));
                at_worst(1.23e-4, -least, format_args!("{outline:?}: {least} to {most} of {cusp}, mm"));
            }
        }
    }
}

#[test]
fn a_rim_of_any_kind_is_known_and_leaves_the_light_of_a_round_face_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let window = Window { size_mm: DVec2::new(40.0, 32.0), centre_mm: DVec2::ZERO, nx: 40, ny: 32 };
    let scene = Scene::new(1.5, 100.0, window);
    for outline in OUTLINES {
        let face = face(outline, (97, 81), |p| 0.3 * (0.21 * p.x).sin() * (0.17 * p.y + 0.4).cos());
        let seen = |block: &Block, scene: &Scene| beams(&Tracer::for_block(block, scene).unwrap(), 200, 160);
        let read = |shape: Shape, format: Format| {
            let solid = Solid::shaped(&face, Stock::of_thickness(12.0), shape).unwrap();
            let path = folder.path().join(format!("block.{format}"));
            let design = Design { name: "b".into(), exit_face: ExitFace::Refracts { ior: 1.5 }, distance_mm: 100.0 };
            export(&path, &solid, &design).unwrap();
            (Block::from_mesh(&load::read(&path).unwrap()).unwrap(), solid)
        };
        let (plain, _) = read(Shape::default(), Format::Stl);
        let bare = seen(&plain, &scene);
        for (rise_mm, mark_mm) in [(2.0, None), (-3.0, Some(4.0))] {
            let shape = Shape { rim: Some(Rim { width_mm: 5.0, rise_mm, mark_mm }), ..Shape::default() };
            for format in [Format::Stl, Format::Obj, Format::Glb, Format::ThreeMf, Format::Ply] {
                let (block, solid) = read(shape, format);
                assert_eq!(block.nodes(), (97, 81), "{format}");
                at_worst(7.4e-8, (block.rim_z_mm().unwrap() - solid.rim_z_mm().unwrap()).abs(), "the rim, mm");
                at_worst(1.52e-6, (block.size_mm() - DVec2::new(40.0, 32.0)).length(), "the size, mm");
                let framed = seen(&block, &scene);
                let apart = bare.image.values.iter().zip(&framed.image.values).map(|(a, b)| (a - b).abs() / 1280.0);
                // What f32 in metres moves; a wall above the face takes what leaves outwards close to
                // it.
                let (moved, lost) = if rise_mm < 0.0 { (5.8e-7, 0.0) } else { (7.8e-4, 3.66e-3) };
                at_worst(moved, apart.sum::<f64>(), format_args!("{outline:?} {format} {rise_mm}: moved"));
                at_worst(lost, framed.flux.side, format_args!("{outline:?} {format} {rise_mm}: {:?}", framed.flux));
            }
            // Light at 20 degrees: through the flange it comes to all of the face; a rim above the
            // face shades a part of it.
            let (block, _) = read(shape, Format::Stl);
            let oblique = Scene { light: Light::parallel(DVec3::new(0.3, 0.1, 0.9)), ..scene.clone() };
            let lost = |block: &Block| Tracer::for_block(block, &oblique).unwrap().vignetting();
            let alone = lost(&plain);
            let (bare_part, flange_part) = if outline == Outline::Circle { (0.0879, 0.0216) } else { (0.0819, 0.0215) };
            within_tenth_of(bare_part, alone, format_args!("{outline:?}, lost without a rim"));
            if rise_mm < 0.0 {
                within_tenth_of(flange_part, lost(&block), format_args!("{outline:?}, lost with a flange"));
            } else {
                assert_eq!(lost(&block), 0.0, "{outline:?}");
            }
        }
    }
}

#[test]
fn a_round_block_is_checked_and_milled() {
    let workshop = Workshop::new();
    let error = round(&workshop, "--height-map round.heights.exr");
    let judged = workshop.run("verify round.heights.exr --bench round.toml");
    prints_at_worst(0.0, (number(&judged.out, "relative RMS") - error).abs(), format_args!("{error}: {}", judged.out));
    assert!(workshop.path("round.heights.mask.png").exists());

    let check = |file: &str| {
        let found = workshop.run(&format!("check {file} --polish 0.1mm --max-blur 10mm"));
        assert_eq!(found.code, FINE, "{}{}", found.out, found.err);
        [number(&found.out, "ok    relief"), number(&found.out, "ok    hollows"), number(&found.out, "ok    slope")]
    };
    let (of_file, of_design) = (check("round.stl"), check("round.toml"));
    // Curvatures on the last nodes before the outline are those of a fit in the one, of the
    // solver's own continuation in the other.
    for k in [0, 2] {
        at_worst(0.0115, (of_file[k] / of_design[k] - 1.0).abs(), format_args!("{of_file:?} and {of_design:?}"));
    }
    within_tenth_of(32.85, of_file[1], "least concave radius of the file, mm");
    within_tenth_of(22.84, of_design[1], "least concave radius of the design, mm");
    let tolerances = workshop.run("check round.stl --polish 0.1mm --max-blur 10mm --tolerance");
    assert_eq!(tolerances.code, FINE, "{}", tolerances.err);
    prints_at_worst(
        0.0,
        (number(&tolerances.out, "as designed") - error).abs(),
        format_args!("{error}: {}", tolerances.out),
    );
    let milled = workshop.run("mill round.stl --step-over 0.4mm --polish 0.4mm -o milled.stl");
    assert_eq!(milled.code, FINE, "{}", milled.err);
    let [designed, alone, raw, both] = [
        "as designed",
        "polished alone, sigma 0.4 mm",
        "milled with ball, 6 mm diameter, rows 0.4 mm apart",
        "and polished, sigma 0.4 mm",
    ]
    .map(|step| number(&milled.out, step));
    for (measured, found, step) in
        [(error, designed, "designed"), (0.0049, alone, "polished"), (0.1371, raw, "milled"), (0.0051, both, "both")]
    {
        prints_within_tenth_of(measured, found, step);
    }
    let again = workshop.run("verify milled.stl");
    prints_at_worst(0.0, (number(&again.out, "relative RMS") - both).abs(), format_args!("{both}: {}", again.out));
    let refused = workshop.run("design picture.png -o f.stl --nodes 33 --outline circle --finish polish=0.4mm");
    assert!(refused.code == REFUSED && refused.err.contains("--outline rectangle"), "{}", refused.err);
}

#[test]
fn light_from_the_side_and_from_near_by_finds_all_of_a_round_face() {
    let workshop = Workshop::new();
    // A picture without detail: what is wrong is the border's.
    let straight = round(&workshop, "");
    prints_within_tenth_of(0.0035, straight, "straight light");
    for (bench, measured) in
        [("--tilt 30deg", 0.0040), ("--tilt 10deg,60deg", 0.0055), ("--source-distance 300mm", 0.0035)]
    {
        prints_within_tenth_of(measured, round(&workshop, bench), bench);
        let side = std::fs::read_to_string(workshop.path("round.toml")).unwrap();
        assert!(side.contains("outline = \"circle\""));
    }
    // A thicker stock takes a wider skirt, of which more light falls into the corners of the
    // window.
    let framed = round(&workshop, "--tilt 20deg --rim 8mm,-8mm --thickness 15mm");
    prints_within_tenth_of(0.0042, framed, "framed");
    let narrow = workshop.run(
        "design picture.png -o n.stl --nodes 65 --outline circle --tilt 40deg --skirt 1mm --no-verify --no-report",
    );
    assert!(narrow.err.contains("too narrow"), "{}", narrow.err);
}

#[test]
fn a_vignette_leaves_the_corners_of_a_round_blocks_picture_dark() {
    let workshop = Workshop::new();
    // White, but for a pixel that makes it a picture.
    let white = |x, y| image::Luma([if (x, y) == (32, 32) { 250 } else { 255 }]);
    image::GrayImage::from_fn(64, 64, white).save(workshop.path("picture.png")).unwrap();
    let light = |vignette: &str| {
        let error = round(&workshop, &format!("--offset 0.1 {vignette}"));
        let block = Block::from_mesh(&load::read(&workshop.path("round.stl")).unwrap()).unwrap();
        let window = Window { size_mm: DVec2::splat(100.0), centre_mm: DVec2::ZERO, nx: 64, ny: 64 };
        let image = beams(&Tracer::for_block(&block, &Scene::new(1.5, 250.0, window)).unwrap(), 512, 512).image;
        // Mean light in rings of the window, in parts of its half width.
        let ring = |from: f64, to: f64| {
            let radius = |k: usize| (DVec2::new((k % 64) as f64, (k / 64) as f64) * 2.0 / 63.0 - 1.0).length();
            let ring: Vec<f64> =
                (0..64 * 64).filter(|&k| (from..to).contains(&radius(k))).map(|k| image.values[k]).collect();
            ring.iter().sum::<f64>() / ring.len() as f64
        };
        (error, [ring(0.0, 0.5), ring(0.5, 0.75), ring(0.85, 0.95), ring(1.05, 1.4)])
    };
    let (_, even) = light("");
    even.iter().for_each(|part| at_worst(1.06e-3, (part - 1.0).abs(), format_args!("{even:?}")));
    let (error, [middle, outer, fading, corners]) = light("--vignette circle:0.2");
    prints_within_tenth_of(0.0163, error, "a round picture");
    at_worst(1.21e-4, (outer / middle - 1.0).abs(), format_args!("{outer} and {middle}"));
    within_tenth_of(0.617, fading / middle, "where it fades");
    // The constant alone: a tenth of the picture's mean, here the share of the window that the
    // vignette leaves.
    println!(
        "relative RMS {error}; light in the middle, further out, where it fades, beyond: {middle} {outer} {fading} {corners}"
    );
    within_tenth_of(0.0862, corners / middle, "beyond");
}
