//! The light that a perfect block must draw so that an imperfect one draws the picture (section 3.3
//! of the paper).
//!
//! Richardson and Lucy's iteration for `K u = b`, with `K` the convolution, `b` the wanted light
//! and `u >= 0` that of the perfect block:
//!
//! ```text
//! u <- u * K^T(m b / K u) / K^T m
//! ```
//!
//! with `m` 1 where the result is looked at. It is accelerated as Biggs and Andrews (Applied Optics
//! 36, 1997) do, by extrapolating along the last step.
//!
//! # The border
//! The block sends no light beyond its window. [`Border::Dark`] takes that for what it is: `u` is 0
//! outside, the result is looked at inside, and the outermost light is made brighter to stand in
//! for what is missing. [`Border::Continued`] is the paper's way: the picture is extended at its
//! borders and bevelled, deconvolved as a whole, and cut out of the result, so that nothing special
//! happens at the border; the light of a real block then fades towards it.
//!
//! # What no deconvolution can do
//! A wave that the spread wipes out is not to be had back; the closer to that, the more light and
//! dark must alternate for it. `u` is therefore held between [`Deconvolution::least`] and
//! [`Deconvolution::greatest`], which bounds the range of light that the solver has to make, at
//! little cost.

use super::{Psf, TargetError, TargetIrradiance};
use crate::grid::{Convolution, Field};
use rayon::prelude::*;
use std::ops::ControlFlow;

/// What is taken to lie beyond the border of the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Border {
    /// No light, as on a real receiver.
    #[default]
    Dark,
    /// The picture, continued and bevelled, as in the paper.
    Continued,
}

/// Options of a deconvolution.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Deconvolution {
    /// Rounds at most, 1 to 1000; default 60.
    pub rounds: usize,
    /// What lies beyond the border; default [`Border::Dark`].
    pub border: Border,
    /// Least light, in means of the picture, or that of the picture if that is less; default 0.05.
    /// 0 up to 1.
    pub least: f64,
    /// Greatest light, in means of the picture, or that of the picture if that is more; default 8.
    /// 1 up to 1000.
    pub greatest: f64,
}

impl Default for Deconvolution {
    fn default() -> Self {
        Self { rounds: 60, border: Border::default(), least: 0.05, greatest: 8.0 }
    }
}

/// Why a deconvolution ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// What the light becomes is the picture, to a thousandth of its mean.
    Agreed,
    /// Ten rounds gained less than a hundredth.
    Stalled,
    /// All rounds are done.
    Rounds,
}

/// The light that a perfect block must draw, and what becomes of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Deconvolved {
    /// The light to draw.
    pub target: TargetIrradiance,
    /// Rounds done.
    pub rounds: usize,
    /// Why no more.
    pub ending: Ending,
    /// Relative RMS difference from the picture that its own light would have, spread.
    pub error_before: f64,
    /// Relative RMS difference from the picture that the light to draw will have, spread.
    pub error_after: f64,
    /// Brightest over darkest pixel of the picture.
    pub contrast_before: f64,
    /// Brightest over darkest pixel of the light to draw.
    pub contrast_after: f64,
    /// Share of the light that spreads beyond the window.
    pub lost: f64,
}

/// Why nothing can be deconvolved.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DeconvolutionError {
    /// An option outside of its range.
    #[error("{what} of the deconvolution is {value}; it must lie between {least} and {greatest}")]
    Option {
        /// Which option.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Least accepted value.
        least: f64,
        /// Greatest accepted value.
        greatest: f64,
    },
    /// What came out is no light.
    #[error(transparent)]
    Target(#[from] TargetError),
    /// The caller wants no result any more.
    #[error("the deconvolution was cancelled")]
    Cancelled,
}

/// The picture counts as reached at this relative RMS difference.
const AGREED: f64 = 1e-3;
/// Progress is looked at over so many rounds.
const STRIDE: usize = 10;
/// And must shrink the difference to at most this part of it.
const STALLED: f64 = 0.99;
/// Light below this is none to divide by.
const DARK: f64 = 1e-12;

impl Deconvolution {
    /// The same with so many rounds at most.
    #[must_use]
    pub fn with_rounds(self, rounds: usize) -> Self {
        Self { rounds, ..self }
    }

