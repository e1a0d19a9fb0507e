//! How well an image agrees with its target: every measure, its unit and its source, in one place.
//!
//! Irradiance has no unit here: images are divided by their means. Where the light goes that draws
//! no picture is measured in [`Flux`](crate::Flux), as a part of the light that fills the aperture:
//! `missed` is the flux outside of the window.

use crate::image::Image;

/// Measures of agreement. Both images are first divided by their means: only the distribution of
/// light is judged.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Metrics {
    /// Root of the mean square difference; the mean of both images is 1.
    pub rel_rms: f64,
    /// Mean of the absolute difference.
    pub mean_abs: f64,
    /// Peak signal-to-noise ratio, dB: the peak is the target's greatest value. Infinite for equal
    /// images.
    pub psnr_db: f64,
    /// Structural similarity (Wang et al. 2004) with a uniform window of 7 x 7, sample covariance,
    /// the target's greatest value as data range, averaged without a border of 3 pixels:
    /// scikit-image's default.
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
    /// Mean of the image where the target is brightest (the greatest twentieth) divided by
    /// `black_level`.
    pub contrast: f64,
    /// The same for the target; infinite for true black.
    pub target_contrast: f64,
    /// Sharpness, in pixels: the 10 % to 90 % rise of the edge spread function (as in ISO 12233,
    /// there along one straight edge), which here is the mean profile of the image across the
    /// steepest crests of the target's gradient (at most a hundredth of its pixels), along the
    /// gradient, between the extrema next to the edge. A Gaussian blur of standard deviation s
    /// gives 2.563 s. NaN where the target has no edge. Times the width of a pixel in mm it is the
    /// edge width in mm: [`edge_width_mm`](Self::edge_width_mm).
    pub edge_width_px: f64,
    /// The same for the target: what a perfect image would have.
    pub target_edge_width_px: f64,
}

impl Metrics {
    /// Edge widths of image and target, mm, for pixels of this width.
    pub fn edge_width_mm(&self, mm_per_pixel: f64) -> [f64; 2] {
        [self.edge_width_px, self.target_edge_width_px].map(|px| px * mm_per_pixel)
    }
}

/// Why two images cannot be compared.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
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
    #[error("{}", dark(which, *mean))]
    Dark {
        /// "image" or "target".
        which: &'static str,
        /// Its mean.
        mean: f64,
    },
}

fn dark(which: &str, mean: f64) -> String {
    if which == "image" && mean == 0.0 {
        return "no light falls into the window of the picture: the block, its distance and the window do not fit together".into();
    }
    format!("the mean of the {which} is {mean}; it must be positive and finite")
}

/// Width of SSIM's window, pixels.
const WINDOW: usize = 7;

/// Compares an image with its target, both of any positive scale.
///
/// # Errors
/// Sizes that differ or are below 7 x 7, or an image without light.
pub fn compare(image: &Image, target: &Image) -> Result<Metrics, MetricsError> {
    let (nx, ny) = (target.nx, target.ny);
    let (s, t) = normalised(image, target)?;
    let (rel_rms, peak) = (rms_between(&s, &t, nx), peak_of(&t));
    // Both means are 1.
    let ss = mean_of(&s, &t, nx, |s, _| (s - 1.0) * (s - 1.0));
    let tt = mean_of(&s, &t, nx, |_, t| (t - 1.0) * (t - 1.0));
    let st = mean_of(&s, &t, nx, |s, t| (s - 1.0) * (t - 1.0));
    let fit_gain = if tt > 0.0 { st / tt } else { 0.0 };
    let [edge_width_px, target_edge_width_px] = edge_widths(&s, &t, nx, ny);
    let [(black_level, target_black_level), (white, target_white)] = extremes(&s, &t);
    Ok(Metrics {
        rel_rms,
        mean_abs: mean_of(&s, &t, nx, |s, t| (s - t).abs()),
        psnr_db: 20.0 * (peak / rel_rms).log10(),
        ssim: ssim(&s, &t, nx, ny, peak),
        correlation: st / (ss * tt).sqrt(),
        fit_gain,
        fit_offset: 1.0 - fit_gain,
        black_level,
        target_black_level,
        contrast: white / black_level,
        target_contrast: target_white / target_black_level,
        edge_width_px,
        target_edge_width_px,
    })
}

/// The two measures that tell most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Likeness {
    /// See [`Metrics::rel_rms`].
    pub rel_rms: f64,
    /// See [`Metrics::ssim`].
    pub ssim: f64,
}

