//! Polishing as a low pass, and its inverse as far as it can be had.

use super::HeightField;
use crate::grid::{
    Field,
    dct::{CosineFilter, Symmetry},
};
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use std::f64::consts::PI;

/// A polish that blurs heights like a Gaussian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polish {
    sigma_mm: f64,
    most_gain: f64,
}

/// A polish that nothing can be designed for.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PolishError {
    /// A width out of range.
    #[error("the polish has a standard deviation of {sigma_mm} mm; it must lie between 0 mm and {most_mm} mm")]
    Sigma {
        /// The refused standard deviation, mm.
        sigma_mm: f64,
        /// Greatest accepted one, mm.
        most_mm: f64,
    },
    /// A gain out of range.
    #[error(
        "a gain of {gain} is asked of the inverse of the polish; it must lie between {} and {}",
        Polish::GAIN_LIMITS.0,
        Polish::GAIN_LIMITS.1
    )]
    Gain {
        /// The refused gain.
        gain: f64,
    },
}

impl Polish {
    /// Greatest accepted standard deviation, mm.
    pub const MOST_SIGMA_MM: f64 = 5.0;
    /// Accepted limits of the inverse's gain. Beyond the greater one it is rounding that is
    /// amplified.
    pub const GAIN_LIMITS: (f64, f64) = (1.0, 100.0);
    /// The gain up to which the inverse goes unless it is told otherwise.
    pub const DEFAULT_GAIN: f64 = 6.0;

    /// A polish with a standard deviation, mm, and the default gain of its inverse.
    ///
    /// # Errors
    /// A standard deviation out of range.
    pub fn new(sigma_mm: f64) -> Result<Self, PolishError> {
        if (0.0..=Self::MOST_SIGMA_MM).contains(&sigma_mm) {
            Ok(Self { sigma_mm, most_gain: Self::DEFAULT_GAIN })
        } else {
            Err(PolishError::Sigma { sigma_mm, most_mm: Self::MOST_SIGMA_MM })
        }
    }

    /// The same with another limit of the inverse's gain.
    ///
    /// # Errors
    /// A gain out of range.
    pub fn with_gain(self, most_gain: f64) -> Result<Self, PolishError> {
        if (Self::GAIN_LIMITS.0..=Self::GAIN_LIMITS.1).contains(&most_gain) {
            Ok(Self { most_gain, ..self })
        } else {
            Err(PolishError::Gain { gain: most_gain })
        }
    }

    /// Standard deviation, mm.
    pub fn sigma_mm(&self) -> f64 {
        self.sigma_mm
    }

    /// The most by which the inverse amplifies any wave.
    pub fn most_gain(&self) -> f64 {
        self.most_gain
    }

    /// The wave that the inverse amplifies most, mm. Shorter ones are given up: they are damped by
    /// the polish and not restored.
    pub fn shortest_wave_mm(&self) -> f64 {
        // There the Gaussian has the value of the noise.
        PI * self.sigma_mm * (2.0 / (1.0 / self.noise()).ln()).sqrt()
    }

    /// The noise-to-signal amplitude of Wiener's filter: its gain is at most `(1 + noise^2) / (2
    /// noise)`.
    fn noise(&self) -> f64 {
        self.most_gain - (self.most_gain * self.most_gain - 1.0).max(0.0).sqrt()
    }

    /// The face after the polish.
    ///
    /// Beyond the border the face goes on with the slope that it has there, so that a tilted plane
    /// stays what it is: pads that roll over the edge are not modelled.
    pub fn polished(&self, surface: &HeightField) -> HeightField {
        self.filter(surface, |gauss| gauss)
    }

    /// The face that the polish turns into `surface`, as far as the gain allows: Wiener's inverse
    /// of the Gaussian, normalised so that slow waves pass unchanged.
    pub fn presharpened(&self, surface: &HeightField) -> HeightField {
        let square = self.noise() * self.noise();
        self.filter(surface, |gauss| (1.0 + square) * gauss / (gauss * gauss + square))
    }

