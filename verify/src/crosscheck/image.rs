//! Agreement of caustics, with the renderer's noise taken from two runs.

use crate::film::Image;

/// Agreement at one number of pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageLevel {
    /// Pixels across the whole window.
    pub pixels: usize,
    /// Relative RMS difference between one run of the renderer and the verifier.
    pub rel_rms: f64,
    /// Relative RMS noise of one run: the difference of the two, over the square root of 2. What both runs have in common
    /// (blur, a lattice) is not in it.
    pub noise: f64,
    /// The difference without the noise: the root of the mean product of both runs' differences, 0 where that is negative.
    pub without_noise: f64,
}

/// Agreement of a renderer's caustic with the verifier's.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageAgreement {
    /// At an eighth, a quarter, half of the pixels, and all.
    pub levels: Vec<ImageLevel>,
    /// Black pixels of the renderer where the verifier finds light, in either run. They are left out.
    pub black: usize,
    /// Pixels that were compared, with those.
    pub pixels: usize,
}

/// The outermost part of the window on each side that is not compared: photon maps are dark along borders.
const BORDER: f64 = 0.05;
/// Sizes of averaged pixels.
const BINNING: [usize; 4] = [8, 4, 2, 1];

impl ImageAgreement {
    /// Compares both runs with the verifier's image, all normalised to the mean 1 over what is compared. Also gives the
    /// mean of the runs, in the verifier's scale. Nothing if there is no light.
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
