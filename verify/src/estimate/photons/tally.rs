//! Photons: a stochastic estimate that knows its own error, in parts that can be computed anywhere and added up.

mod file;
mod net;

pub use file::TallyError;

use crate::{
    film::{Film, Flux, Image, Tally, UNIT},
    spread::{Dice, mix},
    trace::Tracer,
};
use glam::DVec2;
use net::Net;
use rayon::prelude::*;

/// Which photons to trace.
///
/// The photons of a run are cut into [`replicates`](Self::replicates), independent scrambled nets over the aperture. Each
/// depends on nothing but the seed and its own number: shard `s` of `S` traces those with number `s` modulo `S`, on any
/// machine, and merging all shards gives exactly the tally of the whole run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PhotonPlan {
    /// Photons asked for in the whole run; rounded up so that every replicate has a power of two.
    pub photons: u64,
    /// Selects the random numbers.
    pub seed: u64,
    /// Independent samples, at least 2: the spread between them is the standard error.
    pub replicates: u32,
    /// Which part of the run to trace, 0 up to `shards` - 1.
    pub shard: u32,
    /// Number of parts.
    pub shards: u32,
}

impl PhotonPlan {
    /// The whole of a run.
    pub fn new(photons: u64, seed: u64) -> Self {
        Self { photons, seed, replicates: 32, shard: 0, shards: 1 }
    }
}

/// Why photons cannot be traced or tallies not be merged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PhotonError {
    /// A plan that makes no sense.
    #[error("{what} is {value}; it must lie between {least} and {greatest}")]
    Plan {
        /// Which number.
        what: &'static str,
        /// Its value.
        value: u64,
        /// Least accepted value.
        least: u64,
        /// Greatest accepted value.
        greatest: u64,
    },
    /// Parts of different runs.
    #[error("the tallies belong to different runs: they differ in {0}")]
    Different(&'static str),
    /// A part counted twice.
    #[error("replicate {0} is in both tallies")]
    Twice(u32),
}

/// Exact sums of what photons did; the state of a run or of a part of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PhotonTally {
    seed: u64,
    strata: (u32, u32),
    pixels: (usize, usize),
    /// Of the whole run.
    replicates: u32,
    /// Numbers of the replicates done, ascending.
    done: Vec<u32>,
    fates: Tally,
    /// Over replicates: sums of every pixel's power, and of its square.
    sums: Vec<u128>,
    squares: Vec<u128>,
}

/// With twice as many on one pixel, which rounding up can make of them, squares of sums just fit into 128 bits.
const MOST_PHOTONS: u64 = 2_000_000_000;
/// Most independent samples of a run.
const MOST_REPLICATES: u32 = 4096;
/// Most strata along a side of the aperture.
const MOST_STRATA: u32 = 1 << 16;
/// Rows of strata traced by one task.
const ROWS: u32 = 16;

/// Traces the photons of a plan.
///
/// Memory does not depend on the number of photons. The tally is the same, bit by bit, for any number of threads.
///
/// # Errors
/// [`PhotonError::Plan`] for a plan out of range.
pub fn photons(tracer: &Tracer, plan: &PhotonPlan) -> Result<PhotonTally, PhotonError> {
    let within = |what, value: u64, least: u64, greatest: u64| {
        if (least..=greatest).contains(&value) {
            Ok(())
        } else {
            Err(PhotonError::Plan { what, value, least, greatest })
        }
    };
    within("the number of replicates", plan.replicates.into(), 2, MOST_REPLICATES.into())?;
    within("the number of shards", plan.shards.into(), 1, plan.replicates.into())?;
    within("the shard", plan.shard.into(), 0, u64::from(plan.shards) - 1)?;
    within("the number of photons", plan.photons, 1, MOST_PHOTONS)?;

    tracer.prepare();
    let (lower, upper) = tracer.aperture_mm();
    let size = upper - lower;
    let each = plan.photons.div_ceil(plan.replicates.into());
    let (column_bits, row_bits) = net::strata_bits(each, size.x / size.y);
    let (columns, rows) = (1 << column_bits, 1 << row_bits);
    let window = &tracer.scene().window;
    let pixels = window.nx * window.ny;
    let mut film = Film::new(window);
    let mut tally = PhotonTally {
        seed: plan.seed,
        strata: (columns, rows),
        pixels: (window.nx, window.ny),
        replicates: plan.replicates,
        done: (0..plan.replicates).filter(|r| r % plan.shards == plan.shard).collect(),
        fates: Tally::default(),
        sums: vec![0; pixels],
        squares: vec![0; pixels],
    };
    for &replicate in &tally.done {
        let key = mix(plan.seed ^ mix(u64::from(replicate)));
        let net = Net::new(key, column_bits, row_bits);
        let fates = (0..rows.div_ceil(ROWS))
            .into_par_iter()
            .map(|band| {
                let mut fates = Tally::default();
                for row in band * ROWS..rows.min((band + 1) * ROWS) {
                    for column in 0..columns {
                        let dice = Dice { key, photon: u64::from(row) << 32 | u64::from(column) };
                        shoot(tracer, &film, lower + net.point(column, row) * size, &dice, &mut fates);
                    }
                }
                fates
            })
            .reduce(Tally::default, Tally::plus);
        tally.fates = tally.fates.plus(fates);
        for ((sum, square), units) in tally.sums.iter_mut().zip(&mut tally.squares).zip(film.take()) {
            // A replicate has fewer photons than there are pixels, as a rule.
            if units > 0 {
                let units = u128::from(units);
                *sum += units;
                *square += units * units;
            }
        }
    }
    Ok(tally)
}

