//! Circles and ellipses.

use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// Samples of a whole ellipse: what a polygon of them lacks in area is less than a millionth.
const AROUND: f64 = 4096.0;

/// An ellipse in space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Conic {
    pub(super) centre: DVec3,
    pub(super) x: DVec3,
    pub(super) y: DVec3,
    pub(super) semi_axes: DVec2,
}

impl Conic {
    fn at(&self, angle: f64) -> DVec3 {
        let place = DVec2::from_angle(angle) * self.semi_axes;
        self.centre + place.x * self.x + place.y * self.y
    }

    /// Place in the plane of the ellipse, in semi-axes, and height above it.
    pub(super) fn place(&self, at: DVec3) -> (DVec2, f64) {
        let off = at - self.centre;
        (DVec2::new(off.dot(self.x), off.dot(self.y)) / self.semi_axes, off.dot(self.x.cross(self.y)))
    }

    /// Points from one to the other, in the sense of growing angles; all around if they are the
    /// same.
    pub(super) fn samples(&self, from: DVec3, to: DVec3) -> Vec<DVec3> {
        let angle = |at: DVec3| self.place(at).0.to_angle();
        let begin = angle(from);
        let turn = if from == to { TAU } else { (angle(to) - begin).rem_euclid(TAU) };
        // A quarter is a quarter whatever its rounding.
        let n = (turn / TAU * AROUND - 1e-6).ceil().max(1.0);
        (0..=n as usize).map(|k| self.at(begin + turn * k as f64 / n)).collect()
    }

    /// Most that [`samples`](Self::samples) gives.
    pub(super) const MOST: usize = AROUND as usize + 1;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::at_worst;

    #[test]
    fn points_of_an_ellipse_go_from_one_to_the_other_and_all_around() {
        let conic =
            Conic { centre: DVec3::new(1.0, 2.0, 3.0), x: DVec3::Y, y: DVec3::NEG_X, semi_axes: DVec2::new(5.0, 3.0) };
        let quarter = conic.samples(conic.at(1.5 * std::f64::consts::PI), conic.at(0.0));
        assert_eq!(quarter.len(), 1025);
        assert!((quarter[1024] - DVec3::new(1.0, 7.0, 3.0)).length() < 1e-12);
        let all = conic.samples(quarter[0], quarter[0]);
        assert_eq!(all.len(), Conic::MOST);
        let area: f64 = all.windows(2).map(|w| 0.5 * (w[0] - conic.centre).cross(w[1] - conic.centre).z).sum();
        at_worst(3.9e-7, (area / (15.0 * std::f64::consts::PI) - 1.0).abs(), "area");
    }
}
