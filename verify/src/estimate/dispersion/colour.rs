//! From wavelengths to colours.

/// The CIE 1931 colour matching functions x, y and z of the standard observer at a wavelength (nm),
/// by the sums of piecewise Gaussians of Wyman, Sloan and Shirley (Simple Analytic Approximations
/// to the CIE XYZ Color Matching Functions, JCGT 2013, table 1).
pub fn colour_matching(wavelength_nm: f64) -> [f64; 3] {
    // Height, place, width below and above it.
    let lobe = |height: f64, at: f64, below: f64, above: f64| {
        let off = (wavelength_nm - at) / if wavelength_nm < at { below } else { above };
        height * (-0.5 * off * off).exp()
    };
    [
        lobe(1.056, 599.8, 37.9, 31.0) + lobe(0.362, 442.0, 16.0, 26.7) + lobe(-0.065, 501.1, 20.4, 26.2),
        lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
        lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8),
    ]
}

/// Linear red, green and blue of CIE's tristimulus values: IEC 61966-2-1.
pub(super) fn linear_rgb([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        3.240_625_5 * x - 1.537_208_0 * y - 0.498_628_6 * z,
        -0.968_930_7 * x + 1.875_756_1 * y + 0.041_517_5 * z,
        0.055_710_1 * x - 0.204_021_1 * y + 1.056_995_9 * z,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::at_worst;

    #[test]
    fn the_matching_functions_are_those_of_the_standard_observer() {
        // CIE 1931, 2 degrees; the fit is good to about 0.02.
        for (nm, wanted) in [
            (450.0, [0.3362, 0.0380, 1.7721]),
            (500.0, [0.0049, 0.3230, 0.2720]),
            (555.0, [0.5121, 1.0000, 0.0057]),
            (600.0, [1.0622, 0.6310, 0.0008]),
            (650.0, [0.2835, 0.1070, 0.0000]),
        ] {
            for (found, wanted) in colour_matching(nm).iter().zip(wanted) {
                at_worst(0.0095, (found - wanted).abs(), format_args!("{nm} nm"));
            }
        }
        // Equal energy has about equal tristimulus values.
        let sums = (380..=780).fold([0.0; 3], |mut sums, nm| {
            sums.iter_mut().zip(colour_matching(f64::from(nm))).for_each(|(sum, v)| *sum += v);
            sums
        });
        at_worst(0.00145, (sums[0] / sums[1] - 1.0).abs(), "x");
        at_worst(8.5e-4, (sums[2] / sums[1] - 1.0).abs(), "z");
    }

    #[test]
    fn the_white_of_srgb_is_that_of_d65() {
        let white = linear_rgb([0.950_47, 1.0, 1.088_83]);
        assert!(white.iter().all(|v| (v - 1.0).abs() < 1e-3), "{white:?}");
    }
}
