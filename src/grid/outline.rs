//! What a block looks like along the axis: a rectangle, a disc, a rectangle with rounded corners.

use super::extent::Extent;
use glam::DVec2;
use std::f64::consts::PI;

/// The outline of a block within its [`Extent`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Outline {
    /// The whole extent.
    #[default]
    Rectangle,
    /// The ellipse inscribed in the extent; in a square one, a disc.
    Circle,
    /// The extent with its corners rounded.
    Rounded {
        /// Radius of the corners, mm.
        radius_mm: f64,
    },
}

impl Outline {
    /// The outline whose curve within an extent these points lie on, as nearly as `tolerance_mm`;
    /// `None` if it is none of those there are.
    pub fn through(points: &[DVec2], extent: Extent, tolerance_mm: f64) -> Option<Self> {
        // A point on a round corner tells its radius: (r - x)^2 + (r - y)^2 = r^2 with its
        // distances x and y from the sides; the one that is furthest from both tells it best.
        let from_sides = points.iter().map(|at| 0.5 * extent.as_vec() - at.abs());
        let corner = from_sides.max_by(|a, b| a.min_element().total_cmp(&b.min_element()))?;
        let radius_mm = corner.x + corner.y + (2.0 * corner.x * corner.y).max(0.0).sqrt();
        [Self::Circle, Self::Rectangle, Self::Rounded { radius_mm }].into_iter().find(|outline| {
            let contour = outline.within(extent);
            points.iter().all(|&at| contour.level(at).distance_mm.abs() <= tolerance_mm)
        })
    }

    /// The outline of what goes on beyond this one by the same length on every side, mm, within an
    /// extent that has grown so.
    pub(crate) fn grown(self, by_mm: f64) -> Self {
        match self {
            Self::Rounded { radius_mm } => Self::Rounded { radius_mm: radius_mm + by_mm },
            other => other,
        }
    }

    /// The curve it is within an extent.
    pub fn within(self, extent: Extent) -> Contour {
        let half = 0.5 * extent.as_vec();
        let radius = match self {
            Self::Rectangle => DVec2::ZERO,
            Self::Circle => half,
            Self::Rounded { radius_mm } => DVec2::splat(radius_mm).min(half),
        };
        Contour { half, radius }
    }
}

/// The curve around a block: a rectangle centred on the axis whose corners are quarters of
/// ellipses. All outlines are that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contour {
    half: DVec2,
    radius: DVec2,
}

/// Where a point lies with respect to a [`Contour`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Level {
    /// Distance from the curve, mm, to first order in itself: exact on the curve, and everywhere
    /// for straight sides and circular corners. Negative inside.
    pub(crate) distance_mm: f64,
    /// The outward unit normal of the level curve.
    pub(crate) normal: DVec2,
}

impl Contour {
    /// Whether the corners are sharp.
    pub fn is_rectangle(&self) -> bool {
        self.radius == DVec2::ZERO
    }

    /// The rectangle around it.
    pub fn extent(&self) -> Extent {
        Extent::new(2.0 * self.half.x, 2.0 * self.half.y)
    }

    /// Semi-axes of the corners, mm.
    pub fn radius_mm(&self) -> DVec2 {
        self.radius
    }

    /// The same with this share of the corners' size.
    pub(crate) fn with_corners(self, share: f64) -> Self {
        Self { radius: self.radius * share, ..self }
    }

    /// Enclosed area, mm².
    pub fn area_mm2(&self) -> f64 {
        4.0 * self.half.x * self.half.y - (4.0 - PI) * self.radius.x * self.radius.y
    }

    /// Enclosed area over that of the extent.
    pub fn share_of_extent(&self) -> f64 {
        self.area_mm2() / self.extent().area_mm2()
    }

    /// Whether a point is enclosed, the curve included.
    #[inline(always)]
    pub fn contains(&self, at: DVec2) -> bool {
        let beyond = at.abs() - (self.half - self.radius);
        if beyond.cmpgt(DVec2::ZERO).all() {
            (beyond / self.radius).length_squared() <= 1.0
        } else {
            beyond.cmple(self.radius).all()
        }
    }

