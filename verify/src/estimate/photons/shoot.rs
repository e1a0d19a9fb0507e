//! Tracing the photons of a plan.

use super::{
    plan::{PhotonError, PhotonPlan},
    sobol::{SobolNet, strata_bits},
    tally::{MOST_PHOTONS, MOST_REPLICATES, PhotonTally},
};
use crate::{
    estimate::{
        film::Film,
        flux::{PowerTally, UNIT},
    },
    random::{PhotonRandom, mix},
    trace::Tracer,
};
use glam::DVec2;
use rayon::prelude::*;

/// Rows of strata traced by one task.
const ROWS: u32 = 16;

/// Traces the photons of a plan.
///
/// Memory does not depend on the number of photons. The tally is the same, bit by bit, for any
/// number of threads.
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
    let (column_bits, row_bits) = strata_bits(each, size.x / size.y);
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
        fates: PowerTally::default(),
        sums: vec![0; pixels],
        squares: vec![0; pixels],
    };
    for &replicate in &tally.done {
        let key = mix(plan.seed ^ mix(u64::from(replicate)));
        let net = SobolNet::new(key, column_bits, row_bits);
        let fates = (0..rows.div_ceil(ROWS))
            .into_par_iter()
            .map(|band| {
                let mut fates = PowerTally::default();
                for row in band * ROWS..rows.min((band + 1) * ROWS) {
                    for column in 0..columns {
                        let random = PhotonRandom { key, photon: u64::from(row) << 32 | u64::from(column) };
                        shoot(tracer, &film, lower + net.point(column, row) * size, &random, &mut fates);
                    }
                }
                fates
            })
            .reduce(PowerTally::default, PowerTally::plus);
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
fn shoot(tracer: &Tracer, film: &Film, at: DVec2, random: &PhotonRandom, fates: &mut PowerTally) {
    let mut recorded = 0;
    let power = tracer.all_paths(at, random, |end, part, power| {
        let units = ((part * power * UNIT as f64) as u64).min((power * UNIT as f64) as u64 - recorded);
        recorded += units;
        film.record(end, units, fates);
    });
    fates.reflected += u128::from((power * UNIT as f64) as u64 - recorded);
}
