//! Tone curves: how a number between 0 and 1 becomes light.

/// How a number between 0 and 1 becomes light.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Tone {
    Linear,
    /// IEC 61966-2-1.
    Srgb,
    /// The inverse of the camera curve of Rec. 709, 601 and 2020.
    Rec709,
    Power(f64),
    /// ICC's `para`: `(a v + b)^g + e` from `d` on, `c v + f` below.
    Parametric {
        g: f64,
        a: f64,
        b: f64,
        c: f64,
        d: f64,
        e: f64,
        f: f64,
    },
    /// Equally spaced samples from 0 to 1, at least two.
    Sampled(Vec<f64>),
}

impl Tone {
    pub(super) fn light(&self, v: f64) -> f64 {
        match self {
            Self::Linear => v,
            Self::Srgb => srgb_to_light(v),
            Self::Rec709 => {
                const ALPHA: f64 = 1.099_296_826_809_44;
                const BETA: f64 = 0.018_053_968_510_807;
                if v < 4.5 * BETA { v / 4.5 } else { ((v + ALPHA - 1.0) / ALPHA).powf(1.0 / 0.45) }
            }
            Self::Power(gamma) => v.max(0.0).powf(*gamma),
            Self::Parametric { g, a, b, c, d, e, f } => {
                if v >= *d {
                    (a * v + b).max(0.0).powf(*g) + e
                } else {
                    c * v + f
                }
            }
            Self::Sampled(samples) => sampled(samples, v),
        }
    }
}

/// Linear interpolation between equally spaced samples.
pub(super) fn sampled(samples: &[f64], v: f64) -> f64 {
    let last = samples.len() - 1;
    let at = v.clamp(0.0, 1.0) * last as f64;
    let k = (at as usize).min(last.saturating_sub(1));
    let part = at - k as f64;
    samples[k] + part * (samples[(k + 1).min(last)] - samples[k])
}

/// The curve of sRGB.
pub(super) fn srgb_to_light(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// Its inverse.
pub(super) fn light_to_srgb(light: f64) -> f64 {
    if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_those_of_their_standards() {
        // IEC 61966-2-1, ITU-R BT.709: middle grey, and where the parts meet.
        for (tone, v, light) in [
            (Tone::Srgb, 0.5, 0.214_041_14),
            (Tone::Srgb, 0.04045, 0.003_130_804_9),
            (Tone::Rec709, 0.5, 0.259_719_4),
            (Tone::Rec709, 0.081, 0.018),
            (Tone::Power(2.2), 0.5, 0.217_637_64),
        ] {
            assert!((tone.light(v) - light).abs() < 2e-5, "{tone:?} of {v}: {}", tone.light(v));
            assert!((tone.light(1.0) - 1.0).abs() < 1e-12);
        }
        for light in [0.0, 1e-4, 0.01, 0.3, 1.0] {
            assert!((srgb_to_light(light_to_srgb(light)) - light).abs() < 1e-7);
        }
        assert_eq!(sampled(&[0.0, 0.25, 1.0], 0.75), 0.625);
    }
}
