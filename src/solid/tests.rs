use super::face::Diagonal;
use super::*;
use crate::{
    grid::{Extent, Field, Outline},
    surface::HeightField,
};
use glam::{DVec2, DVec3};
use proptest::prelude::*;

fn surface(extent: Extent, nx: usize, ny: usize, h: impl Fn(f64, f64) -> f64) -> HeightField {
    HeightField::new(
        extent,
        Field::from_fn(nx, ny, |i, j| {
            let at = extent.node(i, j, nx, ny);
            h(at.x, at.y)
        }),
    )
}

fn wavy(x: f64, y: f64) -> f64 {
    0.8 * (0.11 * x + 0.3).sin() * (0.07 * y - 0.2).cos() + 0.002 * x * y
}

#[test]
fn blocks_of_any_aspect_and_size_are_sound() {
    for (width, height, nx, ny) in [
        (100.0, 100.0, 65, 65),
        (100.0, 75.0, 4, 4),
        (100.0, 60.0, 201, 121),
        (1.0, 1.0, 30, 31),
        (10_000.0, 10.0, 1001, 5),
        (10.0, 3000.0, 4, 1200),
        (33.3, 77.7, 50, 9),
    ] {
        let extent = Extent::new(width, height);
        let solid = Solid::new(&surface(extent, nx, ny, |x, y| wavy(x % 50.0, y % 50.0)), Stock::default()).unwrap();
        let proved = solid.check().unwrap_or_else(|fault| panic!("{width} x {height}, {nx} x {ny}: {fault}"));
        assert_eq!(solid.exit_nodes(), (nx, ny));
        assert!(proved.volume_mm3 > extent.area_mm2() * solid.thinnest_mm());
        assert!(proved.volume_mm3 < extent.area_mm2() * solid.thickness_mm());
        let corner = solid.vertex(nx * ny - 1);
        assert_eq!([corner[0], corner[1]], [(width / 2.0) as f32, (height / 2.0) as f32]);
    }
}

#[test]
fn a_skirt_widens_the_block_and_leaves_the_face_where_it_is() {
    let surface = surface(Extent::new(100.0, 60.0), 41, 29, |x, y| 0.2 * wavy(x, y));
    let shape = Shape { skirt_mm: 3.0, ..Shape::default() };
    let solid = Solid::shaped(&surface, Stock::of_thickness(16.0), shape).unwrap();
    let proved = solid.check().unwrap();
    let wide = surface.with_skirt(3.0);
    assert_eq!(solid.stock_extent(), Extent::new(110.0, wide.extent().height_mm));
    assert_eq!(solid.surface(), &wide);
    let plain = Solid::new(&wide, Stock::of_thickness(16.0)).unwrap();
    assert!((proved.volume_mm3 - plain.volume_mm3()).abs() < 1e-12 * proved.volume_mm3);
    for bad in [-1.0, f64::NAN, 61.0] {
        let shape = Shape { skirt_mm: bad, ..Shape::default() };
        let refused = Solid::shaped(&surface, Stock::of_thickness(16.0), shape);
        assert!(matches!(refused, Err(SolidError::Skirt { .. })), "{bad}");
    }
}

#[test]
fn rims_marks_and_origins_of_all_kinds_are_sound() {
    for (width, height, nx, ny) in [(100.0, 60.0, 41, 29), (12.0, 90.0, 4, 61), (50.0, 50.0, 97, 97)] {
        let surface = surface(Extent::new(width, height), nx, ny, |x, y| 0.2 * wavy(x, y));
        let (low, high) = surface.heights_mm().min_max();
        for (rim_width, rise_mm, mark_mm) in
            [(5.0, 0.06, None), (5.0, 4.0, Some(5.0)), (0.5, low - high - 0.06, Some(0.5)), (12.0, -9.0, Some(7.0))]
        {
            for origin in Origin::ALL {
                let rim = Some(Rim { width_mm: rim_width, rise_mm, mark_mm });
                let shape = Shape { rim, origin, ..Shape::default() };
                let solid = Solid::shaped(&surface, Stock::of_thickness(16.0), shape).unwrap();
                let proved = solid.check().unwrap_or_else(|fault| panic!("{width} x {height}, {shape:?}: {fault}"));
                let plain = Solid::new(&surface, Stock::of_thickness(16.0 - rise_mm.max(0.0))).unwrap().volume_mm3();
                let ring = solid.stock_extent().area_mm2() - surface.extent().area_mm2();
                let cut = 0.5 * mark_mm.unwrap_or(0.0).powi(2);
                let rim = (ring - cut) * (solid.rim_z_mm().unwrap() - solid.entry_z_mm());
                // f32 coordinates of a centimetre.
                assert!((proved.volume_mm3 - plain - rim).abs() < 1e-7 * proved.volume_mm3, "{shape:?}");
                let (least, greatest) = solid.bounds();
                match origin {
                    Origin::Corner => assert_eq!(least, [0.0; 3]),
                    Origin::Entry => assert_eq!(least[2], 0.0),
                    Origin::StockTop => assert_eq!(greatest[2], 0.0),
                    Origin::Exit => assert!(least[2] < 0.0 && greatest[2] > 0.0),
                }
            }
        }
    }
}

