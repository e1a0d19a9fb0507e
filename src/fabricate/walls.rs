//! The wall around a face whose rim stands above it: how near to it a cutter comes.

use super::{Cutter, DropCutter, Milled};
use crate::{
    grid::Contour,
    surface::{HeightField, SurfaceSpline},
};
use glam::DVec2;
use rayon::prelude::*;

/// A cutter on a face with a rim above it, whose wall goes straight up along the outline.
///
/// The axis may come as near to the wall as the cutter is wide at the top of the rim. What lies
/// beside the wall is cut by the cutter that stands there, and stays higher than it shall.
#[derive(Debug)]
pub struct Walls<'a> {
    face: DropCutter<'a>,
    spline: SurfaceSpline,
    contour: Contour,
    surface: &'a HeightField,
    top_mm: f64,
}

/// What the cutter does not reach beside the wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unreached {
    /// Share of the face's nodes.
    pub share: f64,
    /// How far it reaches from the wall, mm.
    pub width_mm: f64,
    /// The most that stays on the face, mm.
    pub height_mm: f64,
}

impl Unreached {
    /// The same in words.
    pub fn in_words(&self) -> String {
        format!(
            "its wall keeps the cutter from {:.1} % of the face, up to {:.2} mm from the wall, where up to {:.3} mm stay",
            100.0 * self.share,
            self.width_mm,
            self.height_mm
        )
    }
}

/// What stays is more than this, mm; less is rounding.
const LEAST_MM: f64 = 1e-4;
/// Steps of the search for the axis that touches both face and wall, and how near it comes, mm.
const STEPS: usize = 24;
const NEAR_MM: f64 = 1e-7;
/// The steepest slope that is told of what stays: a cutter is upright at its rim.
const STEEPEST: f64 = 1e3;

impl<'a> Walls<'a> {
    /// A face whose rim's plane lies at `top_mm`, on the zero of the face; `None` where it stands
    /// above none of it.
    pub fn around(surface: &'a HeightField, cutter: Cutter, top_mm: f64) -> Option<Self> {
        (top_mm > surface.range_mm().0).then(|| Self {
            face: DropCutter::new(surface, cutter),
            spline: SurfaceSpline::through(surface),
            contour: surface.contour(),
            surface,
            top_mm,
        })
    }

    /// How high the face stays at a point within the outline, mm, and its slope there, where the
    /// wall keeps the cutter from it.
    pub fn left_at(&self, at: DVec2) -> Option<(f64, DVec2)> {
        let cutter = self.face.cutter();
        let reach = 2.0 * cutter.radius_mm();
        if self.contour.level(at).distance_mm < -reach {
            return None;
        }
        let face = self.spline.sample(at);
        // The axis of the cutter that touches the face here.
        let contact = cutter.contact_mm(face.slope.length());
        let touching = at - contact * face.slope.normalize_or_zero();
        let tip_mm = face.height_mm - cutter.profile_mm(contact);
        if self.wall_mm(touching) <= tip_mm {
            return None;
        }
        // Besides, straight away from the wall: the other may not reach the point any more.
        let (height, slope) =
            [touching, at].into_iter().map(|axis| self.left_from(at, axis)).min_by(|(a, _), (b, _)| a.total_cmp(b))?;
        let height = height.min(self.top_mm);
        (height > face.height_mm + LEAST_MM).then_some((height, slope))
    }

    /// What a pass leaves that would reach everything, with what it cannot reach.
    pub fn kept(&self, milled: Milled) -> Milled {
        let Milled { surface, mut slopes } = milled;
        let extent = surface.extent();
        let mut heights = surface.into_heights_mm();
        let (nx, ny) = (heights.nx(), heights.ny());
        let nodes = heights.as_mut_slice().par_iter_mut().zip(slopes.as_mut_slice()).enumerate();
        nodes.for_each(|(k, (height, slope))| {
            let at = extent.node(k % nx, k / nx, nx, ny);
            if self.contour.level(at).distance_mm <= 1e-9
                && let Some((left, rise)) = self.left_at(at)
                && left > *height
            {
                (*height, *slope) = (left, rise);
            }
        });
        Milled { surface: self.surface.with_heights(heights), slopes }
    }

