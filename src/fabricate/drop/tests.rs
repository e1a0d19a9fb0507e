//! Dropped cutters against closed forms and against a search by force.

use super::*;
use crate::grid::Extent;

const EXTENT: Extent = Extent::new(20.0, 16.0);

fn face(f: impl Fn(DVec2) -> f64) -> HeightField {
    HeightField::new(EXTENT, Field::from_fn(101, 81, |i, j| f(EXTENT.node(i, j, 101, 81))))
}

/// The greatest of many samples.
fn by_force(surface: &HeightField, cutter: Cutter, axis: DVec2) -> f64 {
    let spline = SurfaceSpline::through(surface);
    let (rings, sectors) = (160, 720);
    let mut best = f64::NEG_INFINITY;
    // Edges and corners, which contacts of axes beside the block slide along.
    let half = -EXTENT.lower();
    for k in -2000..=2000 {
        let t = f64::from(k) / 2000.0;
        for at in [
            DVec2::new(half.x * t, half.y),
            DVec2::new(half.x * t, -half.y),
            DVec2::new(half.x, half.y * t),
            DVec2::new(-half.x, half.y * t),
        ] {
            best = best.max(spline.sample(at).height_mm - cutter.profile_mm(at.distance(axis)));
        }
    }
    for ring in 0..=rings {
        let r = cutter.radius_mm() * (1.0 - 1e-12) * f64::from(ring) / f64::from(rings);
        for sector in 0..sectors {
            let at = axis + r * DVec2::from_angle(std::f64::consts::TAU * f64::from(sector) / f64::from(sectors));
            if (at.abs() + EXTENT.lower()).max_element() <= 0.0 {
                best = best.max(spline.sample(at).height_mm - cutter.profile_mm(r));
            }
        }
    }
    best
}

#[test]
fn a_plane_is_touched_where_the_analytic_solution_says() {
    let slope = DVec2::new(0.2, -0.1);
    let plane = face(|p| slope.dot(p));
    let steepness = slope.length();
    let normal = (1.0 + steepness * steepness).sqrt();
    for (cutter, lift) in [
        (Cutter::ball(3.0).unwrap(), 3.0 * (normal - 1.0)),
        (Cutter::flat(2.0).unwrap(), 2.0 * steepness),
        (Cutter::bull(3.0, 1.0).unwrap(), 2.0 * steepness + (normal - 1.0)),
    ] {
        let contact = DropCutter::new(&plane, cutter).drop(DVec2::new(1.0, -0.7), DVec2::ZERO).unwrap();
        let wanted = slope.dot(DVec2::new(1.0, -0.7)) + lift;
        assert!((contact.tip_mm - wanted).abs() < 1e-11, "{cutter}: {} for {wanted}", contact.tip_mm);
    }
}

#[test]
fn smooth_faces_creases_and_borders_agree_with_a_search_by_force() {
    let wavy = face(|p| 0.3 * (0.9 * p.x).sin() * (0.7 * p.y + 0.3).cos() + 0.02 * p.x * p.y);
    let crease = face(|p| 0.25 * (p.x * 0.8 + p.y * 0.6).abs() - 0.2 * (0.5 * p.y).cos());
    for surface in [&wavy, &crease] {
        for cutter in [
            Cutter::ball(1.5).unwrap(),
            Cutter::ball(6.0).unwrap(),
            Cutter::flat(1.0).unwrap(),
            Cutter::bull(2.0, 0.5).unwrap(),
        ] {
            let drop = DropCutter::new(surface, cutter);
            for k in 0..60 {
                let axis = DVec2::new(-11.0 + 22.0 * f64::from(k) / 59.0, -9.0 + 18.0 * f64::from(k * 23 % 60) / 59.0);
                // Where the rim just grazes the block rounding decides.
                if axis.distance(axis.clamp(EXTENT.lower(), -EXTENT.lower())) > 0.99 * cutter.radius_mm() {
                    continue;
                }
                let (Some(contact), forced) = (drop.drop(axis, axis), by_force(surface, cutter, axis)) else {
                    continue;
                };
                // Force is coarse: never higher than the truth, and lower by its mesh squared, on a
                // rim by its mesh.
                let coarse = if cutter.corner_mm() == 0.0 { 2e-3 } else { 5e-4 };
                let off = contact.tip_mm - forced;
                assert!((-2e-6..coarse).contains(&off), "{cutter} at {axis}: {off:e}");
            }
        }
    }
}

#[test]
fn a_cutter_beside_the_block_falls_past_it() {
    let plane = face(|_| 0.0);
    let drop = DropCutter::new(&plane, Cutter::ball(2.0).unwrap());
    assert_eq!(drop.drop(DVec2::new(12.1, 0.0), DVec2::ZERO), None);
    let edge = drop.drop(DVec2::new(11.0, 0.0), DVec2::ZERO).unwrap();
    assert!((edge.tip_mm - (3.0_f64.sqrt() - 2.0)).abs() < 1e-12, "{edge:?}");
}

#[test]
fn the_guess_does_not_matter() {
    let wavy = face(|p| 0.3 * (0.9 * p.x).sin() * (0.7 * p.y + 0.3).cos());
    let drop = DropCutter::new(&wavy, Cutter::ball(2.5).unwrap());
    for k in 0..50 {
        let axis = DVec2::new(-9.0 + 0.36 * f64::from(k), 7.0 - 0.28 * f64::from(k));
        let tips = [axis, axis + 0.5, DVec2::ZERO].map(|guess| drop.drop(axis, guess).unwrap().tip_mm);
        assert!((tips[0] - tips[1]).abs() < 1e-9 && (tips[0] - tips[2]).abs() < 1e-9, "{tips:?}");
    }
}