#[test]
fn rims_that_do_not_fit_are_refused_with_their_limits() {
    let surface = surface(Extent::new(60.0, 40.0), 31, 21, wavy);
    let made = |width_mm, rise_mm, mark_mm| {
        let shape = Shape { rim: Some(Rim { width_mm, rise_mm, mark_mm }), origin: Origin::Exit, ..Shape::default() };
        Solid::shaped(&surface, Stock::of_thickness(16.0), shape).map(drop)
    };
    for width in [0.0, -4.0, 41.0, f64::NAN] {
        assert!(matches!(made(width, 2.0, None), Err(SolidError::RimWidth { .. })), "{width}");
    }
    for rise in [-0.1, -1.0, -16.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(made(8.0, rise, None), Err(SolidError::RimHeight { .. })), "{rise}");
    }
    for mark in [0.0, 9.0, -1.0, f64::NAN] {
        assert!(matches!(made(8.0, 2.0, Some(mark)), Err(SolidError::Mark { .. })), "{mark}");
    }
}

#[test]
fn a_border_steeper_than_the_wall_is_high_keeps_its_walls_upright() {
    let saw =
        surface(
            Extent::new(10.0, 10.0),
            101,
            101,
            |x, y| if ((10.0 * (x + y)).round() as i64) % 2 == 0 { 2.0 } else { 0.0 },
        );
    let solid = Solid::new(&saw, Stock::default()).unwrap();
    assert_eq!(solid.entry_nodes(), (101, 101));
    solid.check().unwrap();
}

#[test]
fn exit_vertices_are_the_height_nodes_and_the_entry_face_is_a_plane_below() {
    let surface = surface(Extent::new(100.0, 80.0), 41, 33, wavy);
    let solid = Solid::new(&surface, Stock::of_thickness(12.0)).unwrap();
    for j in 0..33 {
        for i in 0..41 {
            let at = surface.extent().node(i, j, 41, 33);
            let z = surface.heights_mm()[(i, j)];
            assert_eq!(solid.vertex(j * 41 + i), [at.x as f32, at.y as f32, z as f32]);
        }
    }
    let highest = surface.heights_mm().min_max().1;
    for v in 41 * 33..solid.vertex_count() {
        assert_eq!(solid.vertex(v)[2], (highest - 12.0) as f32);
    }
    assert_eq!(solid.thickness_mm(), 12.0);
    assert!((solid.thinnest_mm() - (12.0 - surface.relief_mm())).abs() < 1e-12);
}

#[test]
fn the_volume_converges_to_the_integral_of_the_surface() {
    // The mean of the nodes is shifted to 0, so that the exit face encloses (nearly) the volume of
    // a flat block.
    let extent = Extent::new(60.0, 60.0);
    let error = |n: usize| {
        let h = |x: f64, y: f64| (x * std::f64::consts::PI / 30.0).cos() * (0.05 * y).exp();
        let field = surface(extent, n, n, h);
        let shift = h(-30.0, -30.0) - field.heights_mm()[(0, 0)];
        let solid = Solid::new(&field, Stock::of_thickness(20.0)).unwrap();
        // The integral of h over the block is 0: whole periods of the cosine.
        (solid.volume_mm3() - extent.area_mm2() * (-shift - solid.entry_z_mm())).abs()
    };
    let (coarse, fine) = (error(33), error(65));
    // Whole periods again: what single precision leaves of 72 000 mm³.
    assert!(coarse < 1e-5 && fine < 0.3 * coarse, "{coarse} mm³ then {fine} mm³: not of second order");
}