#[inline]
fn shoot(tracer: &Tracer, film: &Film, at: DVec2, dice: &Dice, fates: &mut Tally) {
    let mut booked = 0;
    let power = tracer.all_paths(at, dice, |end, part, power| {
        let units = ((part * power * UNIT as f64) as u64).min((power * UNIT as f64) as u64 - booked);
        booked += units;
        film.record(end, units, fates);
    });
    fates.reflected += u128::from((power * UNIT as f64) as u64 - booked);
}

/// An estimate against a target, with the noise's own part taken out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoisyError {
    /// Mean square error without bias: the noise does not add to it, and so it can be negative.
    pub mean_square: f64,
    /// Standard error of `mean_square`.
    pub mean_square_error: f64,
}

impl NoisyError {
    /// Relative RMS error; 0 where nothing rises above the noise.
    pub fn rel_rms(&self) -> f64 {
        self.mean_square.max(0.0).sqrt()
    }

    /// Standard error of [`rel_rms`](Self::rel_rms): no error below this may be claimed.
    pub fn rel_rms_error(&self) -> f64 {
        // d(sqrt m) = dm / (2 sqrt m), which for m near 0 turns into sqrt(dm).
        let rms = self.rel_rms();
        let spread = self.mean_square_error;
        if rms * rms > spread { 0.5 * spread / rms } else { spread.sqrt() }
    }
}

/// How far photons are from an image that should be the same light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// Mean square difference of the photons from the image, less their noise.
    pub difference: f64,
    /// Its standard error if both show the same light.
    pub standard_error: f64,
}

impl Agreement {
    /// The difference in standard errors, without its sign. If both show the same light it is distributed as the magnitude of a
    /// standard normal variable: beyond 2 once in 22 cases, beyond 4 once in 16 000.
    pub fn standard_errors(&self) -> f64 {
        if self.difference == 0.0 { 0.0 } else { (self.difference / self.standard_error).abs() }
    }
}

impl PhotonTally {
    /// Number of photons traced.
    pub fn photons(&self) -> u64 {
        self.done.len() as u64 * self.each()
    }

    /// Pixels along x and y.
    pub fn pixels(&self) -> (usize, usize) {
        self.pixels
    }

    /// Whether all replicates of the run are in.
    pub fn is_complete(&self) -> bool {
        self.done.len() == self.replicates as usize
    }

    /// Whether all photons have the same power.
    fn is_even(&self) -> bool {
        self.fates.total() == u128::from(self.photons()) * u128::from(UNIT)
    }

    fn each(&self) -> u64 {
        u64::from(self.strata.0) * u64::from(self.strata.1)
    }

    /// Adds another part of the same run.
    ///
    /// # Errors
    /// Parts of different runs, or a replicate that is in both.
    pub fn merge(mut self, other: &Self) -> Result<Self, PhotonError> {
        for (same, what) in [
            (self.seed == other.seed, "the seed"),
            (self.strata == other.strata, "the number of photons or the shape of the aperture"),
            (self.pixels == other.pixels, "the number of pixels"),
            (self.replicates == other.replicates, "the number of replicates"),
        ] {
            if !same {
                return Err(PhotonError::Different(what));
            }
        }
        if let Some(&twice) = other.done.iter().find(|r| self.done.binary_search(r).is_ok()) {
            return Err(PhotonError::Twice(twice));
        }
        self.done.extend(&other.done);
        self.done.sort_unstable();
        self.fates = self.fates.plus(other.fates);
        self.sums.iter_mut().zip(&other.sums).for_each(|(a, b)| *a += b);
        self.squares.iter_mut().zip(&other.squares).for_each(|(a, b)| *a += b);
        Ok(self)
    }

    /// Where the light went.
    pub fn flux(&self) -> Flux {
        self.fates.flux()
    }

    /// Irradiance; 1 is the light of the aperture spread evenly over the window.
    pub fn image(&self) -> Image {
        let scale = self.sums.len() as f64 / self.fates.total().max(1) as f64;
        Image::new(self.pixels.0, self.pixels.1, self.sums.iter().map(|&s| s as f64 * scale).collect())
    }

