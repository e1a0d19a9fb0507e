//! The two estimators agree, know their errors, and can be cut into parts.

mod common;
#[path = "../../tests/common/measured.rs"]
mod measured;

use common::{block, relief, scene};
use glam::{DVec2, DVec3};
use glasswarp_verify::{
    Block, Image, Light, PhotonError, PhotonPlan, PhotonTally, Scene, Surface, Tracer, Traversal, beams, facet_beams,
    metrics, photons,
};
use measured::{at_worst, within_tenth_of};

const SIZE: DVec2 = DVec2::new(100.0, 80.0);

fn tracer(scene: &Scene) -> Tracer {
    let mesh = block(101, 81, SIZE, -15.0, relief);
    Tracer::for_block(&Block::from_mesh(&mesh).unwrap(), scene).unwrap()
}

#[test]
fn photons_and_beams_agree_within_the_stated_noise() {
    // Between facets the map tears: beams across an edge fill the gap, which converges with the
    // first power of their width only. Fewer photons see no more than that.
    for (surface, count) in [(Surface::Spline, 2_000_000), (Surface::Facets, 200_000)] {
        let tracer = tracer(&Scene { surface, ..scene(SIZE, 64, 250.0) });
        let sharp = beams(&tracer, 64 * 24, 51 * 24);
        let noisy = photons(&tracer, &PhotonPlan::new(count, 11)).unwrap();
        let (image, error) = (noisy.image(), noisy.standard_error());
        // In units of the standard error the differences have a mean square of 1. Student's t with
        // 31 degrees of freedom gives 31 / 29; over 3264 pixels that is known to a few percent.
        let squares: f64 = image
            .values
            .iter()
            .zip(&sharp.image.values)
            .zip(&error.values)
            .map(|((a, b), s)| if *s > 0.0 { ((a - b) / s).powi(2) } else { 0.0 })
            .sum();
        let mean_square = squares / image.values.len() as f64;
        at_worst(0.0535, (mean_square - 31.0 / 29.0).abs(), format_args!("{surface:?}: {mean_square}"));
        let (a, b) = (noisy.flux(), sharp.flux);
        at_worst(1.76e-4, (a.window - b.window).abs(), format_args!("window: {a:?} {b:?}"));
        at_worst(1.76e-4, (a.missed - b.missed).abs(), format_args!("missed: {a:?} {b:?}"));

        // The noise adds to the plain error, and is taken out of the honest one.
        let target = &Image::new(64, 51, (0..64 * 51).map(|k| 1.0 + 0.3 * (f64::from(k % 64) * 0.2).sin()).collect());
        let truth = metrics::compare(&sharp.image, target).unwrap().rel_rms;
        let honest = noisy.error_against(target).unwrap();
        assert!((honest.rel_rms() - truth).abs() < 4.0 * honest.rel_rms_error(), "{honest:?} for {truth}");
        assert!(metrics::compare(&image, target).unwrap().rel_rms > honest.rel_rms() + 0.5 * honest.rel_rms_error());
        let own = noisy.error_against(&sharp.image).unwrap();
        assert!(own.mean_square.abs() < 4.0 * own.mean_square_error, "nothing is left against itself: {own:?}");
    }
}

/// Probability that the magnitude of a standard normal variable stays below `x` (Abramowitz and
/// Stegun 7.1.26, to 1.5e-7).
fn half_normal(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.327_591_1 * x / 2f64.sqrt());
    let polynomial = [0.254_829_592, -0.284_496_736, 1.421_413_741, -1.453_152_027, 1.061_405_429];
    1.0 - polynomial.iter().rev().fold(0.0, |sum, c| (sum + c) * t) * (-0.5 * x * x).exp()
}