    /// Where a point lies with respect to the curve.
    #[inline(always)]
    pub(crate) fn level(&self, at: DVec2) -> Level {
        let sign = DVec2::new(1.0_f64.copysign(at.x), 1.0_f64.copysign(at.y));
        let beyond = at.abs() - (self.half - self.radius);
        if beyond.cmpgt(DVec2::ZERO).all() && self.radius.cmpgt(DVec2::ZERO).all() {
            let place = beyond / self.radius;
            let length = place.length();
            let gradient = place / (self.radius * length);
            let steepness = gradient.length();
            Level { distance_mm: (length - 1.0) / steepness, normal: sign * gradient / steepness }
        } else {
            let over = beyond - self.radius;
            if over.x > over.y {
                Level { distance_mm: over.x, normal: DVec2::new(sign.x, 0.0) }
            } else {
                Level { distance_mm: over.y, normal: DVec2::new(0.0, sign.y) }
            }
        }
    }

    /// The point of the curve that a point near it belongs to: straight out from a straight side,
    /// along the ray from the centre of the ellipse at a corner. Points in order around the curve
    /// keep their order.
    pub(crate) fn foot(&self, at: DVec2) -> DVec2 {
        let core = self.half - self.radius;
        let centre = at.clamp(-core, core);
        let out = at - centre;
        if out.cmpne(DVec2::ZERO).all() {
            centre + out / (out / self.radius).length()
        } else if out.x != 0.0 {
            DVec2::new(self.half.x.copysign(out.x), at.y)
        } else if out.y != 0.0 {
            DVec2::new(at.x, self.half.y.copysign(out.y))
        } else {
            // Within the core: the nearest side.
            let over = at.abs() - self.half;
            if over.x > over.y {
                DVec2::new(self.half.x.copysign(at.x), at.y)
            } else {
                DVec2::new(at.x, self.half.y.copysign(at.y))
            }
        }
    }

    /// How far it reaches from its middle along a unit vector, mm.
    pub fn reach_mm(&self, along: DVec2) -> f64 {
        (self.half - self.radius).dot(along.abs()) + (self.radius * along).length()
    }

    /// Where a straight line through `at` along a unit vector enters and leaves, mm from `at`;
    /// `None` if it passes.
    pub fn chord_mm(&self, at: DVec2, along: DVec2) -> Option<(f64, f64)> {
        // Convex: inside of both is inside of every edge of a polygon as fine as nobody notices.
        let points = self.polygon(1e-6 * self.half.max_element());
        let (mut begin, mut end) = (f64::NEG_INFINITY, f64::INFINITY);
        for (k, &from) in points.iter().enumerate() {
            let edge = points[(k + 1) % points.len()] - from;
            let (inside, rate) = (edge.perp_dot(at - from), edge.perp_dot(along));
            if rate > 0.0 {
                begin = begin.max(-inside / rate);
            } else if rate < 0.0 {
                end = end.min(-inside / rate);
            } else if inside < -1e-9 * edge.length() * self.half.max_element() {
                return None;
            }
        }
        (end >= begin).then_some((begin, end))
    }

    /// Half of the width at the height `y`, mm; negative beyond the curve.
    pub fn half_width_mm(&self, y: f64) -> f64 {
        chord(self.half.x, self.radius.x, y.abs() - (self.half.y - self.radius.y), self.radius.y)
    }

    /// Half of the height at the abscissa `x`, mm; negative beyond the curve.
    pub fn half_height_mm(&self, x: f64) -> f64 {
        chord(self.half.y, self.radius.y, x.abs() - (self.half.x - self.radius.x), self.radius.x)
    }

    /// Where the curve crosses the segment between a point inside of it and one outside.
    pub(crate) fn crossing(&self, inside: DVec2, outside: DVec2) -> DVec2 {
        // The curve is convex: there is one crossing, and bisection finds it to rounding.
        let (mut near, mut far) = (0.0, 1.0);
        for _ in 0..52 {
            let middle = 0.5 * (near + far);
            if self.contains(inside.lerp(outside, middle)) { near = middle } else { far = middle }
        }
        inside.lerp(outside, 0.5 * (near + far))
    }

