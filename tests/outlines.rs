//! Blocks that are not rectangular, from the command line and from files.

mod common;

use common::{
    measured::at_worst,
    workshop::{FINE, REFUSED, Workshop},
};
use glam::DVec2;
use glasswarp::{
    bench::ExitFace,
    export::{Design, Format, export},
    grid::{Extent, Field, Outline},
    solid::{Solid, Stock},
    surface::{HeightField, SurfaceSpline},
};
use glasswarp_verify::{Block, Scene, Tracer, Window, beams, load};

fn face(outline: Outline, (nx, ny): (usize, usize)) -> HeightField {
    let extent = Extent::new(50.0, 40.0);
    let h = |p: DVec2| 0.3 * (0.21 * p.x).sin() * (0.17 * p.y + 0.4).cos() - 0.003 * p.length_squared();
    HeightField::outlined(extent, outline, Field::from_fn(nx, ny, |i, j| h(extent.node(i, j, nx, ny))))
}

/// Whether the curve passes within 0.01 mm.
fn near_the_curve(contains: &dyn Fn(DVec2) -> bool, at: DVec2) -> bool {
    let here = contains(at);
    (0..8).any(|k| contains(at + 0.01 * DVec2::from_angle(f64::from(k) * std::f64::consts::FRAC_PI_4)) != here)
}

#[test]
fn the_verifier_knows_such_a_block_in_every_mesh_format_and_its_face_up_to_the_outline() {
    let folder = tempfile::tempdir().unwrap();
    for outline in [Outline::Circle, Outline::Rounded { radius_mm: 8.0 }] {
        let face = face(outline, (101, 81));
        let (spline, contour) = (SurfaceSpline::through(&face), face.contour());
        let solid = Solid::new(&face, Stock::default()).unwrap();
        for format in [Format::Stl, Format::Obj, Format::Glb, Format::ThreeMf, Format::Ply] {
            let path = folder.path().join(format!("block.{format}"));
            let design =
                Design { name: "block".into(), exit_face: ExitFace::Refracts { ior: 1.5 }, distance_mm: 120.0 };
            export(&path, &solid, &design).unwrap();
            let block = Block::from_mesh(&load::read(&path).unwrap()).unwrap();
            assert!(!block.is_rectangular());
            assert_eq!(block.nodes(), (101, 81), "{format}");
            at_worst(1.55e-6, (block.size_mm() - DVec2::new(50.0, 40.0)).length(), format_args!("{format}, mm"));
            // Nodes next to the outline are not in the file, and missing in the mean.
            at_worst(9.85e-4, block.mean_exit_z_mm().abs(), format_args!("{outline:?} {format}, mm"));
            // Straight rays: where the verifier lands them, by its own spline, and where ours goes.
            let window = Window { size_mm: DVec2::new(50.0, 40.0), centre_mm: DVec2::ZERO, nx: 50, ny: 40 };
            let tracer = Tracer::for_block(&block, &Scene::new(1.5, 120.0, window)).unwrap();
            let mut worst = 0.0_f64;
            for k in 0..2000 {
                let at = DVec2::new(f64::from(k) / 1999.0 - 0.5, f64::from(k * 37 % 2000) / 1999.0 - 0.5)
                    * DVec2::new(50.0, 40.0);
                if near_the_curve(&|p| contour.contains(p), at) {
                    // Between the curve and the chords of the file.
                    continue;
                }
                assert_eq!(block.covers(at), contour.contains(at), "{at}");
                if !contour.contains(at) {
                    continue;
                }
                let sample = spline.sample(at);
                let normal = (-sample.slope).extend(1.0).normalize();
                let cosine = normal.z;
                let refracted =
                    1.5 * glam::DVec3::Z + ((1.0 - 2.25 * (1.0 - cosine * cosine)).sqrt() - 1.5 * cosine) * normal;
                let landing = at + refracted.truncate() * ((120.0 - sample.height_mm) / refracted.z);
                let glasswarp_verify::End::Receiver(got) = tracer.path(at).end else { panic!("no landing at {at}") };
                worst = worst.max((got - landing).length());
            }
            // The slope that files of f32 and the last cell leave open, over 120 mm.
            at_worst(2.47e-3, worst, format_args!("{outline:?} {format}, mm"));
            let seen = beams(&tracer, 300, 240);
            assert!(seen.flux.beside == 0.0 && seen.flux.lost == 0.0, "{:?}", seen.flux);
        }
    }
}

