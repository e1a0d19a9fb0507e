//! What a ball, its rows and a polish make of a face, on average over where the rows happen to lie,
//! and the face of which they make the one that is wanted.

use super::{HeightField, Polish, SurfaceSpline};
use crate::grid::Field;
use glam::DVec2;
use rayon::prelude::*;

/// How a face is finished: with a polish, and before it with a ball in rows along x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finish {
    polish: Polish,
    ball: Option<Ball>,
}

/// The ball of a cutter, and its rows.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ball {
    radius_mm: f64,
    step_over_mm: f64,
}

/// No determinant of `1 - r H` is taken to be less, where the ball fits hardly or not at all.
const LEAST_ROOM: f64 = 0.02;
/// No ridge is taken to be higher than that of a plane by more than this factor.
const MOST_SPREAD: f64 = 8.0;

/// Directions of the chords by which hollows are bridged, in nodes, and how many times their
/// length.
const CHORDS: [(usize, isize); 8] = [(1, 0), (0, 1), (1, 1), (1, -1), (2, 1), (2, -1), (1, 2), (1, -2)];
const LENGTHS: [usize; 4] = [1, 2, 4, 8];
/// Rows from which a chord of a node may come.
const REACH: usize = 16;
/// Most rounds of filling. Heights only rise, and what a round leaves is seen by whoever mills the
/// face in simulation.
const ROUNDS: usize = 200;
/// A change of heights that is none, mm.
const NOTHING_MM: f64 = 1e-9;

impl Finish {
    /// A polish alone.
    pub fn new(polish: Polish) -> Self {
        Self { polish, ball: None }
    }

    /// The same after a ball, or the corner of a bull-nose cutter, of this radius, mm, in rows so
    /// far apart, mm; 0 for rows that are not known.
    #[must_use]
    pub fn with_ball(self, radius_mm: f64, step_over_mm: f64) -> Self {
        Self { ball: Some(Ball { radius_mm, step_over_mm }), ..self }
    }

    /// A face that is finished to `surface`, as far as can be had: sharpened by the inverse of the
    /// polish, every hollow that is sharper than the ball filled as far as the ball goes down.
    pub fn prepared(&self, surface: &HeightField) -> HeightField {
        let sharp = self.polish.presharpened(surface);
        match self.ball {
            Some(ball) => ball.filled(sharp),
            None => sharp,
        }
    }

    /// The face after the work.
    pub fn finished(&self, surface: &HeightField) -> HeightField {
        match self.ball {
            Some(ball) => self.polish.polished(&ball.with_ridges(surface)),
            None => self.polish.polished(surface),
        }
    }
}

impl Ball {
    /// The face with the mean height of the ridges that rows leave.
    ///
    /// Rows lie on the surface of the ball's centres, at the distance of its radius `r` from the
    /// face. Where that surface bends, places of contact are nearer or further apart than the rows
    /// are: with the Hessian `H` of the face, ridges across rows are arcs of the curvature
    /// `[(1 - r H)^-1]_yy / r`, and the mean height of an arc over a step `s` is its curvature times
    /// `s^2 / 24`. So rows blur a face across their direction, and hollows more than hills. (Slopes
    /// of ten degrees change that by 3 %, and are neglected.)
    fn with_ridges(self, surface: &HeightField) -> HeightField {
        let Self { radius_mm, step_over_mm } = self;
        let (nx, ny) = (surface.heights_mm().nx(), surface.heights_mm().ny());
        let (spline, extent) = (SurfaceSpline::through(surface), surface.extent());
        let of_plane_mm = step_over_mm * step_over_mm / (24.0 * radius_mm);
        let mut heights = surface.heights_mm().as_slice().to_vec();
        heights.par_chunks_mut(nx).enumerate().for_each(|(j, row)| {
            for (i, z) in row.iter_mut().enumerate() {
                let [xx, xy, yy] = spline.sample(extent.node(i, j, nx, ny)).curvature.map(|bend| radius_mm * bend);
                let room = ((1.0 - xx) * (1.0 - yy) - xy * xy).max(LEAST_ROOM);
                *z += ((1.0 - xx) / room).clamp(0.0, MOST_SPREAD) * of_plane_mm;
            }
        });
        surface.with_heights(Field::from_vec(nx, ny, heights))
    }

