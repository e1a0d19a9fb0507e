//! Arcs and helices as the words I, J, K and R tell them.

use super::error::ProgramFault;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// The plane of arcs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Plane {
    /// G17: x and y, the helix along z.
    #[default]
    Xy,
    /// G18: z and x, the helix along y.
    Zx,
    /// G19: y and z, the helix along x.
    Yz,
}

impl Plane {
    /// The components of a vector along the first and the second axis of the plane, and across it.
    /// Seen from the end of the third axis, the first turns to the second counter-clockwise.
    #[inline]
    pub(super) fn of(self, v: DVec3) -> (DVec2, f64) {
        match self {
            Self::Xy => (DVec2::new(v.x, v.y), v.z),
            Self::Zx => (DVec2::new(v.z, v.x), v.y),
            Self::Yz => (DVec2::new(v.y, v.z), v.x),
        }
    }

    /// The vector of such components.
    #[inline]
    fn back(self, at: DVec2, across: f64) -> DVec3 {
        match self {
            Self::Xy => DVec3::new(at.x, at.y, across),
            Self::Zx => DVec3::new(at.y, across, at.x),
            Self::Yz => DVec3::new(across, at.x, at.y),
        }
    }

    /// The letters of the centre's distances along both axes.
    pub(super) fn letters(self) -> [char; 2] {
        match self {
            Self::Xy => ['I', 'J'],
            Self::Zx => ['K', 'I'],
            Self::Yz => ['J', 'K'],
        }
    }

    /// The same in words.
    pub(super) fn centre_words(self) -> &'static str {
        match self {
            Self::Xy => "I, J",
            Self::Zx => "I, K",
            Self::Yz => "J, K",
        }
    }
}

/// An arc in a plane, a helix, or one whose radius changes evenly by as much as its ends disagree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// Its plane.
    pub plane: Plane,
    /// Its centre in the plane, mm: along the first and the second axis.
    pub centre: DVec2,
    /// Radius at its beginning and at its end, mm.
    pub radius: [f64; 2],
    /// Angle of its beginning, from the first axis towards the second, and how far it turns,
    /// radians: negative for G2.
    pub angle: [f64; 2],
    /// Place across the plane at its beginning and at its end, mm.
    pub across: [f64; 2],
}

/// How a centre is told.
#[derive(Clone, Copy, Debug)]
pub(super) enum Centre {
    /// By its distances from the beginning, or, with `absolute`, by its place.
    Words { of: DVec2, absolute: bool },
    /// By the radius: negative for the longer way.
    Radius(f64),
}

/// Radii that differ by less than this, mm, are rounded numbers; by more than a hundred times that
/// they are a mistake, and in between if it is more than a thousandth of the radius. These are
/// LinuxCNC's limits (`CENTER_ARC_RADIUS_TOLERANCE_MM`, `SPIRAL_RELATIVE_TOLERANCE`).
const LEAST_MISFIT_MM: f64 = 0.0127;
const MISFIT: f64 = 1e-3;
/// Ends of an arc by R may be further apart than twice that by this part of R.
const STRETCH: f64 = 1e-3;

impl Arc {
    /// The arc from `from` to `to`, mm; G2 is `clockwise`.
    pub(super) fn through(
        plane: Plane,
        (from, to): (DVec3, DVec3),
        clockwise: bool,
        centre: Centre,
    ) -> Result<Self, ProgramFault> {
        let ((begin, low), (end, high)) = (plane.of(from), plane.of(to));
        let middle = match centre {
            Centre::Words { of, absolute: true } => of,
            Centre::Words { of, absolute: false } => begin + of,
            Centre::Radius(radius) => by_radius(begin, end, radius, clockwise)?,
        };
        let radius = [begin.distance(middle), end.distance(middle)];
        let off = (radius[0] - radius[1]).abs();
        let most = (MISFIT * radius[0].max(radius[1])).clamp(LEAST_MISFIT_MM, 100.0 * LEAST_MISFIT_MM);
        // Not a number agrees with nothing.
        if !(off <= most && radius[0] > 0.0 && radius[1] > 0.0) {
            let absolute = matches!(centre, Centre::Words { of, absolute: false }
                if (begin.distance(of) - end.distance(of)).abs() <= most && begin.distance(of) > 0.0);
            return Err(ProgramFault::Radii { begin_mm: radius[0], end_mm: radius[1], most_mm: most, absolute });
        }
        let angle = |p: DVec2| (p - middle).to_angle();
        let turn = (angle(end) - angle(begin)).rem_euclid(TAU);
        let turn = match (clockwise, turn == 0.0 || begin == end) {
            (true, true) => -TAU,
            (true, false) => turn - TAU,
            (false, true) => TAU,
            (false, false) => turn,
        };
        Ok(Self { plane, centre: middle, radius, angle: [angle(begin), turn], across: [low, high] })
    }

