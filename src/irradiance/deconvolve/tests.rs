use super::*;
use crate::measured::within_tenth_of;
use crate::{
    bench::{Bench, ExitFace},
    grid::Extent,
    irradiance::{ImperfectLight, PsfPicture, SourceSize},
};
use glam::DVec2;

const PIXELS: (usize, usize) = (96, 80);

/// Without symmetry, with edges and fine detail.
fn picture() -> TargetIrradiance {
    TargetIrradiance::new(Field::from_fn(PIXELS.0, PIXELS.1, |i, j| {
        let p = DVec2::new(i as f64, j as f64);
        let disc = f64::from((p - DVec2::new(30.0, 50.0)).length() < 18.0);
        let bars = f64::from(i > 60 && (i / 4 + j / 9).is_multiple_of(2));
        0.3 + disc + 0.8 * bars + 0.3 * (0.11 * p.x + 0.07 * p.y).sin().powi(2)
    }))
    .unwrap()
}

fn spread(sun_degrees: f64, roughness: f64) -> Psf {
    let bench = Bench::new(Extent::new(48.0, 40.0), 150.0, ExitFace::Refracts { ior: 1.5 }).unwrap();
    let source = SourceSize::Angle { diameter: sun_degrees.to_radians() };
    ImperfectLight { source: Some(source), roughness: Some(roughness), psf: None }.psf(&bench, PIXELS).unwrap()
}

#[test]
fn without_spread_nothing_changes() {
    let wanted = picture();
    for border in [Border::Dark, Border::Continued] {
        let options = Deconvolution { border, ..Deconvolution::default() };
        let done = options.of(&wanted, &Psf::identity(DVec2::ONE)).unwrap();
        assert_eq!(done.ending, Ending::Agreed);
        let worst = difference(done.target.cells(), wanted.cells());
        assert!(worst < 1e-12, "{border:?}: {worst:e}");
    }
}

#[test]
fn what_was_blurred_is_found_again() {
    // A wanted picture that is itself a blurred one can be drawn: the light is found, up to what is
    // lost in the range.
    let psf = spread(0.6, 0.002);
    let sharp = picture();
    let wanted = TargetIrradiance::new(psf.blurred(sharp.cells())).unwrap();
    let done = Deconvolution { rounds: 300, ..Deconvolution::default() }.of(&wanted, &psf).unwrap();
    assert!(done.error_before > 0.05, "{} to {}", done.error_before, done.error_after);
    within_tenth_of(9.7e-4, done.error_after, "what is left");
    let (from, to) = (difference(wanted.cells(), sharp.cells()), difference(done.target.cells(), sharp.cells()));
    within_tenth_of(0.32, to / from, format_args!("the light itself: {from} to {to}"));
}

#[test]
fn the_picture_gains_and_more_with_a_dark_border_than_with_a_continued_one() {
    let (wanted, psf) = (picture(), spread(0.6, 0.0));
    let with = |border| Deconvolution { border, ..Deconvolution::default() }.of(&wanted, &psf).unwrap();
    let (dark, continued) = (with(Border::Dark), with(Border::Continued));
    within_tenth_of(0.302, 1.0 - dark.error_after / dark.error_before, "gain with a dark border");
    within_tenth_of(0.219, 1.0 - continued.error_after / continued.error_before, "gain with a continued one");
    assert!(dark.error_after < continued.error_after);
    assert!(dark.lost > 0.0, "{}", dark.lost);
    within_tenth_of(0.022, dark.lost, "lost");
    // A margin of the spread's size: as bright as it shall be, or faded.
    let brim = |done: &Deconvolved| {
        let seen = psf.blurred(done.target.cells());
        let scale = wanted.cells().mean() / seen.mean();
        let edge: Vec<(usize, usize)> = (0..PIXELS.0).flat_map(|i| [(i, 0), (i, PIXELS.1 - 1)]).collect();
        edge.iter().map(|&k| seen[k] * scale).sum::<f64>() / edge.iter().map(|&k| wanted.cells()[k]).sum::<f64>()
    };
    within_tenth_of(0.027, (brim(&dark) - 1.0).abs(), "dark brim");
    within_tenth_of(0.72, brim(&continued), "continued brim");
}

#[test]
fn light_stays_within_its_range_and_keeps_its_flux() {
    let (wanted, psf) = (picture(), spread(1.0, 0.004));
    for (least, greatest) in [(0.0, 1000.0), (0.05, 8.0), (0.1, 4.0)] {
        let done = Deconvolution { least, greatest, ..Deconvolution::default() }.of(&wanted, &psf).unwrap();
        let (low, high) = done.target.cells().min_max();
        assert!((done.target.cells().mean() - 1.0).abs() < 1e-12);
        // Before its mean was made 1 it was at least that of the picture: some light falls beside
        // the window.
        assert!(low >= 0.0 && high <= 1.01 * greatest, "{low} to {high}");
        assert!(done.contrast_after <= 1.001 * greatest / least, "{}", done.contrast_after);
        assert!((done.contrast_after - high / low).abs() < 1e-9 * done.contrast_after || low == 0.0);
    }
}

#[test]
fn a_lopsided_speck_is_undone_too() {
    let speck = Field::from_fn(9, 5, |i, j| (i * i + j) as f64);
    let bench = Bench::new(Extent::new(48.0, 40.0), 150.0, ExitFace::Reflects).unwrap();
    let light = ImperfectLight { psf: Some(PsfPicture::new(&speck, 0.4).unwrap()), ..ImperfectLight::default() };
    let psf = light.psf(&bench, PIXELS).unwrap();
    let done = Deconvolution::default().of(&picture(), &psf).unwrap();
    within_tenth_of(0.57, done.error_after / done.error_before, "lopsided");
}

#[test]
fn neither_the_number_of_threads_nor_the_run_changes_a_bit() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Deconvolution::default().of(&picture(), &spread(0.6, 0.002)).unwrap())
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn options_out_of_range_are_refused() {
    let psf = spread(0.6, 0.0);
    let usual = Deconvolution::default();
    for (bad, name) in [
        (Deconvolution { rounds: 0, ..usual }, "the number of rounds"),
        (Deconvolution { least: f64::NAN, ..usual }, "the least light"),
        (Deconvolution { greatest: 0.5, ..usual }, "the greatest light"),
    ] {
        let error = bad.of(&picture(), &psf).unwrap_err();
        assert!(matches!(error, DeconvolutionError::Option { what, .. } if what == name), "{error}");
    }
}
