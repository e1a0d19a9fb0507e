//! How well an image agrees with its target.

use crate::film::Image;

/// Measures of agreement. Both images are first divided by their means: only the distribution of light is judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metrics {
    /// Root of the mean square difference; the mean of both images is 1.
    pub rel_rms: f64,
    /// Mean of the absolute difference.
    pub mean_abs: f64,
    /// Peak signal-to-noise ratio, dB: the peak is the target's greatest value. Infinite for equal images.
    pub psnr_db: f64,
    /// Structural similarity (Wang et al. 2004) with a uniform window of 7 x 7, sample covariance, the target's greatest
    /// value as data range, averaged without a border of 3 pixels: scikit-image's default.
    pub ssim: f64,
    /// Pearson's correlation coefficient; NaN if an image is constant.
    pub correlation: f64,
    /// Gain of the least-squares fit image = gain * target + offset: the contrast that arrives.
    pub fit_gain: f64,
    /// Offset of that fit: stray light.
    pub fit_offset: f64,
    /// Mean of the image where the target is darkest (the least twentieth of the pixels).
    pub black_level: f64,
    /// Mean of the target there.
    pub target_black_level: f64,
    /// Mean of the image where the target is brightest (the greatest twentieth) divided by `black_level`.
    pub contrast: f64,
    /// The same for the target; infinite for true black.
    pub target_contrast: f64,
}

/// Why two images cannot be compared.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MetricsError {
    /// Different sizes.
    #[error("the image has {} x {} pixels and the target {} x {}", .image.0, .image.1, .target.0, .target.1)]
    Size {
        /// Of the image.
        image: (usize, usize),
        /// Of the target.
        target: (usize, usize),
    },
    /// Too small for the window of SSIM.
    #[error("the images have {nx} x {ny} pixels; at least {WINDOW} x {WINDOW} are needed")]
    TooSmall {
        /// Columns.
        nx: usize,
        /// Rows.
        ny: usize,
    },
    /// Cannot be normalised.
    #[error("the mean of the {which} is {mean}; it must be positive and finite")]
    Dark {
        /// "image" or "target".
        which: &'static str,
        /// Its mean.
        mean: f64,
    },
}

/// Width of SSIM's window, pixels.
const WINDOW: usize = 7;

/// Compares an image with its target, both of any positive scale.
///
/// # Errors
/// Sizes that differ or are below 7 x 7, or an image without light.
pub fn compare(image: &Image, target: &Image) -> Result<Metrics, MetricsError> {
    let (nx, ny) = (target.nx, target.ny);
    if (image.nx, image.ny) != (nx, ny) {
        return Err(MetricsError::Size { image: (image.nx, image.ny), target: (nx, ny) });
    }
    if nx.min(ny) < WINDOW {
        return Err(MetricsError::TooSmall { nx, ny });
    }
    let normalised = |image: &Image, which| {
        let mean = image.mean();
        if !(mean.is_finite() && mean > 0.0) {
            return Err(MetricsError::Dark { which, mean });
        }
        Ok(image.values.iter().map(|v| v / mean).collect::<Vec<f64>>())
    };
    let (s, t) = (normalised(image, "image")?, normalised(target, "target")?);
    let n = s.len() as f64;
    let mean = |f: &dyn Fn(f64, f64) -> f64| {
        s.chunks(nx).zip(t.chunks(nx)).map(|(s, t)| s.iter().zip(t).map(|(&s, &t)| f(s, t)).sum::<f64>()).sum::<f64>()
            / n
    };
    let mean_square = mean(&|s, t| (s - t) * (s - t));
    let peak = t.iter().copied().fold(0.0, f64::max);
    // Both means are 1.
    let (ss, tt, st) =
        (mean(&|s, _| (s - 1.0).powi(2)), mean(&|_, t| (t - 1.0).powi(2)), mean(&|s, t| (s - 1.0) * (t - 1.0)));
    let fit_gain = if tt > 0.0 { st / tt } else { 0.0 };
    let [(black_level, target_black_level), (white, target_white)] = extremes(&s, &t);
    Ok(Metrics {
        rel_rms: mean_square.sqrt(),
        mean_abs: mean(&|s, t| (s - t).abs()),
        psnr_db: 10.0 * (peak * peak / mean_square).log10(),
        ssim: ssim(&s, &t, nx, ny, peak),
        correlation: st / (ss * tt).sqrt(),
        fit_gain,
        fit_offset: 1.0 - fit_gain,
        black_level,
        target_black_level,
        contrast: white / black_level,
        target_contrast: target_white / target_black_level,
    })
}