#[test]
fn photons_are_off_by_as_many_standard_errors_as_chance_has_it() {
    let tracer = tracer(&Scene { traversal: Traversal::Grid, ..scene(SIZE, 64, 250.0) });
    let sharp = beams(&tracer, 64 * 24, 51 * 24).image;
    // One photon for every pixel, as a design has them, and a few; independent samples from few to
    // many.
    for (count, replicates) in [(3000, 32), (3000, 4), (12_000, 128)] {
        let runs = 300;
        let mut off: Vec<f64> = (0..runs)
            .map(|seed| {
                let plan = PhotonPlan::new(count, 1000 + seed).with_replicates(replicates);
                let agreement = photons(&tracer, &plan).unwrap().agreement(&sharp).unwrap();
                agreement.difference / agreement.standard_error
            })
            .collect();
        let (n, which) = (runs as f64, format!("{count} photons, {replicates} replicates"));
        let mean = off.iter().sum::<f64>() / n;
        let square = off.iter().map(|z| z * z).sum::<f64>() / n;
        let beyond = [2.0, 3.0, 4.0].map(|limit| off.iter().filter(|z| z.abs() > limit).count());
        off.iter_mut().for_each(|z| *z = z.abs());
        off.sort_by(f64::total_cmp);
        // Kolmogorov's distance between the distribution found and that of chance.
        let off_by = |k: usize| {
            let expected = half_normal(off[k]);
            (expected - k as f64 / n).abs().max((expected - (k + 1) as f64 / n).abs())
        };
        let distance = (0..off.len()).map(off_by).fold(0.0, f64::max);
        println!(
            "{which}: mean {mean:.3}, mean square {square:.3}, beyond 2, 3, 4: {beyond:?} of {runs}, distance {distance:.4}"
        );
        // Chance goes beyond these once in a thousand times each.
        assert!(mean.abs() < 3.3 / n.sqrt(), "{which}: mean {mean}");
        assert!((square - 1.0).abs() < 3.3 * (2.0 / n).sqrt(), "{which}: mean square {square}");
        assert!(distance < 1.95 / n.sqrt(), "{which}: distance {distance}");
        assert_eq!(beyond[2], 0, "{which}");
    }
    // Photons far fewer than pixels, of which hardly two meet in one, contradict nothing.
    for seed in 0..40 {
        let tally = photons(&tracer, &PhotonPlan::new(200, seed)).unwrap();
        let off = tally.agreement(&sharp).unwrap().standard_errors();
        assert!(off < 4.0, "seed {seed}: {off} standard errors");
    }
    // And a thing that differs is told.
    let other = Image::new(64, 51, sharp.values.iter().enumerate().map(|(k, v)| v + 0.1 * (k % 2) as f64).collect());
    let tally = photons(&tracer, &PhotonPlan::new(1_000_000, 5)).unwrap();
    assert!(tally.agreement(&other).unwrap().standard_errors() > 10.0);
}

#[test]
fn beams_of_whole_facets_are_exact() {
    let block = Block::from_mesh(&block(101, 81, SIZE, -15.0, relief)).unwrap();
    let tracer = Tracer::for_block(&block, &Scene { surface: Surface::Facets, ..scene(SIZE, 64, 250.0) }).unwrap();
    let exact = facet_beams(&tracer, &block);
    assert!((exact.flux.total() - 1.0).abs() < 1e-12 && exact.beams == 16_000);
    let off = |image: &Image| metrics::compare(image, &exact.image).unwrap().rel_rms;
    // Beams across the edges come nearer with the first power of their width.
    let (wide, narrow) = (off(&beams(&tracer, 800, 640).image), off(&beams(&tracer, 3200, 2560).image));
    within_tenth_of(0.28, narrow / wide, format_args!("{wide} {narrow}"));
    let noisy = photons(&tracer, &PhotonPlan::new(4_000_000, 3)).unwrap();
    let between = noisy.error_against(&exact.image).unwrap();
    assert!(between.mean_square.abs() < 4.0 * between.mean_square_error, "{between:?}");
}

#[test]
fn beams_converge_with_the_square_of_their_width() {
    let tracer = tracer(&scene(SIZE, 64, 250.0));
    let at = |k: usize| beams(&tracer, 64 * k, 51 * k).image;
    let truth = at(32);
    let error = |k: usize| {
        let squares: f64 = at(k).values.iter().zip(&truth.values).map(|(a, b)| (a - b).powi(2)).sum();
        (squares / truth.values.len() as f64).sqrt()
    };
    let order = (error(2) / error(4)).log2();
    within_tenth_of(2.085, order, "order");
    within_tenth_of(6.9e-4, error(4), "four beams to a pixel");
}

#[test]
fn a_uniform_slab_gives_a_uniform_image() {
    let mesh = block(9, 7, SIZE, -10.0, |_, _| 0.0);
    let tracer = Tracer::for_block(&Block::from_mesh(&mesh).unwrap(), &scene(SIZE, 37, 250.0)).unwrap();
    // Beams that divide the pixels and beams that do not.
    for (nx, ny) in [(74, 60), (101, 97)] {
        let image = beams(&tracer, nx, ny).image;
        // Light is counted in parts of 2^-32.
        at_worst(2.92e-10, image.values.iter().map(|v| (v - 1.0).abs()).fold(0.0, f64::max), "a slab");
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let tracer = tracer(&Scene { light: Light::parallel(DVec3::new(0.05, -0.02, 1.0)), ..scene(SIZE, 64, 250.0) });
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| (beams(&tracer, 200, 160), photons(&tracer, &PhotonPlan::new(50_000, 5)).unwrap()))
    };
    let one = run(1);
    assert!(one == run(2) && one == run(5));
}