    /// The place at a part of the arc, 0 to 1, mm.
    #[inline]
    pub fn at(&self, part: f64) -> DVec3 {
        let radius = self.radius[0] + part * (self.radius[1] - self.radius[0]);
        let place = self.centre + radius * DVec2::from_angle(self.angle[0] + part * self.angle[1]);
        self.plane.back(place, self.across[0] + part * (self.across[1] - self.across[0]))
    }

    /// How the place changes with the part, mm.
    #[inline]
    pub fn velocity(&self, part: f64) -> DVec3 {
        let grows = self.radius[1] - self.radius[0];
        let out = DVec2::from_angle(self.angle[0] + part * self.angle[1]);
        let turns = (self.radius[0] + part * grows) * self.angle[1];
        self.plane.back(grows * out + turns * out.perp(), self.across[1] - self.across[0])
    }

    /// Its length, mm.
    pub fn length_mm(&self) -> f64 {
        let round = 0.5 * (self.radius[0] + self.radius[1]) * self.angle[1];
        round.hypot(self.across[1] - self.across[0])
    }

    /// How far its chord over a part of it lies off it at most, mm.
    pub fn sagitta_mm(&self, part: f64) -> f64 {
        let radius = self.radius[0].max(self.radius[1]);
        let half = 0.5 * (part * self.angle[1]).abs();
        // A radius that changes adds less than that.
        radius * (1.0 - half.min(std::f64::consts::PI).cos()) + part * (self.radius[1] - self.radius[0]).abs()
    }

    /// Least and greatest corner of its bounds, mm.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let (a, b) = (self.at(0.0), self.at(1.0));
        let (mut low, mut high) = (a.min(b), a.max(b));
        let quarter = 0.25 * TAU;
        let (first, last) = {
            let ends = [self.angle[0], self.angle[0] + self.angle[1]];
            (ends[0].min(ends[1]), ends[0].max(ends[1]))
        };
        let mut k = (first / quarter).ceil();
        while k * quarter <= last {
            let p = self.at((k * quarter - self.angle[0]) / self.angle[1]);
            (low, high) = (low.min(p), high.max(p));
            k += 1.0;
        }
        (low, high)
    }
}