    /// What is left of the face at all of its nodes.
    pub fn unreached(&self) -> Unreached {
        let heights = self.surface.heights_mm();
        let (nx, ny) = (heights.nx(), heights.ny());
        let nodes = (0..nx * ny).into_par_iter().filter_map(|k| {
            let at = self.surface.extent().node(k % nx, k / nx, nx, ny);
            let level = self.contour.level(at);
            (level.distance_mm <= 1e-9).then(|| match self.left_at(at) {
                Some((left, _)) => (1, 1, -level.distance_mm, left - heights.as_slice()[k]),
                None => (1, 0, 0.0, 0.0),
            })
        });
        let (all, high, width_mm, height_mm) =
            nodes.reduce(|| (0, 0, 0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1, f64::max(a.2, b.2), f64::max(a.3, b.3)));
        Unreached { share: f64::from(high) / f64::from(all.max(1)), width_mm, height_mm }
    }

    /// How low the wall lets the tip go, mm.
    fn wall_mm(&self, axis: DVec2) -> f64 {
        let from_wall = (-self.contour.level(axis).distance_mm).max(0.0);
        self.top_mm - self.face.cutter().profile_mm(from_wall)
    }

    /// How high the cutter leaves a point that comes down as near to `axis` as the wall lets it.
    fn left_from(&self, at: DVec2, axis: DVec2) -> (f64, DVec2) {
        let cutter = self.face.cutter();
        let free = cutter.radius_mm() * (1.0 + 1e-9);
        // Further from the wall the cutter stands higher on the face, nearer to it on the wall.
        let stand = |from_wall: f64| {
            let axis = self.away(axis, from_wall);
            let tip = self.face.drop(axis, at).map_or(f64::NEG_INFINITY, |contact| contact.tip_mm);
            (axis, tip, tip - self.wall_mm(axis))
        };
        let mut low = (-self.contour.level(axis).distance_mm).clamp(0.0, free);
        let (mut high, mut best) = (cutter.radius_mm(), stand(free));
        let touching = stand(high);
        if touching.2 > 0.0 {
            best = touching;
            let (mut below, mut above) = (stand(low).2, touching.2);
            for _ in 0..STEPS {
                if high - low < NEAR_MM {
                    break;
                }
                // The chord's zero, kept from the ends, where it would creep.
                let part = if below < 0.0 && below.is_finite() { below / (below - above) } else { 0.5 };
                let middle = low + part.clamp(0.05, 0.95) * (high - low);
                let found = stand(middle);
                if found.2 >= 0.0 {
                    (high, above, best) = (middle, found.2, found);
                } else {
                    (low, below) = (middle, found.2);
                }
            }
        }
        let (axis, tip, _) = best;
        let out = at - axis;
        let (reach, radius) = (out.length(), cutter.radius_mm());
        // A cutter that stands beside the wall touches it but for rounding.
        let reach = if reach < radius * (1.0 + 1e-6) { reach.min(radius) } else { reach };
        let slope = cutter.profile_slope(reach).min(STEEPEST);
        (tip + cutter.profile_mm(reach), slope * out.normalize_or_zero())
    }