    /// The same with another border.
    #[must_use]
    pub fn with_border(self, border: Border) -> Self {
        Self { border, ..self }
    }

    /// The same with other limits of the light to draw, relative to the mean.
    #[must_use]
    pub fn with_limits(self, least: f64, greatest: f64) -> Self {
        Self { least, greatest, ..self }
    }

    /// Checks the options.
    ///
    /// # Errors
    /// [`DeconvolutionError::Option`].
    pub fn check(&self) -> Result<(), DeconvolutionError> {
        for (what, value, least, greatest) in [
            ("the number of rounds", self.rounds as f64, 1.0, 1000.0),
            ("the least light", self.least, 0.0, 1.0),
            ("the greatest light", self.greatest, 1.0, 1000.0),
        ] {
            if !(least..=greatest).contains(&value) {
                return Err(DeconvolutionError::Option { what, value, least, greatest });
            }
        }
        Ok(())
    }

    /// The light that becomes `wanted` when it is spread.
    ///
    /// # Errors
    /// An option out of range.
    pub fn of(&self, wanted: &TargetIrradiance, psf: &Psf) -> Result<Deconvolved, DeconvolutionError> {
        self.of_watched(wanted, psf, |_| ControlFlow::Continue(()))
    }

    /// The same; `watch` is told how many rounds are done, and may end it.
    ///
    /// # Errors
    /// An option out of range, and [`DeconvolutionError::Cancelled`].
    pub fn of_watched(
        &self,
        wanted: &TargetIrradiance,
        psf: &Psf,
        mut watch: impl FnMut(usize) -> ControlFlow<()>,
    ) -> Result<Deconvolved, DeconvolutionError> {
        self.check()?;
        let cells = wanted.cells();
        let (nx, ny) = (cells.nx(), cells.ny());
        let margins = match self.border {
            Border::Dark => (0, 0),
            Border::Continued => (psf.kernel().nx(), psf.kernel().ny()),
        };
        let data = continued(cells, margins);
        let (low, high) = cells.min_max();
        let range = match self.border {
            Border::Dark => (self.least.min(low), self.greatest.max(high)),
            // Beyond the window the bevel may go down to nothing.
            Border::Continued => (0.0, self.greatest.max(high)),
        };
        let mut richardson = Richardson::new(psf, data, range);
        let error = |light: &Field<f64>| {
            let seen = psf.blurred(light);
            (difference(&seen, cells), 1.0 - seen.mean() / light.mean())
        };
        let (error_before, _) = error(cells);
        let (mut ending, mut rounds, mut before) = (Ending::Rounds, 0, f64::INFINITY);
        let mut light = cells.clone();
        while rounds < self.rounds {
            let stride = STRIDE.min(self.rounds - rounds);
            (0..stride).for_each(|_| richardson.step());
            rounds += stride;
            if watch(rounds).is_break() {
                return Err(DeconvolutionError::Cancelled);
            }
            let next = cut(&richardson.light, margins, (nx, ny)).map(|v| v.max(self.least.min(low)));
            let (now, _) = error(&next);
            if now > before {
                // Extrapolation went too far; what was there is better.
                (ending, rounds) = (Ending::Stalled, rounds - stride);
                break;
            }
            light = next;
            if now <= AGREED {
                ending = Ending::Agreed;
                break;
            }
            if now > STALLED * before {
                ending = Ending::Stalled;
                break;
            }
            before = now;
        }
        let target = TargetIrradiance::new(light)?;
        let (error_after, lost) = error(target.cells());
        let contrast = |cells: &Field<f64>| {
            let (low, high) = cells.min_max();
            high / low
        };
        Ok(Deconvolved {
            rounds,
            ending,
            error_before,
            error_after,
            contrast_before: contrast(cells),
            contrast_after: contrast(target.cells()),
            lost,
            target,
        })
    }
}

/// One run of the iteration.
struct Richardson {
    spread: Convolution,
    wanted: Field<f64>,
    /// `K^T m`.
    reach: Field<f64>,
    range: (f64, f64),
    light: Field<f64>,
    /// Where the next step starts from.
    ahead: Field<f64>,
    /// The last step, from where it started.
    step: Field<f64>,
    seen: Field<f64>,
    ratio: Field<f64>,
}