#[test]
fn beams_at_the_outline_carry_the_light_of_their_part_within() {
    let extent = Extent::new(50.0, 40.0);
    let flat = HeightField::outlined(extent, Outline::Circle, Field::filled(101, 81, 0.0));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flat.stl");
    let design = Design { name: "flat".into(), exit_face: ExitFace::Refracts { ior: 1.5 }, distance_mm: 120.0 };
    export(&path, &Solid::new(&flat, Stock::default()).unwrap(), &design).unwrap();
    let block = Block::from_mesh(&load::read(&path).unwrap()).unwrap();
    let (nx, ny) = (50, 40);
    let window = Window { size_mm: DVec2::new(50.0, 40.0), centre_mm: DVec2::ZERO, nx, ny };
    let tracer = Tracer::for_block(&block, &Scene::new(1.5, 120.0, window)).unwrap();
    // Beams that do not fall in line with the pixels.
    let seen = beams(&tracer, 173, 139).image;
    let contour = flat.contour();
    let mean = contour.share_of_extent();
    for j in 0..ny {
        for i in 0..nx {
            // The share of the pixel within the ellipse, by its rows; rows of pixels begin at the
            // top, seen from behind the light.
            let (left, top) = (25.0 - i as f64, 20.0 - j as f64);
            let covered: f64 = (0..1000)
                .map(|k| {
                    let half = contour.half_width_mm(top - (f64::from(k) + 0.5) / 1000.0);
                    (left.min(half) - (left - 1.0).max(-half)).max(0.0)
                })
                .sum::<f64>()
                / 1000.0;
            let got = seen.values[j * nx + i] * mean;
            at_worst(3.87e-3, (got - covered).abs(), format_args!("{i}, {j}: {got} of {covered}"));
        }
    }
}

#[test]
fn a_round_block_is_made_written_read_and_made_again() {
    let workshop = Workshop::new();
    let made = workshop.run(
        "design picture.png -o round.stl -o round.glb --nodes 97 --transfer linear --outline circle --margin 0.1 --vignette circle:0.2",
    );
    assert_eq!(made.code, FINE, "{}", made.err);
    let side = std::fs::read_to_string(workshop.path("round.toml")).unwrap();
    for line in ["outline = \"circle\"", "vignette = \"circle:0.2\"", "margin = 0.1"] {
        assert!(side.contains(line), "{line} is not in\n{side}");
    }
    let judged = workshop.run("verify round.stl --max-error 0.2");
    assert_eq!(judged.code, FINE, "{}\n{}", judged.out, judged.err);
    let again = workshop.run("design round.toml -o again.stl --no-verify");
    assert_eq!(again.code, FINE, "{}", again.err);
    let bytes = |name: &str| std::fs::read(workshop.path(name)).unwrap();
    assert!(bytes("round.stl")[84..] == bytes("again.stl")[84..]);
    for refused in [
        "design picture.png -o x.stl --nodes 33 --outline circle --rim 5mm,-0.5mm",
        "design picture.png -o x.stl --nodes 33 --outline rounded:90mm",
        "design picture.png -o x.stl --nodes 33 --outline circle --solver warping",
        "design picture.png -o x.stl --nodes 33 --margin 0.6",
    ] {
        let outcome = workshop.run(refused);
        assert_eq!(outcome.code, REFUSED, "{refused}: {} {}", outcome.out, outcome.err);
        assert!(outcome.err.contains("--"), "no remedy in {}", outcome.err);
    }
    assert!(!workshop.run("design picture.png --outline star").err.is_empty());
}