    /// A place moved inwards until it is so far from the wall, mm.
    fn away(&self, mut place: DVec2, from_wall_mm: f64) -> DVec2 {
        // In a corner from one wall, and then from the other.
        for _ in 0..3 {
            let level = self.contour.level(place);
            let missing = from_wall_mm + level.distance_mm;
            if missing <= 0.0 {
                break;
            }
            place -= missing * level.normal;
        }
        place
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{Extent, Field, Outline};

    const BLOCK: Extent = Extent::new(20.0, 16.0);

    fn flat() -> HeightField {
        HeightField::new(BLOCK, Field::from_fn(81, 65, |_, _| 0.0))
    }

    #[test]
    fn a_ball_leaves_a_fillet_at_a_high_wall_and_less_at_a_low_one() {
        let face = flat();
        let ball = Cutter::ball(3.0).unwrap();
        let high = Walls::around(&face, ball, 5.0).unwrap();
        for from_wall in [0.01, 0.5, 1.0, 2.9] {
            // The ball stands 3 mm from the wall and touches both.
            let expected = 3.0 - (9.0_f64 - (3.0_f64 - from_wall).powi(2)).sqrt();
            let (left, slope) = high.left_at(DVec2::new(10.0 - from_wall, 1.0)).unwrap();
            assert!((left - expected).abs() < 1e-6, "{left} instead of {expected} at {from_wall} mm");
            let steep = (3.0 - from_wall) / (9.0_f64 - (3.0_f64 - from_wall).powi(2)).sqrt();
            assert!((slope - DVec2::new(steep, 0.0)).length() < 1e-4 * steep, "{slope}");
        }
        let (left, _) = high.left_at(DVec2::new(10.0, 1.0)).unwrap();
        assert!((left - 3.0).abs() < 1e-6, "{left} on the wall");
        assert_eq!(high.left_at(DVec2::new(6.9, 1.0)), None);
        // At a wall of 1 mm the ball comes as near as it is wide there: sqrt(9 - 4) mm.
        let low = Walls::around(&face, ball, 1.0).unwrap();
        let near = 5.0_f64.sqrt();
        for from_wall in [0.0, 0.5, 2.0] {
            let expected = 3.0 - (9.0_f64 - (near - from_wall).powi(2)).sqrt();
            let (left, _) = low.left_at(DVec2::new(1.0, from_wall - 8.0)).unwrap();
            assert!((left - expected).abs() < 1e-6, "{left} instead of {expected} at {from_wall} mm");
        }
        assert_eq!(low.left_at(DVec2::new(1.0, near + 0.01 - 8.0)), None);
        assert!(Walls::around(&face, ball, -1.0).is_none(), "a flange is no wall");
    }

    #[test]
    fn corners_and_shares_are_those_of_the_two_walls() {
        let face = flat();
        let walls = Walls::around(&face, Cutter::ball(3.0).unwrap(), 5.0).unwrap();
        // In the corner the ball stands 3 mm from both walls.
        let expected = 3.0 - (9.0_f64 - 2.0 * 4.0).sqrt();
        let (left, _) = walls.left_at(DVec2::new(9.0, 7.0)).unwrap();
        assert!((left - expected).abs() < 1e-6, "{left} instead of {expected}");
        let found = walls.unreached();
        // All but the middle 14 x 10 mm, on nodes 0.25 mm apart: those at 3 mm are reached, those
        // less than 1e-4 mm above the face count as reached.
        let reached = 57.0 * 41.0;
        assert!((found.share - (1.0 - reached / (81.0 * 65.0))).abs() < 1e-12, "{found:?}");
        assert!(found.width_mm == 2.75 && (found.height_mm - 5.0).abs() < 1e-6, "{found:?}");
        // A flat cutter comes as near as its radius and leaves nothing on a flat face.
        let flat_end = Walls::around(&face, Cutter::flat(3.0).unwrap(), 5.0).unwrap();
        assert_eq!(flat_end.left_at(DVec2::new(10.0, 1.0)), None);
        // But for the corner, which no round cutter reaches.
        assert!(flat_end.left_at(DVec2::new(10.0, 8.0)).is_some_and(|(left, _)| left == 5.0));
    }

    #[test]
    fn round_walls_keep_a_ball_away_too() {
        let extent = Extent::new(20.0, 20.0);
        let face = HeightField::outlined(extent, Outline::Circle, Field::from_fn(81, 81, |_, _| 0.0));
        let walls = Walls::around(&face, Cutter::ball(3.0).unwrap(), 5.0).unwrap();
        let at = DVec2::from_angle(0.7) * 9.0;
        let (left, _) = walls.left_at(at).unwrap();
        assert!((left - (3.0 - (9.0_f64 - 4.0).sqrt())).abs() < 1e-6, "{left}");
    }
}
