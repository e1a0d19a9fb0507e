//! Which share of white each of three primaries is.

use glam::{DMat3, DVec2, DVec3};

/// Luminance weights of linear Rec. 709 primaries, as standards round them.
pub(super) const REC_709: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// Bradford's cone responses, by which ICC adapts whites.
const BRADFORD: DMat3 =
    DMat3::from_cols_array(&[0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296]);

/// White of the ICC connection space.
pub(super) const D50: DVec3 = DVec3::new(0.9642, 1.0, 0.8249);

/// Chromaticities (CIE xy) of red, green and blue light, and of the white that they make.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Primaries {
    pub(super) rgb: [DVec2; 3],
    pub(super) white: DVec2,
}

impl Primaries {
    const fn new(rgb: [[f64; 2]; 3], white: [f64; 2]) -> Self {
        let [r, g, b] = rgb;
        Self {
            rgb: [DVec2::new(r[0], r[1]), DVec2::new(g[0], g[1]), DVec2::new(b[0], b[1])],
            white: DVec2::new(white[0], white[1]),
        }
    }

    /// Those that ITU-T H.273 numbers, with their name.
    pub(super) fn coded(number: u8) -> Option<(Self, &'static str)> {
        const D65: [f64; 2] = [0.3127, 0.3290];
        const C: [f64; 2] = [0.310, 0.316];
        let smpte_170 = Self::new([[0.630, 0.340], [0.310, 0.595], [0.155, 0.070]], D65);
        Some(match number {
            1 => (Self::new([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]], D65), "Rec. 709"),
            4 => (Self::new([[0.67, 0.33], [0.21, 0.71], [0.14, 0.08]], C), "System M"),
            5 => (Self::new([[0.64, 0.33], [0.29, 0.60], [0.15, 0.06]], D65), "System B, G"),
            6 | 7 => (smpte_170, "SMPTE 170M"),
            8 => (Self::new([[0.681, 0.319], [0.243, 0.692], [0.145, 0.049]], C), "film"),
            9 => (Self::new([[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]], D65), "Rec. 2020"),
            10 => (Self::new([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]], [1.0 / 3.0; 2]), "CIE XYZ"),
            11 => (Self::new([[0.680, 0.320], [0.265, 0.690], [0.150, 0.060]], [0.314, 0.351]), "DCI P3"),
            12 => (Self::new([[0.680, 0.320], [0.265, 0.690], [0.150, 0.060]], D65), "Display P3"),
            22 => (Self::new([[0.630, 0.340], [0.295, 0.605], [0.155, 0.077]], D65), "EBU 3213"),
            _ => return None,
        })
    }

    /// Luminance of each primary at full, such that white is 1. `None` if these primaries make no
    /// white.
    pub(super) fn weights(&self) -> Option<[f64; 3]> {
        // Tristimulus values of unit x + y + z.
        let xyz = |at: DVec2| DVec3::new(at.x, at.y, 1.0 - at.x - at.y);
        let matrix = DMat3::from_cols(xyz(self.rgb[0]), xyz(self.rgb[1]), xyz(self.rgb[2]));
        if !(matrix.determinant().abs() > 1e-9 && self.white.y > 1e-9) {
            return None;
        }
        let amounts = matrix.inverse() * (xyz(self.white) / self.white.y);
        let weights = [0, 1, 2].map(|k| amounts[k] * self.rgb[k].y);
        weights.iter().all(|weight| weight.is_finite() && (-1e-9..=1.0 + 1e-9).contains(weight)).then_some(weights)
    }
}

/// Takes tristimulus values that were adapted from `white` to D50 back to it.
pub(super) fn from_d50(white: DVec3) -> Option<DMat3> {
    let (there, here) = (BRADFORD * white, BRADFORD * D50);
    let usable = white.is_finite() && there.min_element() > 1e-6;
    usable.then(|| BRADFORD.inverse() * DMat3::from_diagonal(there / here) * BRADFORD)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_those_of_the_standards() {
        for (number, known) in [(1, REC_709), (9, [0.2627, 0.6780, 0.0593]), (12, [0.22897, 0.69174, 0.07929])] {
            let weights = Primaries::coded(number).unwrap().0.weights().unwrap();
            for k in 0..3 {
                assert!((weights[k] - known[k]).abs() < 6e-5, "{number}: {weights:?}");
            }
        }
        assert_eq!(Primaries::coded(10).unwrap().0.weights().unwrap(), [0.0, 1.0, 0.0]);
        let line = Primaries::new([[0.1, 0.1], [0.2, 0.2], [0.3, 0.3]], [0.3, 0.3]);
        assert_eq!(line.weights(), None);
    }

    #[test]
    fn adaptation_takes_d50_to_the_white() {
        let d65 = DVec3::new(0.9505, 1.0, 1.0891);
        assert!((from_d50(d65).unwrap() * D50 - d65).length() < 1e-12);
        assert_eq!(from_d50(DVec3::ZERO), None);
    }
}