    /// The least face above this one into whose hollows the ball fits.
    ///
    /// Above the middle of a chord between two points of such a face there is no room deeper than
    /// the arc of the ball over it: `r - sqrt(r^2 - c^2)` for half a chord of length `c`, along the
    /// normal. Heights rise to where that holds for every chord; where it does already, they stay
    /// to the last bit.
    fn filled(self, surface: HeightField) -> HeightField {
        let (heights, square) = (surface.heights_mm(), self.radius_mm * self.radius_mm);
        let (nx, ny) = (heights.nx(), heights.ny());
        let spacing = surface.extent().node_spacing(nx, ny);
        let slopes = SurfaceSpline::through(&surface).node_slopes();
        let chords = CHORDS.iter().flat_map(|&(x, y)| LENGTHS.map(|times| (times * x, times as isize * y)));
        let chords: Vec<((usize, isize), DVec2)> =
            chords.map(|(x, y)| ((x, y), DVec2::new(x as f64, y as f64) * spacing)).collect();
        let mut filled = heights.as_slice().to_vec();
        let mut rising = vec![true; ny];
        for _ in 0..ROUNDS {
            let before = filled.clone();
            let bridged = |i: usize, j: usize| {
                let slope = slopes[(i, j)];
                let at = |x: usize, y: usize| before[y * nx + x];
                let over = chords.iter().filter_map(|&((x, y), chord)| {
                    let (left, right) = (i.checked_sub(x)?, Some(i + x).filter(|k| *k < nx)?);
                    let (from, to) = (j.checked_add_signed(-y)?, j.checked_add_signed(y)?);
                    if from >= ny || to >= ny {
                        return None;
                    }
                    // Across a chord the face is as steep as it was found.
                    let (begin, end, across) = (at(left, from), at(right, to), chord.perp_dot(slope));
                    let (half, rise) = (chord.length_squared(), 0.5 * (end - begin));
                    let steep = (1.0 + (rise * rise + across * across) / half).sqrt();
                    let room = square - half - rise * rise;
                    (room > 0.0).then(|| 0.5 * (begin + end) - steep * (self.radius_mm - room.sqrt()))
                });
                over.fold(f64::NEG_INFINITY, f64::max)
            };
            let rose: Vec<bool> = filled
                .par_chunks_mut(nx)
                .enumerate()
                .map(|(j, row)| {
                    let mut rose = false;
                    for (i, z) in row.iter_mut().enumerate().filter(|_| rising[j]) {
                        let least = bridged(i, j);
                        if least > *z + NOTHING_MM {
                            (*z, rose) = (least, true);
                        }
                    }
                    rose
                })
                .collect();
            if !rose.contains(&true) {
                break;
            }
            let near = |j: usize| j.saturating_sub(REACH)..(j + REACH + 1).min(ny);
            rising = (0..ny).map(|j| rose[near(j)].contains(&true)).collect();
        }
        // As they were found, where nothing is to be filled.
        if filled == heights.as_slice() { surface } else { surface.with_heights(Field::from_vec(nx, ny, filled)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{grid::Extent, measured::at_worst};

    const BLOCK: Extent = Extent::new(8.0, 6.0);
    const BALL: Ball = Ball { radius_mm: 2.0, step_over_mm: 0.1 };

    fn face(f: impl Fn(DVec2) -> f64) -> HeightField {
        HeightField::new(BLOCK, Field::from_fn(161, 121, |i, j| f(BLOCK.node(i, j, 161, 121))))
    }

    #[test]
    fn a_groove_is_filled_by_the_arc_of_the_ball_and_the_rest_stays() {
        for (slope, measured) in [(0.05, 3.2e-3), (0.2, 0.0161)] {
            let groove = face(|p| slope * p.x.abs());
            let filled = BALL.filled(groove.clone());
            // A ball of radius r touches both sides of a groove at r sin(a), with tan(a) the slope.
            let (tilt, r) = (slope.atan(), BALL.radius_mm);
            let lowest = r / tilt.cos() - r;
            let off_um = |i: usize| {
                let x = BLOCK.node(i, 60, 161, 121).x;
                let arc = lowest + r - (r * r - x * x).sqrt();
                let right = if x.abs() < r * tilt.sin() { arc } else { slope * x.abs() };
                // The mean is that of the face, not of the groove.
                let shift = filled.heights_mm()[(0, 60)] - slope * 4.0;
                1e3 * (filled.heights_mm()[(i, 60)] - shift - right).abs()
            };
            at_worst(measured, (0..161).map(off_um).fold(0.0, f64::max), format_args!("{slope}: um"));
        }
        // A hill, a plane and a hollow in which the ball fits.
        for bend in [-1.0, 0.0, 0.49] {
            let round = face(|p| 0.1 * p.x + 0.5 * bend * p.y * p.y);
            assert_eq!(BALL.filled(round.clone()), round, "{bend}");
        }
    }

    #[test]
    fn ridges_lift_a_plane_evenly_and_a_hollow_most() {
        let lift = |bend: f64| {
            let round = face(|p| 0.5 * bend * p.y * p.y);
            let ridged = BALL.with_ridges(&round);
            let at = |j: usize| ridged.heights_mm()[(80, j)] - round.heights_mm()[(80, j)];
            // Both are of mean 0.
            at(60) - at(20)
        };
        assert_eq!([lift(0.0), lift(0.3)].map(|lift| lift.abs() < 1e-12), [true; 2]);
        // One half hollow, one half hill.
        let half = face(|p| if p.y > 0.0 { 0.1 * p.y.powi(3) / 6.0 } else { 0.0 });
        let ridged = BALL.with_ridges(&half);
        let at = |j: usize| ridged.heights_mm()[(80, j)] - half.heights_mm()[(80, j)];
        // At y = 2 the bend is 0.2: of the radius 2 that leaves 0.6.
        let right = 0.01 / 48.0 * (1.0 / 0.6 - 1.0);
        at_worst(2e-13, (at(100) - at(10) - right).abs() / right, "share of the lift");
    }
}