    /// Multiplies every wave by `response` of what the Gaussian leaves of it.
    fn filter(&self, surface: &HeightField, response: impl Fn(f64) -> f64 + Sync) -> HeightField {
        if self.sigma_mm == 0.0 {
            return surface.clone();
        }
        let heights = surface.heights_mm();
        let (nx, ny) = (heights.nx(), heights.ny());
        let spacing = surface.extent().node_spacing(nx, ny);
        let pad = |step: f64, nodes: usize| ((REACH * self.sigma_mm / step).ceil() as usize + 32).min(nodes - 1);
        let (px, py) = (pad(spacing.x, nx), pad(spacing.y, ny));
        let window = |step: f64, nodes: usize| ((WINDOW * self.sigma_mm / step).ceil() as usize).max(6).min(nodes);
        let mut padded = extend(heights, (px, py), (window(spacing.x, nx), window(spacing.y, ny)));
        let (wide, high) = (padded.nx(), padded.ny());
        let gauss = |nodes: usize, step: f64| -> Vec<f64> {
            let wave = |k: usize| PI * k as f64 / ((nodes - 1) as f64 * step);
            (0..nodes).map(|k| (-0.5 * (self.sigma_mm * wave(k)).powi(2)).exp()).collect()
        };
        let (along_x, along_y) = (gauss(wide, spacing.x), gauss(high, spacing.y));
        CosineFilter::new(Symmetry::Nodes, wide, high).apply(&mut padded, |kx, ky| response(along_x[kx] * along_y[ky]));
        let mut data = vec![0.0; nx * ny];
        data.par_chunks_mut(nx).enumerate().for_each(|(j, row)| row.copy_from_slice(&padded.row(j + py)[px..px + nx]));
        surface.with_heights(Field::from_vec(nx, ny, data))
    }
}

/// How far the border is continued, in standard deviations: the tails of Gaussian and inverse are
/// below rounding there.
const REACH: f64 = 10.0;
/// From how far inside the slope at the border is taken, in standard deviations.
const WINDOW: f64 = 8.0;

/// Continues a field beyond its border, along x and then along y: its own mirror image, sheared
/// such that it goes on with the slope that it has there.
fn extend(field: &Field<f64>, pads: (usize, usize), windows: (usize, usize)) -> Field<f64> {
    let ((px, py), (nx, ny)) = (pads, (field.nx(), field.ny()));
    let wide = nx + 2 * px;
    let mut data = vec![0.0; wide * (ny + 2 * py)];
    let weights = border_slope(windows.0);
    data[py * wide..(py + ny) * wide].par_chunks_mut(wide).enumerate().for_each(|(j, out)| {
        let row = field.row(j);
        out[px..px + nx].copy_from_slice(row);
        let first: f64 = weights.iter().enumerate().map(|(k, w)| w * row[k]).sum();
        let last: f64 = weights.iter().enumerate().map(|(k, w)| w * row[nx - 1 - k]).sum();
        for k in 1..=px {
            out[px - k] = row[k] - 2.0 * k as f64 * first;
            out[px + nx - 1 + k] = row[nx - 1 - k] - 2.0 * k as f64 * last;
        }
    });
    let weights = border_slope(windows.1);
    let (begin, end) = (py, py + ny - 1);
    let slope = |row: &dyn Fn(usize) -> usize| -> Vec<f64> {
        (0..wide).map(|i| weights.iter().enumerate().map(|(k, w)| w * data[row(k) * wide + i]).sum()).collect()
    };
    let (first, last) = (slope(&|k| begin + k), slope(&|k| end - k));
    for k in 1..=py {
        for i in 0..wide {
            data[(begin - k) * wide + i] = data[(begin + k) * wide + i] - 2.0 * k as f64 * first[i];
            data[(end + k) * wide + i] = data[(end - k) * wide + i] - 2.0 * k as f64 * last[i];
        }
    }
    Field::from_vec(wide, ny + 2 * py, data)
}