impl From<&Metrics> for Likeness {
    fn from(metrics: &Metrics) -> Self {
        Self { rel_rms: metrics.rel_rms, ssim: metrics.ssim }
    }
}

/// Only the likeness of an image to its target: a quarter of the time of [`compare`].
///
/// # Errors
/// As for [`compare`].
pub fn likeness(image: &Image, target: &Image) -> Result<Likeness, MetricsError> {
    let (s, t) = normalised(image, target)?;
    Ok(Likeness { rel_rms: rms_between(&s, &t, target.nx), ssim: ssim(&s, &t, target.nx, target.ny, peak_of(&t)) })
}

/// Only the relative RMS difference of two images, see [`Metrics::rel_rms`].
///
/// # Errors
/// As for [`compare`].
pub fn rel_rms(image: &Image, target: &Image) -> Result<f64, MetricsError> {
    let (s, t) = normalised(image, target)?;
    Ok(rms_between(&s, &t, target.nx))
}

fn rms_between(s: &[f64], t: &[f64], nx: usize) -> f64 {
    mean_of(s, t, nx, |s, t| (s - t) * (s - t)).sqrt()
}

fn peak_of(t: &[f64]) -> f64 {
    t.iter().copied().fold(0.0, f64::max)
}

/// Both images divided by their means.
fn normalised(image: &Image, target: &Image) -> Result<(Vec<f64>, Vec<f64>), MetricsError> {
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
    Ok((normalised(image, "image")?, normalised(target, "target")?))
}

/// The mean of a function of two images, row by row, so that rounding does not grow with their
/// size.
fn mean_of(s: &[f64], t: &[f64], nx: usize, f: impl Fn(f64, f64) -> f64) -> f64 {
    let row = |(s, t): (&[f64], &[f64])| s.iter().zip(t).map(|(&s, &t)| f(s, t)).sum::<f64>();
    s.chunks(nx).zip(t.chunks(nx)).map(row).sum::<f64>() / s.len() as f64
}

/// How far from an edge its profile is looked at, in pixels to either side, and how finely.
const PROFILE_REACH: usize = 8;
const PROFILE_STEPS: usize = 4;

/// Edge widths of image and target across the steepest places of the target, pixels.
fn edge_widths(s: &[f64], t: &[f64], nx: usize, ny: usize) -> [f64; 2] {
    const MARGIN: usize = PROFILE_REACH + 2;
    if nx.min(ny) <= 2 * MARGIN {
        return [f64::NAN; 2];
    }
    let gradient = |k: usize| (0.5 * (t[k + 1] - t[k - 1]), 0.5 * (t[k + nx] - t[k - nx]));
    let mut steepness = vec![0.0; t.len()];
    for j in 1..ny - 1 {
        for k in j * nx + 1..(j + 1) * nx - 1 {
            let (gx, gy) = gradient(k);
            steepness[k] = (gx * gx + gy * gy).sqrt();
        }
    }
    // Crests of steepness, and how far along the gradient the crest is from the pixel.
    let crest = |k: usize| {
        let ((gx, gy), here) = (gradient(k), steepness[k]);
        let (x, y) = ((k % nx) as f64, (k / nx) as f64);
        let beside = |side: f64| bilinear(&steepness, nx, x + side * gx / here, y + side * gy / here);
        let (before, after) = (beside(-1.0), beside(1.0));
        let bend = 2.0 * here - before - after;
        let is_crest = here > 0.0 && here >= before && here >= after && bend > 0.0;
        is_crest.then(|| (here, k, 0.5 * (after - before) / bend))
    };
    let inner = (MARGIN..ny - MARGIN).flat_map(|j| (MARGIN..nx - MARGIN).map(move |i| j * nx + i));
    let mut places: Vec<(f64, usize, f64)> = inner.filter_map(crest).collect();
    // Ties are broken by place, so that the choice does not depend on the sorting.
    let steeper = |a: &(f64, usize, f64), b: &(f64, usize, f64)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
    let most = (nx * ny).div_ceil(100);
    if places.len() > most {
        places.select_nth_unstable_by(most, steeper);
        places.truncate(most);
    }
    places.sort_unstable_by(steeper);
    [s, t].map(|image| {
        let mut profile = [0.0; 2 * PROFILE_REACH * PROFILE_STEPS + 1];
        for &(steepness, k, shift) in &places {
            let ((gx, gy), (x, y)) = (gradient(k), ((k % nx) as f64, (k / nx) as f64));
            for (step, sum) in profile.iter_mut().enumerate() {
                let along = (step as f64 / PROFILE_STEPS as f64 - PROFILE_REACH as f64 + shift) / steepness;
                *sum += bilinear(image, nx, x + along * gx, y + along * gy);
            }
        }
        rise(&profile) / PROFILE_STEPS as f64
    })
}