    /// Standard error of every pixel of [`image`](Self::image), from the spread between replicates. Infinite with fewer
    /// than two of them.
    pub fn standard_error(&self) -> Image {
        let n = self.done.len() as f64;
        let scale = self.sums.len() as f64 * n / self.fates.total().max(1) as f64;
        let deviation = |(&sum, &square): (&u128, &u128)| {
            // n * square - sum^2 in integers: no cancellation.
            let spread = (self.done.len() as u128 * square - sum * sum) as f64;
            scale * (spread / (n * (n - 1.0)) / n).max(0.0).sqrt()
        };
        let values = if n < 2.0 {
            vec![f64::INFINITY; self.sums.len()]
        } else {
            self.sums.iter().zip(&self.squares).map(deviation).collect()
        };
        Image::new(self.pixels.0, self.pixels.1, values)
    }

    /// The root of the mean square of the [standard errors](Self::standard_error) over the mean of the image: the noise that a
    /// comparison of this image has to reckon with.
    pub fn noise(&self) -> f64 {
        let errors = self.standard_error();
        let squares = Image::new(errors.nx, errors.ny, errors.values.iter().map(|e| e * e).collect());
        squares.mean().sqrt() / self.image().mean()
    }

    /// The error against a target of the same size (any positive scale), both normalised to the mean 1. The variance of
    /// the photons is subtracted, so that more photons make the estimate sharper but not smaller.
    ///
    /// # Errors
    /// [`PhotonError::Different`] if the sizes differ.
    pub fn error_against(&self, target: &Image) -> Result<NoisyError, PhotonError> {
        if (target.nx, target.ny) != self.pixels {
            return Err(PhotonError::Different("the number of pixels"));
        }
        let (image, noise) = (self.image(), self.standard_error());
        let (image_mean, target_mean) = (image.mean(), target.mean());
        let (mut sum, mut spread) = (0.0, 0.0);
        for ((&e, &s), &t) in image.values.iter().zip(&noise.values).zip(&target.values) {
            let variance = (s / image_mean).powi(2);
            let square = (e / image_mean - t / target_mean).powi(2) - variance;
            sum += square;
            spread += 4.0 * square.max(0.0) * variance + 2.0 * variance * variance;
        }
        let n = self.sums.len() as f64;
        Ok(NoisyError { mean_square: sum / n, mean_square_error: spread.sqrt() / n })
    }

    /// Asks whether the photons show the light of an image of the same size that is free of noise. Scales do not matter.
    ///
    /// If they do, the square of every pixel's difference less the pixel's variance is a number of mean 0. Nets make those of
    /// pixels that lie close together correlated, and others hardly: the sum of their products with their neighbours is the
    /// variance of their sum, whatever their distribution. No model of the noise is needed, nor many replicates: from 4 on
    /// the difference is normal as far as 300 seeds tell; with 2 one of them went beyond 4 standard errors.
    ///
    /// # Errors
    /// [`PhotonError::Different`] if the sizes differ.
    pub fn agreement(&self, image: &Image) -> Result<Agreement, PhotonError> {
        if (image.nx, image.ny) != self.pixels {
            return Err(PhotonError::Different("the number of pixels"));
        }
        let (own, noise) = (self.image(), self.standard_error());
        let (own_mean, image_mean) = (own.mean(), image.mean());
        if own_mean == 0.0 {
            // So many should have come where none did: Poisson's law.
            let expected = image_mean * self.photons() as f64;
            return Ok(Agreement { difference: expected, standard_error: expected.sqrt().max(f64::MIN_POSITIVE) });
        }
        if image_mean == 0.0 {
            return Ok(Agreement { difference: f64::INFINITY, standard_error: 1.0 });
        }
        let off: Vec<f64> = (0..own.values.len())
            .map(|k| {
                let difference = own.values[k] / own_mean - image.values[k] / image_mean;
                difference * difference - (noise.values[k] / own_mean).powi(2)
            })
            .collect();
        let n = off.len() as f64;
        // Products with themselves alone would be too few; a small image does not tell those with many neighbours.
        let squares: f64 = off.iter().map(|off| off * off).sum();
        let variance = products_with_neighbours(&off, self.pixels, if n < 2500.0 { 1 } else { 2 }).max(squares);
        Ok(Agreement { difference: off.iter().sum::<f64>() / n, standard_error: variance.sqrt() / n })
    }
}

/// The sum over pixels of the value there times the sum of those around it, itself included, up to `reach` pixels away along
/// either side.
fn products_with_neighbours(values: &[f64], (nx, ny): (usize, usize), reach: usize) -> f64 {
    let around = |k: usize, n: usize| k.saturating_sub(reach)..(k + reach + 1).min(n);
    let row = |j: usize| -> f64 {
        let of_pixel = |i: usize| {
            let near: f64 = around(j, ny).map(|y| around(i, nx).map(|x| values[y * nx + x]).sum::<f64>()).sum();
            values[j * nx + i] * near
        };
        (0..nx).map(of_pixel).sum()
    };
    (0..ny).map(row).sum()
}