    /// Cuts a convex cell, given by its corners in counter-clockwise order and whether they lie
    /// inside, along the chord between the curve's crossings of its edges; hands out triangles of
    /// the part inside. A cell that is wholly inside or outside has none.
    pub(crate) fn cut(&self, corners: [DVec2; 4], inside: [bool; 4], mut piece: impl FnMut([DVec2; 3])) {
        if inside.iter().all(|&v| v == inside[0]) {
            return;
        }
        let (mut first, mut last): (Option<DVec2>, Option<DVec2>) = (None, None);
        let mut add = |at: DVec2| match (first, last) {
            (None, _) => first = Some(at),
            (_, None) => last = Some(at),
            (Some(a), Some(b)) => {
                piece([a, b, at]);
                last = Some(at);
            }
        };
        for k in 0..4 {
            let next = (k + 1) % 4;
            if inside[k] {
                add(corners[k]);
            }
            match (inside[k], inside[next]) {
                (true, false) => add(self.crossing(corners[k], corners[next])),
                (false, true) => add(self.crossing(corners[next], corners[k])),
                _ => {}
            }
        }
    }

    /// A closed polygon on the curve, counter-clockwise from the least x and the middle of y, whose
    /// segments deviate from it by no more than `tolerance_mm`. Its last point is not its first.
    pub fn polygon(&self, tolerance_mm: f64) -> Vec<DVec2> {
        let core = self.half - self.radius;
        if self.is_rectangle() {
            return vec![-core, DVec2::new(core.x, -core.y), core, DVec2::new(-core.x, core.y)];
        }
        let largest = self.radius.max_element();
        let steps = (0.25 * PI / (0.5 * tolerance_mm / largest).min(0.5).sqrt().asin()).ceil().max(2.0) as usize;
        let corners = [-core, DVec2::new(core.x, -core.y), core, DVec2::new(-core.x, core.y)];
        let mut points: Vec<DVec2> = Vec::with_capacity(4 * (steps + 1));
        for (quarter, centre) in corners.into_iter().enumerate() {
            for k in 0..=steps {
                let angle = PI + 0.5 * PI * (quarter as f64 + k as f64 / steps as f64);
                let at = centre + DVec2::from_angle(angle) * self.radius;
                if points.last().is_none_or(|last: &DVec2| (at - *last).length() > 1e-9 * largest) {
                    points.push(at);
                }
            }
        }
        if points.len() > 1 && (points[0] - points[points.len() - 1]).length() <= 1e-9 * largest {
            points.pop();
        }
        points
    }
}

/// What is left of a convex polygon where it reaches no further than `reach` along a vector:
/// Sutherland and Hodgman's cut by one line.
pub(crate) fn cut_off(points: &[DVec2], along: DVec2, reach: f64) -> Vec<DVec2> {
    let mut left = Vec::with_capacity(points.len() + 2);
    for (k, &from) in points.iter().enumerate() {
        let to = points[(k + 1) % points.len()];
        let (a, b) = (along.dot(from) - reach, along.dot(to) - reach);
        if a <= 0.0 {
            left.push(from);
        }
        if a * b < 0.0 {
            left.push(from.lerp(to, a / (a - b)));
        }
    }
    left
}