#[test]
fn cells_are_split_where_the_surface_bends_less() {
    // Height error of the facets in the middle of each cell, against the surface itself.
    let h = |x: f64, y: f64| (0.2 * x + 0.15 * y).sin() + 0.4 * (0.13 * x - 0.3 * y).cos();
    let surface = surface(Extent::new(50.0, 50.0), 101, 101, h);
    let solid = Solid::new(&surface, Stock::default()).unwrap();
    let shift = h(-25.0, -25.0) - surface.heights_mm()[(0, 0)];
    let (mut chosen, mut fixed) = (0.0, 0.0);
    for j in 0..100 {
        for i in 0..100 {
            let z = |i, j| surface.heights_mm()[(i, j)];
            let middle = 0.5 * (surface.extent().node(i, j, 101, 101) + surface.extent().node(i + 1, j + 1, 101, 101));
            let truth = h(middle.x, middle.y) - shift;
            let rising = (0.5 * (z(i, j) + z(i + 1, j + 1)) - truth).powi(2);
            let falling = (0.5 * (z(i + 1, j) + z(i, j + 1)) - truth).powi(2);
            fixed += rising;
            chosen += if solid.diagonal(i, j) == Diagonal::Rising { rising } else { falling };
        }
    }
    let gain = f64::sqrt(fixed / chosen);
    assert!(gain > 1.5, "facets are only {gain} times nearer than with a fixed diagonal");
}

#[test]
fn the_mirror_image_of_a_surface_gives_the_mirror_image_of_the_mesh() {
    let n = 41;
    let surface = surface(Extent::new(50.0, 50.0), n, n, wavy);
    let mirrored = Field::from_fn(n, n, |i, j| surface.heights_mm()[(n - 1 - i, j)]);
    let mirrored = HeightField::new(surface.extent(), mirrored);
    let [one, other] = [&surface, &mirrored].map(|s| Solid::new(s, Stock::default()).unwrap());
    for j in 0..n - 1 {
        for i in 0..n - 1 {
            assert_ne!(one.diagonal(i, j), other.diagonal(n - 2 - i, j), "cell ({i}, {j})");
        }
    }
}

#[test]
fn normals_are_those_of_the_smooth_surface() {
    let (p, q) = (0.3, -0.2);
    let plane = surface(Extent::new(20.0, 30.0), 9, 12, |x, y| p * x + q * y);
    let solid = Solid::new(&plane, Stock::default()).unwrap();
    let length = (1.0_f64 + p * p + q * q).sqrt();
    for normal in solid.exit_normals() {
        for (have, want) in normal.iter().zip([-p / length, -q / length, 1.0 / length]) {
            assert!((f64::from(*have) - want).abs() < 1e-7);
        }
    }
}

#[test]
fn heights_and_grids_that_make_no_block_are_refused() {
    let extent = Extent::new(100.0, 100.0);
    let mut field = Field::filled(5, 5, 0.0);
    field[(3, 2)] = f64::INFINITY;
    // The shift to mean 0 spreads the fault over all nodes.
    assert!(matches!(
        Solid::new(&HeightField::new(extent, field), Stock::default()),
        Err(SolidError::NotFinite { .. })
    ));
    let thin = surface(Extent::new(100.0, 1e-40), 5, 5, |_, _| 0.0);
    assert!(matches!(Solid::new(&thin, Stock::default()), Err(SolidError::TooFine { .. })));
    let empty = surface(Extent::new(f64::NAN, 0.0), 5, 5, |_, _| 0.0);
    assert!(matches!(Solid::new(&empty, Stock::default()), Err(SolidError::TooFine { .. })));
    let dense = surface(Extent::new(100.0, 100.0), 1_200_000, 4, |_, _| 0.0);
    assert!(matches!(Solid::new(&dense, Stock::default()), Err(SolidError::TooFine { .. })));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn rough_surfaces_make_sound_blocks_too(
        nx in 4_usize..40,
        ny in 4_usize..40,
        width in 1.0_f64..500.0,
        aspect in 0.05_f64..20.0,
        heights in prop::collection::vec(-5.0_f64..5.0, 40 * 40),
        least in 0.1_f64..5.0,
    ) {
        let extent = Extent::new(width, width * aspect);
        let rough = HeightField::new(extent, Field::from_fn(nx, ny, |i, j| heights[j * 40 + i]));
        let solid = Solid::new(&rough, Stock::thinnest_sheet().leaving_at_least(least)).unwrap();
        prop_assert!(solid.check().is_ok(), "{:?}", solid.check());
    }
}

/// A dome, mm: no mirroring leaves it as it is.
fn dome(x: f64, y: f64) -> f64 {
    0.0015 * ((x - 3.0).powi(2) + 0.8 * (y + 2.0).powi(2)) + 0.001 * x * y
}