/// Weights of the first values of a sequence that give its slope at the first: that of the parabola
/// fitted to them, the nearer the heavier. Single values, which may be those of scallops, do not
/// matter.
fn border_slope(window: usize) -> Vec<f64> {
    let near = |k: usize| (0.5 * PI * k as f64 / window as f64).cos().powi(2);
    let basis = |k: usize| {
        let t = k as f64 / window as f64;
        DVec3::new(1.0, t, t * t)
    };
    let normal = (0..window).fold(DMat3::ZERO, |sum, k| {
        let b = basis(k);
        sum + DMat3::from_cols(b * b.x, b * b.y, b * b.z) * near(k)
    });
    let functional = normal.inverse().row(1) / window as f64;
    (0..window).map(|k| near(k) * functional.dot(basis(k))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Extent;
    use crate::measured::at_worst;
    use glam::DVec2;

    const BLOCK: Extent = Extent::new(20.0, 16.0);

    fn face(nx: usize, ny: usize, f: impl Fn(DVec2) -> f64) -> HeightField {
        HeightField::new(BLOCK, Field::from_fn(nx, ny, |i, j| f(BLOCK.node(i, j, nx, ny))))
    }

    #[test]
    fn planes_stay_and_waves_are_damped_as_a_gaussian_damps_them() {
        let plane = face(161, 129, |p| 0.3 * p.x - 0.1 * p.y);
        let polish = Polish::new(0.4).unwrap();
        for (a, b) in polish.polished(&plane).heights_mm().as_slice().iter().zip(plane.heights_mm().as_slice()) {
            assert!((a - b).abs() < 1e-12);
        }
        // On unequal spacings, far from the border.
        let wave = |p: DVec2| (2.0 * p.x + 1.5 * p.y).cos();
        let (before, after) = (face(201, 97, wave), polish.polished(&face(201, 97, wave)));
        let left = (-0.5 * 0.16 * 6.25_f64).exp();
        let mean = |surface: &HeightField| surface.heights_mm()[(100, 48)] - surface.heights_mm()[(100 + 25, 48)];
        assert!((mean(&after) - left * mean(&before)).abs() < 1e-13, "{} {}", mean(&after), mean(&before));
    }

    #[test]
    fn two_polishes_are_one_of_the_summed_variance() {
        let face = face(81, 65, |p| (1.3 * p.x).sin() * (0.8 * p.y).cos());
        let once = Polish::new(0.5).unwrap().polished(&face);
        let twice = Polish::new(0.4).unwrap().polished(&Polish::new(0.3).unwrap().polished(&face));
        for j in 20..45 {
            for i in 20..61 {
                at_worst(
                    3.6e-10,
                    (once.heights_mm()[(i, j)] - twice.heights_mm()[(i, j)]).abs(),
                    format_args!("({i}, {j})"),
                );
            }
        }
    }

    #[test]
    fn the_inverse_undoes_the_polish_and_keeps_to_its_gain() {
        let polish = Polish::new(0.2).unwrap();
        // A wave of 3 mm: the polish leaves 0.916 of it.
        let slow = face(201, 161, |p| (2.0 * PI / 3.0 * p.x).sin());
        let restored = polish.polished(&polish.presharpened(&slow));
        for i in 60..140 {
            at_worst(0.00133, (restored.heights_mm()[(i, 80)] - slow.heights_mm()[(i, 80)]).abs(), format_args!("{i}"));
        }
        for gain in [2.0, 6.0, 20.0] {
            let polish = polish.with_gain(gain).unwrap();
            let most = (0..4000)
                .map(|k| (-f64::from(k) * 0.005).exp())
                .map(|g| (1.0 + polish.noise().powi(2)) * g / (g * g + polish.noise().powi(2)))
                .fold(0.0, f64::max);
            at_worst(2.2e-6, (most - gain).abs() / gain, format_args!("{most} for {gain}"));
            let wave = 2.0 * PI / polish.shortest_wave_mm();
            assert!(((-0.5 * (0.2 * wave).powi(2)).exp() - polish.noise()).abs() < 1e-9);
        }
    }

    #[test]
    fn what_cannot_be_polished_is_refused() {
        for sigma in [-0.1, f64::NAN, 6.0] {
            assert!(matches!(Polish::new(sigma), Err(PolishError::Sigma { .. })));
        }
        assert!(Polish::new(0.1).unwrap().with_gain(0.5).is_err());
    }
}
