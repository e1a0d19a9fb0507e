//! What the numbers of a pixel are, and the curves from them to light.

use super::Transfer;

/// What the numbers of a pixel are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Model {
    Grey,
    Rgb,
    /// Shares of ink: 0 is paper.
    Cmyk,
}

impl Model {
    /// Numbers per pixel.
    pub(super) fn channels(self) -> usize {
        match self {
            Self::Grey => 1,
            Self::Rgb => 3,
            Self::Cmyk => 4,
        }
    }
}

/// Light of an encoded value, both 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Curve {
    Transfer(Transfer),
    Power(f64),
    /// The inverse of the camera's curve of Rec. 709.
    Rec709,
    /// CIE 1976.
    Lightness,
    Sampled(Vec<f64>),
    /// g, a, b, c, d, e, f of ICC: (a v + b)^g + e from d on, c v + f below.
    Parametric([f64; 7]),
}

impl Curve {
    pub(super) fn light(&self, value: f64) -> f64 {
        match self {
            Self::Transfer(transfer) => transfer.to_linear(value),
            Self::Power(exponent) => value.powf(*exponent),
            Self::Rec709 => {
                const ALPHA: f64 = 1.099_296_826_809_44;
                const BETA: f64 = 0.018_053_968_510_807;
                if value < 4.5 * BETA { value / 4.5 } else { ((value + ALPHA - 1.0) / ALPHA).powf(1.0 / 0.45) }
            }
            Self::Lightness => {
                let l = 100.0 * value;
                if l <= 8.0 { l.max(0.0) * 27.0 / 24389.0 } else { ((l + 16.0) / 116.0).powi(3) }
            }
            Self::Sampled(values) => {
                let at = value.clamp(0.0, 1.0) * (values.len() - 1) as f64;
                let k = (at as usize).min(values.len() - 2);
                values[k] + (at - k as f64) * (values[k + 1] - values[k])
            }
            Self::Parametric([g, a, b, c, d, e, f]) => {
                if value < *d {
                    c * value + f
                } else {
                    (a * value + b).max(0.0).powf(*g) + e
                }
            }
        }
    }
}