#[test]
fn blocks_between_two_reliefs_are_sound_and_as_thick_as_their_stock() {
    for (width, height, nx, ny) in [(100.0, 100.0, 65, 65), (100.0, 60.0, 4, 4), (60.0, 100.0, 31, 52)] {
        for (origin, skirt_mm, sign) in Origin::ALL
            .into_iter()
            .zip([0.0, 4.0, 0.0, 7.0])
            .flat_map(|(origin, skirt)| [(origin, skirt, 1.0), (origin, skirt, -1.0)])
        {
            let exit = surface(Extent::new(width, height), nx, ny, wavy);
            let wide = exit.with_skirt(skirt_mm);
            let (wide_nx, wide_ny) = (wide.heights_mm().nx(), wide.heights_mm().ny());
            let entry = surface(wide.extent(), wide_nx, wide_ny, |x, y| sign * dome(x, y));
            let shape = Shape { origin, skirt_mm, ..Shape::default() };
            let solid = Solid::between(&exit, &entry, Stock::of_thickness(40.0), shape).unwrap();
            let proved = solid.check().unwrap_or_else(|fault| panic!("{width} x {height}, {nx} x {ny}: {fault}"));
            let (low, high) = solid.bounds();
            assert!((f64::from(high[2] - low[2]) - 40.0).abs() < 1e-5, "{low:?} {high:?}");
            let below = solid.entry_surface().unwrap();
            assert!((below.range_mm().0 - solid.base_z_mm()).abs() < 1e-12);
            assert!((below.heights_mm().mean() - solid.entry_z_mm()).abs() < 1e-12);
            let glass = |k: usize| wide.heights_mm().as_slice()[k] - below.heights_mm().as_slice()[k];
            let least = (0..wide_nx * wide_ny).map(glass).fold(f64::INFINITY, f64::min);
            assert!((solid.thinnest_mm() - least).abs() < 1e-5, "{} {least}", solid.thinnest_mm());
            assert!(proved.volume_mm3 > least * wide.extent().area_mm2());
            // Normals point down, and are those of the dome.
            let (_, triangles) = solid.faces().into_iter().find(|(face, _)| *face == Face::Entry).unwrap();
            let v = solid.triangle(triangles.start)[0];
            let at = solid.vertex(v as usize).map(f64::from);
            let (x, y) = (at[0] + solid.origin_mm().x, at[1] + solid.origin_mm().y);
            let slope = DVec2::new(sign * (0.003 * (x - 3.0) + 0.001 * y), sign * (0.0024 * (y + 2.0) + 0.001 * x));
            let normal = slope.extend(-1.0).normalize();
            let found = DVec3::from(solid.normal_at(Face::Entry, v).map(f64::from));
            assert!((found - normal).length() < 1e-6, "{found} {normal}");
        }
    }
}

#[test]
fn entry_faces_that_do_not_fit_are_refused() {
    let exit = surface(Extent::new(60.0, 40.0), 31, 21, |x, y| 0.2 * wavy(x, y));
    let dome = |extent, nx, ny| surface(extent, nx, ny, dome);
    let between = |entry: &HeightField, thickness_mm, shape| {
        Solid::between(&exit, entry, Stock::of_thickness(thickness_mm), shape)
    };
    let fits = dome(exit.extent(), 31, 21);
    assert!(between(&fits, 12.0, Shape::default()).is_ok());
    for other in [dome(exit.extent(), 31, 22), dome(Extent::new(60.0, 41.0), 31, 21)] {
        let refused = between(&other, 12.0, Shape::default());
        assert!(matches!(refused, Err(SolidError::EntryGrid { .. })), "{refused:?}");
    }
    // Nodes of the face, not of its skirt.
    let skirted = between(&fits, 12.0, Shape { skirt_mm: 4.0, ..Shape::default() });
    assert!(matches!(skirted, Err(SolidError::EntryGrid { .. })));
    let rim = Some(Rim { width_mm: 5.0, rise_mm: 1.0, mark_mm: None });
    assert!(matches!(between(&fits, 12.0, Shape { rim, ..Shape::default() }), Err(SolidError::EntryOutline)));
    let disc = HeightField::outlined(exit.extent(), Outline::Circle, exit.heights_mm().clone());
    let refused = Solid::between(&disc, &fits, Stock::of_thickness(12.0), Shape::default());
    assert!(matches!(refused, Err(SolidError::EntryOutline)));
    let mut broken = fits.heights_mm().clone();
    broken[(3, 2)] = f64::NAN;
    let broken = HeightField::found(exit.extent(), Outline::Rectangle, broken);
    let error = between(&broken, 12.0, Shape::default()).unwrap_err().to_string();
    assert!(error.contains("entry face at node (3, 2)"), "{error}");
    // Each face alone would leave enough.
    let both = between(&fits, 4.5, Shape::default());
    assert!(matches!(both, Err(SolidError::TooThin { .. })), "{both:?}");
    assert!(Solid::new(&exit, Stock::of_thickness(4.5)).is_ok());
}
