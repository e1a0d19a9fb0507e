//! The curve in which the exit face meets a wall: a cubic B-spline, refined until it lies on both.
//!
//! The curve is the cubic spline, twice continuously differentiable, through points of the wall at
//! the height of the face, with the slopes of the true curve at both ends. Every interval in which
//! it leaves the wall or the face by more than [`NEAR_MM`] is halved. Along a straight side the
//! knots are those of the face, and the curve is the face's own, to rounding.

use super::piece::Piece;
use crate::{grid::Contour, surface::ControlNet};
use glam::{DVec2, DVec3};

/// How near the curve is to the face and to the wall, mm: a tenth of what the file calls the same
/// place.
const NEAR_MM: f64 = 1e-7;
/// Halvings of the first intervals, which knots with nine decimals still tell exactly.
const HALVINGS: u32 = 9;
/// Places between two knots where the distance is measured.
const PROBES: u32 = 7;
/// Knots nearer than this to the end of a side are left out, intervals of the face.
const APART: f64 = 1e-6;

/// A clamped cubic B-spline curve on a wall and on the exit face, mm, in the library's frame.
#[derive(Clone, Debug)]
pub(super) struct Trace {
    /// Distinct knots, from 0; the first and the last are fourfold.
    pub(super) knots: Vec<f64>,
    /// Control points.
    pub(super) points: Vec<DVec3>,
}

impl Trace {
    /// The curve above a piece of the outline.
    pub(super) fn new(net: &ControlNet, contour: &Contour, piece: &Piece) -> Self {
        let mut knots = first_knots(net, piece);
        let length = knots[knots.len() - 1];
        let least = 0.5_f64.powi(HALVINGS as i32);
        loop {
            let curve = Cubic::through(net, piece, &knots);
            let errors: Vec<f64> = (0..knots.len() - 1).map(|k| curve.error(k, net, contour)).collect();
            let far = |k: usize| errors[k] > NEAR_MM && knots[k + 1] - knots[k] > 1.5 * least;
            if !(0..errors.len()).any(far) {
                let points = curve.control_points();
                return Self { knots, points };
            }
            let mut refined = Vec::with_capacity(2 * knots.len());
            for k in 0..errors.len() {
                refined.push(knots[k]);
                if far(k) {
                    refined.push(0.5 * (knots[k] + knots[k + 1]));
                }
            }
            refined.push(length);
            knots = refined;
        }
    }

    /// The places of the control points where a function that is linear along the curve's parameter
    /// has its own, from 0 to 1 (Greville).
    pub(super) fn shares(&self) -> Vec<f64> {
        let last = self.knots.len() - 1;
        let knot = |k: usize| self.knots[k.saturating_sub(2).min(last)] / self.knots[last];
        (0..self.points.len()).map(|i| (knot(i) + knot(i + 1) + knot(i + 2)) / 3.0).collect()
    }
}

/// Knots to begin with: about one to an interval of the face.
fn first_knots(net: &ControlNet, piece: &Piece) -> Vec<f64> {
    let intervals = DVec2::new(last(net.knots()[0]), last(net.knots()[1]));
    let per_mm = intervals / net.extent().as_vec();
    match *piece {
        Piece::Straight { from, to } => {
            let (a, b) = ((from - net.extent().lower()) * per_mm, (to - net.extent().lower()) * per_mm);
            let along_x = (b - a).x.abs() > (b - a).y.abs();
            let ((a, b), of_face) = if along_x { ((a.x, b.x), net.knots()[0]) } else { ((a.y, b.y), net.knots()[1]) };
            let length = rounded((b - a).abs());
            let mut knots: Vec<f64> = of_face.iter().map(|knot| rounded((knot - a) * (b - a).signum())).collect();
            knots.retain(|&knot| knot > APART && knot < length - APART);
            knots.extend([0.0, length]);
            knots.sort_by(f64::total_cmp);
            knots
        }
        Piece::Arc { semi_axes, begin, end, .. } => {
            let count = ((end - begin) * (semi_axes * per_mm).max_element()).ceil().max(4.0);
            (0..=count as usize).map(|k| k as f64).collect()
        }
    }
}

fn last(knots: &[f64]) -> f64 {
    knots[knots.len() - 1]
}

/// As the file will have it.
fn rounded(knot: f64) -> f64 {
    (knot * 1e9).round() / 1e9
}

/// A cubic spline by places and slopes at its knots.
struct Cubic<'a> {
    knots: &'a [f64],
    places: Vec<DVec3>,
    slopes: Vec<DVec3>,
}

impl<'a> Cubic<'a> {
    /// Through points of the piece at the height of the net.
    fn through(net: &ControlNet, piece: &Piece, knots: &'a [f64]) -> Self {
        let n = knots.len();
        let length = knots[n - 1];
        let place = |knot: f64| {
            let at = piece.at(knot / length);
            at.extend(net.sample(at).0)
        };
        let slope = |knot: f64| {
            let share = knot / length;
            let rate = piece.rate(share) / length;
            rate.extend(net.sample(piece.at(share)).1.dot(rate))
        };
        let places: Vec<DVec3> = knots.iter().map(|&knot| place(knot)).collect();
        // Equal second derivatives on both sides of every inner knot, between the slopes of the
        // true curve at the ends (Thomas).
        let mut slopes = vec![DVec3::ZERO; n];
        let mut carried = vec![0.0; n];
        (slopes[0], slopes[n - 1]) = (slope(knots[0]), slope(knots[n - 1]));
        for k in 1..n - 1 {
            let (before, after) = (knots[k] - knots[k - 1], knots[k + 1] - knots[k]);
            let right =
                3.0 * ((places[k] - places[k - 1]) * (after / before) + (places[k + 1] - places[k]) * (before / after));
            let pivot = 2.0 * (before + after) - after * carried[k - 1];
            carried[k] = before / pivot;
            slopes[k] = (right - after * slopes[k - 1]) / pivot;
        }
        for k in (1..n - 1).rev() {
            let next = slopes[k + 1];
            slopes[k] -= carried[k] * next;
        }
        Self { knots, places, slopes }
    }

