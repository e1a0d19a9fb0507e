//! PhotonAgreement of caustics, with the renderer's noise taken from two runs.

use crate::image::Image;

/// PhotonAgreement at one number of pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ImageLevel {
    /// Pixels across the whole window.
    pub pixels: usize,
    /// Relative RMS difference between one run of the renderer and the verifier.
    pub rel_rms: f64,
    /// Relative RMS noise of one run: the difference of the two, over the square root of 2. What
    /// both runs have in common (blur, a lattice) is not in it.
    pub noise: f64,
    /// The difference without the noise: the root of the mean product of both runs' differences, 0
    /// where that is negative.
    pub without_noise: f64,
}

/// PhotonAgreement of a renderer's caustic with the verifier's.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ImageAgreement {
    /// At an eighth, a quarter, half of the pixels, and all.
    pub levels: Vec<ImageLevel>,
    /// Black pixels of the renderer where the verifier finds light, in either run. They are left
    /// out.
    pub black: usize,
    /// Pixels that were compared, with those.
    pub pixels: usize,
}

/// The outermost part of the window on each side that is not compared: photon maps are dark along
/// borders.
const BORDER: f64 = 0.05;
/// Sizes of averaged pixels.
const BINNING: [usize; 4] = [8, 4, 2, 1];

impl ImageAgreement {
    /// Compares both runs with the verifier's image, all normalised to the mean 1 over what is
    /// compared. Also gives the mean of the runs, in the verifier's scale. Nothing if there is no
    /// light.
    pub(super) fn between(ours: &Image, runs: &[Image]) -> Option<(Self, Image)> {
        let [a, b] = runs else { return None };
        let (nx, ny) = (ours.nx, ours.ny);
        let largest = BINNING[0];
        let border = |n: usize| ((BORDER * n as f64 / largest as f64).round() as usize).max(1) * largest;
        let (bx, by) = (border(nx), border(ny));
        let (columns, rows) =
            (nx.checked_sub(2 * bx)? / largest * largest, ny.checked_sub(2 * by)? / largest * largest);
        let inner = |image: &Image| -> Vec<f64> {
            (by..by + rows).flat_map(|j| image.values[j * nx + bx..j * nx + bx + columns].iter().copied()).collect()
        };
        let mut images = [inner(ours), inner(a), inner(b)];
        let lit: Vec<bool> =
            (0..columns * rows).map(|k| images[0][k] <= 0.0 || (images[1][k] > 0.0 && images[2][k] > 0.0)).collect();
        let count = lit.iter().filter(|&&lit| lit).count();
        let mut means = [0.0; 3];
        for (image, mean) in images.iter_mut().zip(&mut means) {
            *mean = image.iter().zip(&lit).filter(|(_, lit)| **lit).map(|(v, _)| v).sum::<f64>() / count as f64;
            if !(mean.is_finite() && *mean > 0.0) {
                return None;
            }
            image.iter_mut().for_each(|v| *v /= *mean);
        }
        let levels = BINNING.map(|size| level(&images, &lit, columns, rows, size, nx / size)).to_vec();
        let scaled = |k: usize| 0.5 * means[0] * (a.values[k] / means[1] + b.values[k] / means[2]);
        let mean = Image::new(nx, ny, (0..nx * ny).map(scaled).collect());
        Some((Self { levels, black: columns * rows - count, pixels: columns * rows }, mean))
    }
}

fn level(images: &[Vec<f64>; 3], lit: &[bool], columns: usize, rows: usize, size: usize, pixels: usize) -> ImageLevel {
    let (mut square, mut spread, mut product, mut n) = (0.0, 0.0, 0.0, 0.0);
    for j in 0..rows / size {
        for i in 0..columns / size {
            let mut sums = [0.0; 3];
            let mut weight = 0.0;
            for k in (0..size * size).map(|s| (j * size + s / size) * columns + i * size + s % size) {
                if lit[k] {
                    weight += 1.0;
                    sums.iter_mut().zip(images).for_each(|(sum, image)| *sum += image[k]);
                }
            }
            if weight > 0.0 {
                let [ours, a, b] = sums.map(|sum| sum / weight);
                square += 0.5 * ((a - ours).powi(2) + (b - ours).powi(2));
                spread += (a - b).powi(2);
                product += (a - ours) * (b - ours);
                n += 1.0;
            }
        }
    }
    ImageLevel {
        pixels,
        rel_rms: (square / n).sqrt(),
        noise: (0.5 * spread / n).sqrt(),
        without_noise: (product / n).max(0.0).sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::at_worst;

    /// Uniform noise of unit variance, by a linear congruence.
    fn noise(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 11) as f64 / (1u64 << 53) as f64 - 0.5) * 12f64.sqrt()
        }
    }

    #[test]
    fn the_noise_of_two_runs_is_told_from_what_they_share() {
        let (nx, ny) = (256, 192);
        let shared = |k: usize| 0.03 * if (k % nx / 32 + k / nx / 32).is_multiple_of(2) { 1.0 } else { -1.0 };
        let ours = Image::new(nx, ny, vec![2.0; nx * ny]);
        let run = |seed| {
            let mut noise = noise(seed);
            // Another scale, which is normalised away.
            Image::new(nx, ny, (0..nx * ny).map(|k| 5.0 * (1.0 + shared(k) + 0.1 * noise())).collect())
        };
        let (agreement, mean) = ImageAgreement::between(&ours, &[run(1), run(2)]).unwrap();
        assert_eq!((agreement.black, agreement.levels.len()), (0, 4));
        for (level, size) in agreement.levels.iter().zip(BINNING) {
            // Averaging over size^2 pixels takes out so much noise, and nothing of what is shared:
            // 32 is a multiple.
            let expected = 0.1 / size as f64;
            at_worst(0.0356, (level.noise / expected - 1.0).abs(), format_args!("noise of {level:?}"));
            at_worst(4.4e-4, (level.without_noise - 0.03).abs(), format_args!("{level:?} without noise"));
            at_worst(3.8e-4, (level.rel_rms - expected.hypot(0.03)).abs(), format_args!("{level:?}"));
        }
        at_worst(3.4e-4, (mean.mean() - 2.0).abs(), "mean");
    }

    #[test]
    fn black_pixels_are_left_out_and_counted() {
        let flat = |value: f64| Image::new(128, 128, vec![value; 128 * 128]);
        let mut run = flat(1.0);
        (0..50).for_each(|k| run.values[(40 + k) * 128 + 60] = 0.0);
        let (agreement, _) = ImageAgreement::between(&flat(3.0), &[run, flat(1.0)]).unwrap();
        assert_eq!(agreement.black, 50);
        assert!(agreement.levels.iter().all(|level| level.rel_rms < 1e-12), "{agreement:?}");
        assert!(ImageAgreement::between(&flat(1.0), &[flat(0.0), flat(0.0)]).is_none());
    }
}
