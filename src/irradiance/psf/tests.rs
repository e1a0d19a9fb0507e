use super::*;
use crate::measured::{at_worst, within_tenth_of};

const WINDOW: Extent = Extent::new(100.0, 80.0);
const CELLS: (usize, usize) = (200, 160);

fn spot(shape: SpotShape, width_mm: f64) -> Spot {
    Spot::Shape(shape, DMat2::IDENTITY * width_mm)
}

fn sum(field: &Field<f64>) -> f64 {
    field.as_slice().iter().sum()
}

fn picture(nx: usize, ny: usize, pixel_mm: f64, light: impl Fn(DVec2) -> f64) -> Spot {
    let at =
        |i: usize, j: usize| pixel_mm * DVec2::new(i as f64 + 0.5 - 0.5 * nx as f64, j as f64 + 0.5 - 0.5 * ny as f64);
    Spot::Picture(PsfPicture::new(&Field::from_fn(nx, ny, |i, j| light(at(i, j))), pixel_mm).unwrap())
}

#[test]
fn widths_are_those_of_the_shapes_and_no_light_is_lost() {
    // Standard deviations: half the radius of a disc, a square's side over sqrt 12. Even light of a
    // pixel, averaged over pixels, adds a sixth of a squared pixel.
    let pixel = WINDOW.width_mm / CELLS.0 as f64;
    let turned = DMat2::from_angle(0.4) * DMat2::from_diagonal(DVec2::new(4.0, 2.0));
    for (spots, expected) in [
        (vec![spot(SpotShape::Disc, 3.0)], DVec2::splat(1.5)),
        (vec![spot(SpotShape::Square, 5.0)], DVec2::splat(5.0 / 12.0_f64.sqrt())),
        (vec![spot(SpotShape::Gaussian, 1.2)], DVec2::splat(1.2)),
        (vec![spot(SpotShape::Disc, 3.0), spot(SpotShape::Gaussian, 2.0)], DVec2::splat(2.5)),
        (vec![picture(60, 60, 0.1, |p| f64::from(p.length() < 2.0))], DVec2::splat(1.0)),
        (vec![Spot::Shape(SpotShape::Gaussian, turned)], DVec2::new(turned.row(0).length(), turned.row(1).length())),
    ] {
        let psf = Psf::of_spots(&spots, WINDOW, CELLS).unwrap();
        assert!((sum(psf.kernel()) - 1.0).abs() < 1e-12);
        assert!(psf.kernel().as_slice().iter().all(|v| *v >= 0.0));
        let variance = psf.deviation_mm().powf(2.0) - pixel * pixel / 6.0;
        let off = (variance / (expected * expected) - 1.0).abs().max_element();
        at_worst(0.0069, off, format_args!("{} instead of {expected}", psf.deviation_mm()));
    }
}

#[test]
fn a_disc_drawn_by_points_is_the_disc_of_a_fine_picture() {
    let disc = Psf::of_spots(&[spot(SpotShape::Disc, 2.0)], WINDOW, CELLS).unwrap();
    let drawn = Psf::of_spots(&[picture(1000, 1000, 0.004, |p| f64::from(p.length() < 2.0))], WINDOW, CELLS).unwrap();
    assert_eq!(disc.kernel().nx(), drawn.kernel().nx());
    let worst =
        disc.kernel().as_slice().iter().zip(drawn.kernel().as_slice()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    within_tenth_of(0.00137, worst / disc.kernel().min_max().1, "kernel");
}

#[test]
fn a_spot_far_below_a_pixel_changes_nothing_and_one_of_half_a_pixel_what_it_must() {
    for spots in [vec![], vec![spot(SpotShape::Disc, 1e-9)], vec![picture(4, 6, 1e-4, |_| 1.0)]] {
        let psf = Psf::of_spots(&spots, WINDOW, CELLS).unwrap();
        let kernel = psf.kernel();
        assert!(kernel[(kernel.nx() / 2, kernel.ny() / 2)] > 0.998);
    }
    // Light shifted by x of a pixel leaves |x| of it: over -w/2 .. w/2, w/4 in the mean, and so w/8
    // for either neighbour.
    let half = Psf::of_spots(&[spot(SpotShape::Square, 0.25)], WINDOW, CELLS).unwrap();
    let along_x = |k: usize| (0..half.kernel().ny()).map(|j| half.kernel()[(k, j)]).sum::<f64>();
    let middle = half.kernel().nx() / 2;
    for (k, expected) in [(middle - 1, 0.0625), (middle, 0.875), (middle + 1, 0.0625)] {
        assert!((along_x(k) - expected).abs() < 1e-12, "{k}: {}", along_x(k));
    }
}

#[test]
fn a_picture_is_put_by_its_weight_whatever_its_size_and_crop() {
    let speck = |centre: DVec2| move |p: DVec2| (-(p - centre).length_squared()).exp();
    let reference = Psf::of_spots(&[picture(81, 81, 0.1, speck(DVec2::ZERO))], WINDOW, CELLS).unwrap();
    for (nx, ny, shift) in [(80, 80, DVec2::ZERO), (80, 81, DVec2::ZERO), (100, 96, DVec2::new(0.4, -0.3))] {
        let other = Psf::of_spots(&[picture(nx, ny, 0.1, speck(shift))], WINDOW, CELLS).unwrap();
        let (a, b) = (reference.kernel(), other.kernel());
        let near = |k: i64, l: i64| {
            let of = |f: &Field<f64>| f[((f.nx() as i64 / 2 + k) as usize, (f.ny() as i64 / 2 + l) as usize)];
            (of(a) - of(b)).abs()
        };
        let worst = (-4..=4).flat_map(|k| (-4..=4).map(move |l| near(k, l))).fold(0.0, f64::max);
        at_worst(1.17e-5, worst / a.min_max().1.max(0.1), format_args!("{nx} x {ny}: {worst:e}"));
    }
}

#[test]
fn specks_that_are_no_light_are_refused_by_name() {
    let with = |value: f64| {
        let mut values = Field::filled(8, 8, 0.5);
        values[(3, 2)] = value;
        PsfPicture::new(&values, 0.1)
    };
    for bad in [-0.1, f64::INFINITY] {
        assert_eq!(with(bad), Err(PsfError::Value { column: 3, row: 2, value: bad }));
    }
    assert!(matches!(with(f64::NAN), Err(PsfError::Value { .. })));
    assert_eq!(PsfPicture::new(&Field::filled(5, 5, 0.0), 0.1), Err(PsfError::Black));
    for pixel in [0.0, -1.0, f64::NAN] {
        assert!(matches!(PsfPicture::new(&Field::filled(5, 5, 1.0), pixel), Err(PsfError::Range { .. })));
    }
    let wide = Psf::of_spots(&[spot(SpotShape::Disc, 45.0)], WINDOW, CELLS).unwrap_err();
    assert_eq!(wide, PsfError::WiderThanWindow { size_mm: DVec2::splat(90.0), window_mm: WINDOW.as_vec() });
}