    /// Bézier points of interval `k`.
    fn bezier(&self, k: usize) -> [DVec3; 4] {
        let third = (self.knots[k + 1] - self.knots[k]) / 3.0;
        let (a, b) = (self.places[k], self.places[k + 1]);
        [a, a + third * self.slopes[k], b - third * self.slopes[k + 1], b]
    }

    /// Greatest distance of interval `k` from the face, along z, and from the wall, mm.
    fn error(&self, k: usize, net: &ControlNet, contour: &Contour) -> f64 {
        let [a, b, c, d] = self.bezier(k);
        (1..=PROBES)
            .map(|probe| {
                let t = f64::from(probe) / f64::from(PROBES + 1);
                let s = 1.0 - t;
                let at = s * s * s * a + 3.0 * s * s * t * b + 3.0 * s * t * t * c + t * t * t * d;
                let wall = contour.level(at.truncate()).distance_mm;
                (at.z - net.sample(at.truncate()).0).abs().max(wall.abs())
            })
            .fold(0.0, f64::max)
    }

    /// The same spline by B-spline control points: each is the blossom at three knots in a row, and
    /// affine in the first of them.
    fn control_points(&self) -> Vec<DVec3> {
        let intervals = self.knots.len() - 1;
        let mut points = vec![self.places[0]];
        for k in 0..intervals {
            let [_, b, c, _] = self.bezier(k);
            let length = self.knots[k + 1] - self.knots[k];
            let before = self.knots[k] - self.knots[k.saturating_sub(1)];
            points.push(b - (before / length) * (c - b));
        }
        points.push(self.bezier(intervals - 1)[2]);
        points.push(self.places[intervals]);
        points
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        grid::{Extent, Field, Outline},
        surface::HeightField,
    };

    /// de Boor's algorithm on the knots and control points that a file holds.
    fn evaluate(trace: &Trace, at: f64) -> DVec3 {
        let mut knots = vec![0.0; 3];
        knots.extend(&trace.knots);
        knots.extend([trace.knots[trace.knots.len() - 1]; 3]);
        let span = knots.partition_point(|&knot| knot <= at).clamp(4, trace.points.len()) - 1;
        let mut d: Vec<DVec3> = trace.points[span - 3..=span].to_vec();
        for r in 1..=3 {
            for j in (r..=3).rev() {
                let (low, high) = (knots[span - 3 + j], knots[span + 1 + j - r]);
                d[j] = d[j - 1].lerp(d[j], (at - low) / (high - low));
            }
        }
        d[3]
    }

    #[test]
    fn curves_lie_on_the_wall_and_on_the_face_from_corner_to_corner() {
        let extent = Extent::new(60.0, 40.0);
        let h = |p: DVec2| 0.4 * (0.3 * p.x).sin() * (0.25 * p.y + 0.4).cos() + 0.05 * (1.1 * p.x - 0.9 * p.y).sin();
        let surface = HeightField::new(extent, Field::from_fn(61, 47, |i, j| h(extent.node(i, j, 61, 47))));
        for points in [(61, 47), (23, 31)] {
            let net = ControlNet::fitted(&surface, points);
            for outline in [Outline::Circle, Outline::Rounded { radius_mm: 7.3 }, Outline::Rounded { radius_mm: 20.0 }]
            {
                let contour = outline.within(extent);
                for piece in Piece::around(&contour) {
                    let trace = Trace::new(&net, &contour, &piece);
                    assert!(trace.knots.len() < 2000 && trace.points.len() == trace.knots.len() + 2);
                    let length = trace.knots[trace.knots.len() - 1];
                    let mut worst = 0.0_f64;
                    for k in 0..=5000 {
                        let share = f64::from(k) / 5000.0;
                        let at = evaluate(&trace, share * length);
                        let plan = at.truncate();
                        let off = contour.level(plan).distance_mm.abs();
                        worst = worst.max((at.z - net.sample(plan).0).abs()).max(off);
                        // Along the wall too, as its curve of parameters says.
                        assert!((plan - piece.at(share)).length() < NEAR_MM);
                    }
                    // Between the probes it may be a little more.
                    assert!(worst < 1.2 * NEAR_MM, "{piece:?}: {worst}");
                    if matches!(piece, Piece::Straight { .. }) {
                        assert!(worst < 5e-10, "a straight side is exact but for the decimals of the knots: {worst}");
                    }
                    for (end, share) in [(0, 0.0), (trace.points.len() - 1, 1.0)] {
                        let at = piece.at(share);
                        assert!((trace.points[end] - at.extend(net.sample(at).0)).length() < 1e-12);
                    }
                }
            }
        }
    }

    #[test]
    fn shares_of_a_line_are_the_line() {
        let net = ControlNet::fitted(&HeightField::new(Extent::new(20.0, 20.0), Field::filled(9, 9, 0.0)), (9, 9));
        let contour = Outline::Circle.within(net.extent());
        let mut trace = Trace::new(&net, &contour, &Piece::around(&contour)[1]);
        let shares = trace.shares();
        trace.points = shares.iter().map(|&share| DVec3::new(share, 0.0, 0.0)).collect();
        let length = trace.knots[trace.knots.len() - 1];
        for k in 0..=100 {
            let share = f64::from(k) / 100.0;
            assert!((evaluate(&trace, share * length).x - share).abs() < 1e-14);
        }
    }
}