/// Means of image and target over the darkest and the brightest twentieth of the target's pixels. All pixels of the
/// limiting value count, so that the order of equal pixels does not matter.
fn extremes(s: &[f64], t: &[f64]) -> [(f64, f64); 2] {
    let mut sorted = t.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let count = t.len().div_ceil(20);
    let (dark, bright) = (sorted[count - 1], sorted[t.len() - count]);
    let over = |belongs: &dyn Fn(f64) -> bool| {
        let (mut a, mut b, mut n) = (0.0, 0.0, 0.0);
        for (&s, &t) in s.iter().zip(t).filter(|&(_, &t)| belongs(t)) {
            (a, b, n) = (a + s, b + t, n + 1.0);
        }
        (a / n, b / n)
    };
    [over(&|t| t <= dark), over(&|t| t >= bright)]
}

/// Structural similarity, averaged over all windows that lie inside of the image.
fn ssim(s: &[f64], t: &[f64], nx: usize, ny: usize, range: f64) -> f64 {
    let area = (WINDOW * WINDOW) as f64;
    let sample = area / (area - 1.0);
    let (c1, c2) = ((0.01 * range).powi(2), (0.03 * range).powi(2));
    let width = nx - WINDOW + 1;
    // Sums along rows once for every row; a window adds up seven of them.
    let row_sums = |j: usize| -> Vec<[f64; 5]> {
        let (s, t) = (&s[j * nx..(j + 1) * nx], &t[j * nx..(j + 1) * nx]);
        (0..width)
            .map(|i| {
                let mut sum = [0.0; 5];
                for (&s, &t) in s[i..i + WINDOW].iter().zip(&t[i..i + WINDOW]) {
                    for (a, b) in sum.iter_mut().zip([s, t, s * s, t * t, s * t]) {
                        *a += b;
                    }
                }
                sum
            })
            .collect()
    };
    let rows: Vec<_> = (0..ny).map(row_sums).collect();
    let mut total = 0.0;
    for window in rows.windows(WINDOW) {
        let mut of_row = 0.0;
        for i in 0..width {
            let mut m = [0.0; 5];
            for row in window {
                m.iter_mut().zip(row[i]).for_each(|(a, b)| *a += b);
            }
            let [ms, mt, mss, mtt, mst] = m.map(|v| v / area);
            let (vs, vt, vst) = (sample * (mss - ms * ms), sample * (mtt - mt * mt), sample * (mst - ms * mt));
            of_row += (2.0 * ms * mt + c1) * (2.0 * vst + c2) / ((ms * ms + mt * mt + c1) * (vs + vt + c2));
        }
        total += of_row;
    }
    total / (width * (ny - WINDOW + 1)) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The fixed pair: t = 0.6 + 0.5 sin(0.37 c) cos(0.23 r) + 0.3 ((7 c + 3 r) mod 5 == 0),
    /// s = t shifted by half a column in the sine, + 0.05 sin(1.7 c + 0.9 r).
    fn pair(nx: usize, ny: usize) -> (Image, Image) {
        let make = |f: &dyn Fn(f64, f64) -> f64| {
            Image::new(nx, ny, (0..nx * ny).map(|k| f((k % nx) as f64, (k / nx) as f64)).collect())
        };
        let dot = |c: f64, r: f64| if (7.0 * c + 3.0 * r) % 5.0 == 0.0 { 0.3 } else { 0.0 };
        let target = make(&|c, r| 0.6 + 0.5 * (0.37 * c).sin() * (0.23 * r).cos() + dot(c, r));
        let image = make(&|c, r| {
            0.6 + 0.5 * (0.37 * (c + 0.5)).sin() * (0.23 * r).cos() + dot(c, r) + 0.05 * (1.7 * c + 0.9 * r).sin()
        });
        (image, target)
    }

    #[test]
    fn the_numbers_are_those_of_scikit_image() {
        // s, t divided by their means, peak = t.max():
        //   structural_similarity(t, s, data_range=peak), peak_signal_noise_ratio(t, s, data_range=peak),
        //   sqrt(mean((s - t)^2)), mean(|s - t|), corrcoef, polyfit; scikit-image 0.26, NumPy.
        let cases = [
            (
                7,
                7,
                0.06344137147583068,
                0.04983289183045218,
                27.67914735541597,
                0.9546342055345799,
                0.9562665940812908,
                0.8866995236030439,
            ),
            (
                33,
                20,
                0.08951752008373319,
                0.07327385453341857,
                27.45599433887929,
                0.9706670095132549,
                0.9792288860386941,
                0.988597235236125,
            ),
            (
                64,
                48,
                0.08890742421427861,
                0.07275480828469523,
                27.568015181156657,
                0.9711776049943504,
                0.978241432326367,
                0.9920096254122932,
            ),
        ];
        for (nx, ny, rel_rms, mean_abs, psnr, ssim, correlation, gain) in cases {
            let (image, target) = pair(nx, ny);
            let m = compare(&image, &target).unwrap();
            for (ours, theirs) in [
                (m.rel_rms, rel_rms),
                (m.mean_abs, mean_abs),
                (m.psnr_db, psnr),
                (m.ssim, ssim),
                (m.correlation, correlation),
                (m.fit_gain, gain),
            ] {
                assert!((ours - theirs).abs() < 1e-11 * theirs.abs().max(1.0), "{nx} x {ny}: {ours} for {theirs}");
            }
        }
    }

    #[test]
    fn scale_does_not_matter_and_equal_images_agree() {
        let (image, target) = pair(20, 16);
        let bright = Image::new(20, 16, image.values.iter().map(|v| 37.0 * v).collect());
        let (a, b) = (compare(&image, &target).unwrap(), compare(&bright, &target).unwrap());
        assert!((a.rel_rms - b.rel_rms).abs() < 1e-14 && (a.ssim - b.ssim).abs() < 1e-13);
        let same = compare(&target, &target).unwrap();
        assert_eq!((same.rel_rms, same.psnr_db), (0.0, f64::INFINITY));
        assert!((same.ssim - 1.0).abs() < 1e-14 && (same.contrast - same.target_contrast).abs() < 1e-14);
    }

    #[test]
    fn black_level_and_contrast_are_those_of_a_two_tone_picture() {
        let tones =
            |black: f64, white: f64| Image::new(10, 10, (0..100).map(|k| if k < 50 { black } else { white }).collect());
        let m = compare(&tones(0.1, 1.1), &tones(0.0, 1.0)).unwrap();
        assert!((m.contrast - 11.0).abs() < 1e-12 && m.target_contrast.is_infinite() && m.target_black_level == 0.0);
        assert!((m.black_level - 0.1 / 0.6).abs() < 1e-12);
    }

    #[test]
    fn images_that_cannot_be_compared_are_refused() {
        let (image, target) = pair(20, 16);
        let dark = Image::new(20, 16, vec![0.0; 320]);
        assert!(matches!(compare(&dark, &target), Err(MetricsError::Dark { which: "image", .. })));
        assert!(matches!(compare(&image, &pair(16, 20).1), Err(MetricsError::Size { .. })));
        assert!(matches!(compare(&pair(6, 9).0, &pair(6, 9).1), Err(MetricsError::TooSmall { .. })));
    }
}
