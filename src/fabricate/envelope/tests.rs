//! Milled faces against closed forms and against a search by force.

use super::super::{Cutter, Direction, Scallop};
use super::*;
use crate::grid::Extent;
use crate::measured::at_worst;

const BLOCK: Extent = Extent::new(12.0, 10.0);

fn face(f: impl Fn(DVec2) -> f64) -> HeightField {
    HeightField::new(BLOCK, Field::from_fn(97, 81, |i, j| f(BLOCK.node(i, j, 97, 81))))
}

#[test]
fn a_plane_gets_scallops_of_the_known_height() {
    let plane = face(|_| 0.0);
    for direction in [Direction::X, Direction::Y, Direction::at(33.0)] {
        let cutter = Cutter::ball(2.0).unwrap();
        let pass = Pass { direction, ..Pass::finishing(cutter, 0.3) };
        let rows = Rows::along(&plane, pass).unwrap();
        let (nx, ny) = (601, 501);
        let (heights, slopes) = rows.left(nx, ny);
        // Away from the border, where the rows end.
        for j in ny / 4..3 * ny / 4 {
            for i in nx / 4..3 * nx / 4 {
                let place = (BLOCK.node(i, j, nx, ny).dot(rows.across) - rows.first.y) / 0.3;
                let aside = 0.3 * (place - place.round());
                let wanted = 2.0 - (4.0 - aside * aside).sqrt();
                assert!((heights[(i, j)] - wanted).abs() < 1e-8, "{direction}: {} for {wanted}", heights[(i, j)]);
                let rise = aside / (4.0 - aside * aside).sqrt() * rows.across;
                // On the ridge either side may be taken.
                let ridge = aside.abs() > 0.149_99;
                assert!(ridge || (slopes[(i, j)] - rise).length() < 1e-6, "{direction}: {} for {rise}", slopes[(i, j)]);
            }
        }
        assert!((Scallop::of(cutter, 0.3).unwrap().height_mm - (2.0 - (4.0_f64 - 0.0225).sqrt())).abs() < 1e-15);
    }
}

/// Rows so dense and so finely sampled that every place is tried.
fn by_force(rows: &Rows<'_>, at: DVec2) -> f64 {
    let sweep = Sweep { rows, least: Vec::new(), bands: Vec::new() };
    let cutter = rows.pass.cutter;
    let (u, v) = (at.dot(rows.along), at.dot(rows.across));
    let mut least = f64::INFINITY;
    for row in 0..rows.count {
        let aside = rows.first.y + row as f64 * rows.pass.step_over_mm - v;
        if aside.abs() >= cutter.radius_mm() {
            continue;
        }
        // The ends of the way, beside which there is none, are positions; at those of the reach a
        // rim cuts.
        let reach = (cutter.radius_mm().powi(2) - aside * aside).max(0.0).sqrt() * (1.0 - 1e-12);
        let positions = (0..rows.positions).map(|i| rows.first.x + i as f64 * rows.spacing_mm);
        let places = (-4000..=4000).map(|k| u + cutter.radius_mm() * f64::from(k) / 4000.0 * (1.0 - 1e-12));
        for place in places.chain(positions).chain([u - reach, u + reach]) {
            let profile = cutter.profile_mm(DVec2::new(place - u, aside).length());
            if let (true, Some(tip)) = (profile.is_finite(), sweep.rows.tip(row, place)) {
                least = least.min(tip.height + profile);
            }
        }
    }
    least
}

#[test]
fn hills_creases_and_borders_agree_with_a_search_by_force() {
    let wavy = face(|p| 0.2 * (1.1 * p.x).sin() * (0.9 * p.y + 0.3).cos() + 0.01 * p.x * p.y);
    let crease = face(|p| 0.2 * (p.x * 0.8 + p.y * 0.6).abs() - 0.1 * (0.7 * p.y).cos());
    for surface in [&wavy, &crease] {
        for cutter in [Cutter::ball(1.5).unwrap(), Cutter::bull(1.5, 0.5).unwrap(), Cutter::flat(1.0).unwrap()] {
            let pass = Pass { direction: Direction::at(25.0), ..Pass::finishing(cutter, 0.2) };
            let rows = Rows::along(surface, pass).unwrap();
            let (nx, ny) = (13, 11);
            let heights = rows.left(nx, ny).0;
            for j in 0..ny {
                for i in 0..nx {
                    let forced = by_force(&rows, BLOCK.node(i, j, nx, ny));
                    let off = heights[(i, j)] - forced;
                    // Force tries places a four-thousandth of the radius apart.
                    at_worst(3e-5, off.abs(), format_args!("{cutter} at column {i}, row {j}"));
                }
            }
        }
    }
}

#[test]
fn nothing_is_gouged_and_an_allowance_stays() {
    let wavy = face(|p| 0.2 * (1.1 * p.x).sin() * (0.9 * p.y + 0.3).cos());
    for (cutter, allowance) in
        [(Cutter::ball(1.0).unwrap(), 0.0), (Cutter::ball(1.0).unwrap(), 0.15), (Cutter::bull(1.5, 0.4).unwrap(), 0.0)]
    {
        let pass = Pass { allowance_mm: allowance, ..Pass::finishing(cutter, 0.05) };
        let left = Rows::along(&wavy, pass).unwrap().left(97, 81).0;
        let excess = |i: usize, j: usize| left[(i, j)] - wavy.heights_mm()[(i, j)];
        for j in 10..71 {
            for i in 10..87 {
                // The way of the tip bends suddenly where the disc of a bull-nose cutter lifts off:
                // the cubic errs by as much.
                let exact = if cutter.corner_mm() < cutter.radius_mm() { 2e-5 } else { 2e-6 };
                assert!(excess(i, j) > allowance - exact, "{cutter} {allowance}: {}", excess(i, j));
                // Along the normal, so a little more along z; and the scallops.
                assert!(allowance == 0.0 || excess(i, j) < 1.06 * allowance, "{}", excess(i, j));
            }
        }
    }
}