#[test]
fn shards_add_up_to_the_whole_run_exactly() {
    let tracer = tracer(&scene(SIZE, 64, 250.0));
    let plan = PhotonPlan::new(40_000, 99).with_replicates(10);
    let whole = photons(&tracer, &plan).unwrap();
    let shard = |shard| photons(&tracer, &plan.with_shard(shard, 3)).unwrap();
    let merged = shard(2).merge(&shard(0)).unwrap();
    assert!(!merged.is_complete());
    assert_eq!(merged.clone().merge(&shard(0)), Err(PhotonError::Twice(0)));
    let merged = merged.merge(&shard(1)).unwrap();
    assert!(merged.is_complete() && merged == whole);
    let other = photons(&tracer, &PhotonPlan::new(40_000, 98).with_replicates(10)).unwrap();
    assert_eq!(merged.merge(&other), Err(PhotonError::Different("the seed")));
    assert!(matches!(photons(&tracer, &plan.with_shard(3, 3)), Err(PhotonError::Plan { .. })));
}

#[test]
fn merged_files_are_those_of_one_run_byte_by_byte() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let tracer = tracer(&scene(SIZE, 64, 250.0));
    let plan = PhotonPlan::new(40_000, u64::MAX).with_replicates(10);
    let whole = photons(&tracer, &plan).unwrap();
    whole.write(&path("whole.exr"), "a bench").unwrap();
    assert_eq!(PhotonTally::read(&path("whole.exr")).unwrap(), (whole, "a bench".to_owned()));
    let mut merged: Option<PhotonTally> = None;
    for shard in [2, 0, 1] {
        let part = photons(&tracer, &plan.with_shard(shard, 3)).unwrap();
        part.write(&path("part.exr"), "a bench").unwrap();
        let (part, _) = PhotonTally::read(&path("part.exr")).unwrap();
        merged = Some(merged.map_or(part.clone(), |sum| sum.merge(&part).unwrap()));
    }
    merged.unwrap().write(&path("merged.exr"), "a bench").unwrap();
    let bytes = |name| std::fs::read(path(name)).unwrap();
    assert!(bytes("merged.exr") == bytes("whole.exr"));
}

#[test]
fn damaged_tallies_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tally.exr");
    let tracer = tracer(&scene(SIZE, 24, 250.0));
    photons(&tracer, &PhotonPlan::new(4_000, 1).with_replicates(4)).unwrap().write(&path, "b").unwrap();
    let good = std::fs::read(&path).unwrap();
    let refused = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        PhotonTally::read(&path).unwrap_err().to_string()
    };
    let swap = |from: &str, to: &str| {
        assert_eq!(from.len(), to.len(), "the length of an attribute is recorded");
        let at = good.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
        let mut bytes = good.clone();
        bytes[at..at + from.len()].copy_from_slice(to.as_bytes());
        bytes
    };
    for (bytes, word) in [
        (swap("done = 0 1 2 3", "done = 0 1 3 2"), "replicates"),
        (swap("done = 0 1 2 3", "done = 0 1 2 9"), "replicates"),
        (swap("done = 0 1 2 3", "done = 0 1   3"), "account"),
        (swap("done = 0 1 2 3", "done = 0 1 2 x"), "'x'"),
        (swap("seed = 1", "sled = 1"), "'seed'"),
        (swap("version 2", "version 9"), "version 2"),
        (good[..good.len() / 2].to_vec(), "no photon tally"),
        (b"not a picture".to_vec(), "no photon tally"),
    ] {
        let error = refused(&bytes);
        assert!(error.contains(word), "'{word}' is not in: {error}");
    }
    glasswarp_verify::image_file::write_exr(&path, &Image::new(8, 8, vec![1.0; 64])).unwrap();
    assert!(PhotonTally::read(&path).unwrap_err().to_string().contains("comment"));
}

#[test]
fn the_grid_and_the_hierarchy_find_the_same_crossings() {
    for surface in [Surface::Spline, Surface::Facets] {
        let straight = scene(SIZE, 64, 250.0);
        let looked_up = tracer(&Scene { surface, traversal: Traversal::Grid, ..straight.clone() });
        let searched = tracer(&Scene { surface, traversal: Traversal::Bvh, ..straight });
        for k in 0..20_000 {
            let u = DVec2::new(f64::from(k) * 0.618_034 % 1.0 - 0.5, f64::from(k) * 0.754_878 % 1.0 - 0.5);
            let (a, b) = (looked_up.path(u * SIZE), searched.path(u * SIZE));
            let (glasswarp_verify::End::Receiver(a), glasswarp_verify::End::Receiver(b)) = (a.end, b.end) else {
                panic!("{a:?} {b:?}")
            };
            assert!(a == b, "{surface:?}: {a} {b}");
        }
    }
}