/// The value between four pixels; the point lies within the image.
fn bilinear(image: &[f64], nx: usize, x: f64, y: f64) -> f64 {
    let (i, j) = (x as usize, y as usize);
    let (u, v) = (x - i as f64, y - j as f64);
    let row = |k: usize| image[k] + u * (image[k + 1] - image[k]);
    let k = j * nx + i;
    row(k) + v * (row(k + nx) - row(k))
}

/// From 10 % to 90 % of the rise through the middle of a profile, in steps.
fn rise(profile: &[f64]) -> f64 {
    let middle = profile.len() / 2;
    let mut foot = middle;
    while foot > 0 && profile[foot - 1] < profile[foot] {
        foot -= 1;
    }
    let mut top = middle;
    while top + 1 < profile.len() && profile[top + 1] > profile[top] {
        top += 1;
    }
    let (low, height) = (profile[foot], profile[top] - profile[foot]);
    let crossing = |part: f64| {
        let level = low + part * height;
        let above = (foot + 1..=top).find(|&k| profile[k] >= level)?;
        let (a, b) = (profile[above - 1], profile[above]);
        Some((above - 1) as f64 + (level - a) / (b - a))
    };
    match (crossing(0.1), crossing(0.9)) {
        (Some(begin), Some(end)) if height > 0.0 => end - begin,
        _ => f64::NAN,
    }
}

/// Means of image and target over the darkest and the brightest twentieth of the target's pixels.
/// All pixels of the limiting value count, so that the order of equal pixels does not matter.
fn extremes(s: &[f64], t: &[f64]) -> [(f64, f64); 2] {
    let mut partly_sorted = t.to_vec();
    let count = t.len().div_ceil(20);
    let mut nth = |k: usize| *partly_sorted.select_nth_unstable_by(k, f64::total_cmp).1;
    let (dark, bright) = (nth(count - 1), nth(t.len() - count));
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
        //   structural_similarity(t, s, data_range=peak), peak_signal_noise_ratio(t, s,
        // data_range=peak), sqrt(mean((s - t)^2)), mean(|s - t|), corrcoef, polyfit; scikit-image
        // 0.26, NumPy.
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
    fn the_edge_width_is_that_of_a_gaussian_blur_in_any_direction() {
        // Numerical recipes' rational Chebyshev fit of erfc, good to 1.2e-7.
        let erfc = |x: f64| {
            let z = x.abs();
            let t = 1.0 / (1.0 + 0.5 * z);
            let series = [
                -1.26551223,
                1.00002368,
                0.37409196,
                0.09678418,
                -0.18628806,
                0.27886807,
                -1.13520398,
                1.48851587,
                -0.82215223,
                0.17087277,
            ];
            let sum = series.iter().rev().fold(0.0, |sum, c| sum * t + c);
            let r = t * (-z * z + sum).exp();
            if x >= 0.0 { r } else { 2.0 - r }
        };
        for (angle, sigma) in [(0.0_f64, 1.5), (0.3, 2.0), (0.785, 1.0), (-2.0, 2.5)] {
            let edge = |sigma: f64| {
                let value = |k: usize| {
                    let (x, y) = ((k % 96) as f64 - 47.3, (k / 96) as f64 - 39.1);
                    let across = x * angle.cos() + y * angle.sin();
                    0.2 + 0.5 * erfc(-across / (sigma * 2.0_f64.sqrt()))
                };
                Image::new(96, 80, (0..96 * 80).map(value).collect())
            };
            let m = compare(&edge(sigma), &edge(1.2)).unwrap();
            let [image, target] = m.edge_width_mm(0.5);
            // Looking up between pixels widens an edge: a variance of up to 1/4 square pixel.
            let wanted = |sigma: f64| 0.5 * 2.563 * sigma..=0.5 * 2.563 * (sigma * sigma + 0.25).sqrt() + 0.01;
            assert!(wanted(1.2).contains(&target), "{angle}: {target} for {:?}", wanted(1.2));
            assert!(wanted(sigma).contains(&image), "{angle}: {image} for {:?}", wanted(sigma));
        }
        let flat = Image::new(40, 40, vec![1.0; 1600]);
        assert!(compare(&flat, &flat).unwrap().edge_width_px.is_nan());
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