impl Richardson {
    fn new(psf: &Psf, wanted: Field<f64>, range: (f64, f64)) -> Self {
        let (nx, ny) = (wanted.nx(), wanted.ny());
        let mut spread = Convolution::new(psf.kernel(), nx, ny);
        let (mut reach, zeros) = (Field::filled(nx, ny, 0.0), Field::filled(nx, ny, 0.0));
        spread.apply_transposed(&Field::filled(nx, ny, 1.0), &mut reach);
        Self {
            spread,
            reach,
            range,
            light: wanted.clone(),
            ahead: wanted.clone(),
            wanted,
            step: zeros.clone(),
            seen: zeros.clone(),
            ratio: zeros,
        }
    }

    fn step(&mut self) {
        let (least, greatest) = self.range;
        self.spread.apply(&self.ahead, &mut self.seen);
        let wanted = self.wanted.as_slice();
        self.seen.as_mut_slice().par_iter_mut().zip(wanted).for_each(|(seen, wanted)| *seen = wanted / seen.max(DARK));
        self.spread.apply_transposed(&self.seen, &mut self.ratio);
        // The new light takes the place of the ratio.
        self.ratio
            .as_mut_slice()
            .par_iter_mut()
            .zip(self.ahead.as_slice().par_iter().zip(self.reach.as_slice()))
            .for_each(|(next, (ahead, reach))| *next = (ahead * *next / reach.max(DARK)).clamp(least, greatest));
        // Sums row by row, so that no number of threads changes them.
        let (mut product, mut square) = (0.0, 0.0);
        let nx = self.light.nx();
        let rows = self.ratio.as_slice().chunks(nx).zip(self.ahead.as_slice().chunks(nx));
        for ((next, ahead), step) in rows.zip(self.step.as_mut_slice().chunks_mut(nx)) {
            let (mut row_product, mut row_square) = (0.0, 0.0);
            for ((next, ahead), step) in next.iter().zip(ahead).zip(step) {
                let now = next - ahead;
                row_product += now * *step;
                row_square += *step * *step;
                *step = now;
            }
            product += row_product;
            square += row_square;
        }
        let onwards = if square > 0.0 { (product / square).clamp(0.0, 0.999) } else { 0.0 };
        let (light, next) = (self.light.as_slice(), self.ratio.as_slice());
        self.ahead.as_mut_slice().par_iter_mut().zip(next.par_iter().zip(light)).for_each(|(ahead, (next, light))| {
            *ahead = (next + onwards * (next - light)).clamp(least, greatest);
        });
        std::mem::swap(&mut self.light, &mut self.ratio);
    }
}

/// The picture continued by its outermost pixels, bevelled so that it fades to nothing.
fn continued(cells: &Field<f64>, (mx, my): (usize, usize)) -> Field<f64> {
    let (nx, ny) = (cells.nx(), cells.ny());
    let axis = |k: usize, n: usize, margin: usize| {
        let inner = k.saturating_sub(margin).min(n - 1);
        let outside = k.abs_diff(inner + margin) as f64;
        // Half of the margin as it is, half of it falling.
        let fall = (2.0 * outside / (margin + 1) as f64 - 1.0).clamp(0.0, 1.0);
        (inner, 0.5 + 0.5 * (std::f64::consts::PI * fall).cos())
    };
    Field::from_fn(nx + 2 * mx, ny + 2 * my, |i, j| {
        let ((i, along_x), (j, along_y)) = (axis(i, nx, mx), axis(j, ny, my));
        cells[(i, j)] * along_x * along_y
    })
}

fn cut(field: &Field<f64>, (mx, my): (usize, usize), (nx, ny): (usize, usize)) -> Field<f64> {
    Field::from_fn(nx, ny, |i, j| field[(i + mx, j + my)])
}

/// Relative RMS difference of two lights, each with its own mean.
fn difference(a: &Field<f64>, b: &Field<f64>) -> f64 {
    let (ma, mb) = (a.mean(), b.mean());
    Field::from_fn(a.nx(), a.ny(), |i, j| (a[(i, j)] / ma - b[(i, j)] / mb).powi(2)).mean().sqrt()
}

#[cfg(test)]
mod tests;