/// Half of a chord at `beyond` above the beginning of an elliptical corner.
fn chord(half: f64, radius: f64, beyond: f64, other: f64) -> f64 {
    if beyond <= 0.0 {
        half
    } else if beyond > other {
        -1.0
    } else {
        half - radius + radius * (1.0 - (beyond / other) * (beyond / other)).max(0.0).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::at_worst;

    const EXTENT: Extent = Extent::new(60.0, 40.0);
    const ALL: [Outline; 3] = [Outline::Rectangle, Outline::Circle, Outline::Rounded { radius_mm: 7.0 }];

    #[test]
    fn areas_are_those_of_the_polygons_and_of_the_chords() {
        for (outline, area) in
            [(Outline::Rectangle, 2400.0), (Outline::Circle, PI * 600.0), (ALL[2], 2400.0 - (4.0 - PI) * 49.0)]
        {
            let contour = outline.within(EXTENT);
            assert!((contour.area_mm2() - area).abs() < 1e-9);
            let polygon = contour.polygon(1e-6);
            let next = |k: usize| polygon[(k + 1) % polygon.len()];
            let sum: f64 = (0..polygon.len()).map(|k| 0.5 * polygon[k].perp_dot(next(k))).sum();
            at_worst(2.1e-5, (sum - area).abs(), format_args!("{outline:?}: {sum} of {area}"));
            let rows = 20_000;
            let chords: f64 = (0..rows)
                .map(|k| 2.0 * contour.half_width_mm(40.0 * (f64::from(k) + 0.5) / f64::from(rows) - 20.0))
                .sum::<f64>()
                * 40.0
                / f64::from(rows);
            at_worst(2.1e-4, (chords - area).abs(), format_args!("{outline:?}: {chords} of {area}"));
        }
    }

    #[test]
    fn levels_vanish_on_the_curve_and_their_normals_are_its_own() {
        for outline in ALL {
            let contour = outline.within(EXTENT);
            let polygon = contour.polygon(1e-4);
            for k in 0..polygon.len() {
                let (a, b) = (polygon[k], polygon[(k + 1) % polygon.len()]);
                let middle = contour.foot(0.5 * (a + b));
                let level = contour.level(middle);
                assert!(level.distance_mm.abs() < 1e-12, "{outline:?} at {middle}: {}", level.distance_mm);
                assert!(level.normal.dot((b - a).normalize()).abs() < 1e-11);
                assert!((b - a).perp_dot(level.normal) < 0.0, "outward");
                for step in [-0.3, 0.2] {
                    let off = middle + step * level.normal;
                    let distance = contour.level(off).distance_mm;
                    at_worst(
                        0.00104,
                        (distance - step).abs() / step.abs(),
                        format_args!("{outline:?}: {distance} for {step}"),
                    );
                    assert_eq!(contour.contains(off), step < 0.0);
                }
                assert!((contour.crossing(DVec2::ZERO, 2.0 * middle) - middle).length() < 1e-12);
            }
        }
    }

    #[test]
    fn outlines_are_known_by_their_points() {
        for outline in ALL {
            let points = outline.within(EXTENT).polygon(1e-3);
            match (outline, Outline::through(&points, EXTENT, 1e-9)) {
                (Outline::Rounded { radius_mm }, Some(Outline::Rounded { radius_mm: found })) => {
                    assert!((found - radius_mm).abs() < 1e-9);
                }
                (wanted, found) => assert_eq!(found, Some(wanted)),
            }
        }
        let hexagon: Vec<DVec2> = (0..6).map(|k| 20.0 * DVec2::from_angle(f64::from(k))).collect();
        assert_eq!(Outline::through(&hexagon, EXTENT, 1e-3), None);
        assert_eq!(Outline::through(&[], EXTENT, 1e-3), None);
    }

    #[test]
    fn reach_and_chords_agree() {
        for outline in ALL {
            let contour = outline.within(EXTENT);
            for k in 0..30 {
                let along = DVec2::from_angle(0.21 * f64::from(k));
                let (across, reach) = (along.perp(), contour.reach_mm(along.perp()));
                assert!(contour.chord_mm(1.001 * reach * across, along).is_none());
                let area: f64 = (0..400)
                    .map(|k| reach * (f64::from(k) + 0.5 - 200.0) / 200.0)
                    .map(|aside| contour.chord_mm(aside * across, along).map_or(0.0, |(begin, end)| end - begin))
                    .sum::<f64>()
                    * reach
                    / 200.0;
                at_worst(3.8e-5, (area / contour.area_mm2() - 1.0).abs(), format_args!("{outline:?} {along}: {area}"));
            }
        }
    }

    #[test]
    fn chords_end_on_the_curve() {
        for outline in ALL {
            let contour = outline.within(EXTENT);
            for k in 0..=40 {
                let y = f64::from(k) - 20.0;
                let end = DVec2::new(contour.half_width_mm(y), y);
                assert!(contour.level(end).distance_mm.abs() < 1e-9, "{outline:?} at {y}");
            }
            assert!(contour.half_width_mm(20.1) < 0.0 || contour.is_rectangle());
        }
    }
}
