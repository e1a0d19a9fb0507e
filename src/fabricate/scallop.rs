//! The scallops between rows, in closed form.

use super::Cutter;

/// The ridges that a cutter leaves between its rows on a gentle face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scallop {
    /// From row to row, mm.
    pub step_over_mm: f64,
    /// Height of the ridges, mm: `r - sqrt(r^2 - s^2 / 4)`, nearly `s^2 / (8 r)`.
    pub height_mm: f64,
    /// Greatest slope, at the ridges: `s / (2 r)` as long as that is small.
    pub slope: f64,
}

impl Scallop {
    /// Of a cutter at a step-over, mm. The corner counts, which is what cuts on a slope. `None` for
    /// a flat end mill, which leaves steps instead, and beyond a step-over of twice the corner
    /// radius.
    pub fn of(cutter: Cutter, step_over_mm: f64) -> Option<Self> {
        let (radius, half) = (cutter.corner_mm(), 0.5 * step_over_mm);
        let square = radius * radius - half * half;
        (square > 0.0 && step_over_mm > 0.0).then(|| Self {
            step_over_mm,
            // Without the difference of nearly equal numbers.
            height_mm: half * half / (radius + square.sqrt()),
            slope: half / square.sqrt(),
        })
    }

    /// The scallops that a polish of this standard deviation (mm) leaves: their first harmonic,
    /// whose amplitude for parabolas is `4 / pi^2` of their height, damped by `exp(-2 pi^2 sigma^2
    /// / s^2)`.
    pub fn polished(self, sigma_mm: f64) -> Self {
        if sigma_mm <= 0.0 {
            return self;
        }
        let pi = std::f64::consts::PI;
        let left = (-2.0 * (pi * sigma_mm / self.step_over_mm).powi(2)).exp();
        let height_mm = (8.0 / (pi * pi) * left).min(1.0) * self.height_mm;
        let slope = (pi * height_mm / self.step_over_mm).min(self.slope);
        Self { step_over_mm: self.step_over_mm, height_mm, slope }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::within_tenth_of;

    #[test]
    fn known_cutters_leave_known_scallops() {
        // Radius, step-over, height in um, slope.
        for (radius, step_over, height, slope) in [
            (3.0, 0.25, 2.6, 0.0417),
            (3.0, 0.1, 0.417, 0.0167),
            (6.0, 0.05, 0.0521, 0.00417),
            (12.7, 0.05, 0.0246, 0.00197),
        ] {
            let scallop = Scallop::of(Cutter::ball(radius).unwrap(), step_over).unwrap();
            assert!((1e3 * scallop.height_mm - height).abs() < 5e-3 * height, "{scallop:?}");
            assert!((scallop.slope - slope).abs() < 5e-3 * slope, "{scallop:?}");
        }
        assert_eq!(Scallop::of(Cutter::flat(3.0).unwrap(), 0.1), None);
        assert_eq!(Scallop::of(Cutter::ball(3.0).unwrap(), 6.0), None);
    }

    #[test]
    fn polish_takes_scallops_away() {
        let scallop = Scallop::of(Cutter::ball(3.0).unwrap(), 0.1).unwrap();
        let polished = scallop.polished(0.05);
        // exp(-pi^2 / 2) is 0.0072.
        within_tenth_of(0.0058, polished.height_mm / scallop.height_mm, "height");
        within_tenth_of(0.0046, polished.slope / scallop.slope, "slope");
        assert_eq!(scallop.polished(0.0), scallop);
    }
}