/// The centre of an arc of this radius.
fn by_radius(begin: DVec2, end: DVec2, radius: f64, clockwise: bool) -> Result<DVec2, ProgramFault> {
    let way = end - begin;
    let apart = way.length();
    if apart == 0.0 {
        return Err(ProgramFault::Circle);
    }
    if 0.5 * apart > radius.abs() * (1.0 + STRETCH) {
        return Err(ProgramFault::Radius { radius_mm: radius.abs(), apart_mm: apart });
    }
    let height = (radius * radius - 0.25 * apart * apart).max(0.0).sqrt();
    // The shorter counter-clockwise way has its centre on the left.
    let side = if clockwise == (radius > 0.0) { -1.0 } else { 1.0 };
    Ok(begin + 0.5 * way + side * height * (way / apart).perp())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn arcs_go_the_way_that_their_word_says_in_every_plane() {
        // A quarter about the origin, counter-clockwise as seen from the third axis.
        for (plane, from, to, middle) in [
            (Plane::Xy, DVec3::new(2.0, 0.0, 1.0), DVec3::new(0.0, 2.0, 1.0), DVec3::new(1.0, 1.0, 0.0)),
            (Plane::Zx, DVec3::new(0.0, 1.0, 2.0), DVec3::new(2.0, 1.0, 0.0), DVec3::new(1.0, 0.0, 1.0)),
            (Plane::Yz, DVec3::new(1.0, 2.0, 0.0), DVec3::new(1.0, 0.0, 2.0), DVec3::new(0.0, 1.0, 1.0)),
        ] {
            let (begin, _) = plane.of(from);
            let words = Centre::Words { of: -begin, absolute: false };
            let quarter = Arc::through(plane, (from, to), false, words).unwrap();
            assert!((quarter.angle[1] - FRAC_PI_2).abs() < 1e-15, "{plane:?}");
            assert!(quarter.at(0.0).distance(from) < 1e-15 && quarter.at(1.0).distance(to) < 1e-15);
            let half = quarter.at(0.5);
            assert!(half.dot(middle) > 0.0, "{plane:?}: {half}");
            let rest = Arc::through(plane, (from, to), true, words).unwrap();
            assert!((rest.angle[1] + 3.0 * FRAC_PI_2).abs() < 1e-15 && rest.at(0.5).dot(middle) < 0.0);
            for (radius, length) in [(2.0, quarter.length_mm()), (-2.0, rest.length_mm())] {
                let turned = Arc::through(plane, (from, to), radius < 0.0, Centre::Radius(radius)).unwrap();
                assert!((turned.length_mm() - length).abs() < 1e-12, "{plane:?} by {radius}");
            }
            let e = 1e-6;
            let difference = (rest.at(0.3 + e) - rest.at(0.3 - e)) / (2.0 * e);
            assert!(difference.distance(rest.velocity(0.3)) < 1e-8);
        }
    }

    #[test]
    fn bounds_hold_all_of_an_arc() {
        for k in 0..200 {
            let angle = 0.1 * f64::from(k);
            let (from, turn) = (DVec3::new(angle.cos(), angle.sin(), 0.0), 0.37 * f64::from(k % 17) + 0.01);
            let to = DVec3::new((angle + turn).cos(), (angle + turn).sin(), 1.0);
            let of = -from.truncate();
            let arc = Arc::through(Plane::Xy, (from, to), k % 2 == 0, Centre::Words { of, absolute: false }).unwrap();
            let (low, high) = arc.bounds();
            let places = (0..=1000).map(|i| arc.at(f64::from(i) / 1000.0));
            let (seen_low, seen_high) =
                places.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(a, b), p| (a.min(p), b.max(p)));
            assert!((low - 1e-12).cmple(seen_low).all() && (high + 1e-12).cmpge(seen_high).all());
            assert!((seen_low - low).max_element() < 1e-4 && (high - seen_high).max_element() < 1e-4);
        }
    }

    #[test]
    fn radii_that_disagree_are_refused_with_what_they_are() {
        let ends = (DVec3::ZERO, DVec3::new(10.0, 0.0, 0.0));
        let arc = |centre| Arc::through(Plane::Xy, ends, true, centre);
        let fault = arc(Centre::Words { of: DVec2::new(5.1, 0.0), absolute: false }).unwrap_err();
        assert!(matches!(fault, ProgramFault::Radii { absolute: false, .. }), "{fault}");
        assert!(arc(Centre::Words { of: DVec2::new(5.003, 0.0), absolute: false }).is_ok());
        let far = (DVec3::new(20.0, 0.0, 0.0), DVec3::new(30.0, 0.0, 0.0));
        let words = Centre::Words { of: DVec2::new(25.0, 3.0), absolute: false };
        let fault = Arc::through(Plane::Xy, far, true, words).unwrap_err();
        assert!(fault.to_string().contains("G90.1"), "{fault}");
        assert!(matches!(arc(Centre::Radius(4.9)), Err(ProgramFault::Radius { .. })));
        assert!(arc(Centre::Radius(4.999)).is_ok());
        let nowhere = Arc::through(Plane::Xy, (DVec3::ZERO, DVec3::ZERO), true, Centre::Radius(4.0));
        assert_eq!(nowhere.unwrap_err(), ProgramFault::Circle);
    }
}
