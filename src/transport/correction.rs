//! The correction of a round: less light is asked for where there is too much (Richardson and
//! Lucy), as firmly as every place of the picture bears it.
//!
//! How firm a correction may be depends on how many nodes the lens has for a cell of the picture,
//! along its poorest direction: on a disc that draws a square, on the window's corners too much
//! makes folds and spots of what was merely blurred. So every place keeps the light that drew it
//! best, and a round that made it worse there is taken back there, and is gentler from then on.

use super::light;
use crate::grid::{Contour, Field};
use rayon::prelude::*;

/// Most that a round changes the logarithm of the light.
const MOST_CHANGE: f64 = 0.5;

/// How firmly a round corrects: van Cittert iterations and the share of the correction.
pub(super) const STAGES: [(usize, f64); 4] = [(2, 1.0), (1, 1.0), (0, 1.0), (0, 0.5)];
/// The first stage without van Cittert iterations.
pub(super) const GENTLE: usize = 2;
/// The gentlest stage.
const LAST: u8 = STAGES.len() as u8 - 1;

/// A place whose squared error stays above this share of what it was goes on to the next stage.
const STALLED: f64 = 0.94;
/// Cells from a corner of the window, along both sides added up, within which a smooth outline
/// squeezes the map beyond what the lens's nodes can hold.
const SQUEEZED: usize = 20;
/// Places are squares of cells that reach so far around each.
const REACH: usize = 4;

/// What drew every place of the picture best so far.
#[derive(Clone, Debug)]
pub(super) struct Correction {
    /// The light that the equation was solved with, at the receiver's nodes, and what it gave, on
    /// cells.
    light: Field<f64>,
    seen: Field<f64>,
    /// Sum of squared errors around every cell.
    error: Field<f64>,
    /// Stages that a cell has gone on by, more than the whole picture.
    later: Vec<u8>,
    per_cell: (usize, usize),
}

impl Correction {
    /// Begins with a first light and what it gave. The sharp corners of the window may map to a
    /// smooth outline of the lens: there the map is squeezed without limit, and no round may be
    /// firm.
    pub(super) fn new(
        light: Field<f64>,
        seen: Field<f64>,
        wanted: &Field<f64>,
        per_cell: (usize, usize),
        outline: &Contour,
    ) -> Self {
        let error = around(&seen, wanted);
        let (nx, ny) = (seen.nx(), seen.ny());
        let from_side = |k: usize, n: usize| k.min(n - 1 - k);
        let squeezed = |k: usize| !outline.is_rectangle() && from_side(k % nx, nx) + from_side(k / nx, ny) < SQUEEZED;
        let later = (0..nx * ny).map(|k| if squeezed(k) { LAST } else { 0 }).collect();
        Self { light, seen, error, later, per_cell }
    }

    /// Takes over what another light drew better.
    pub(super) fn learn(&mut self, light: &Field<f64>, seen: &Field<f64>, wanted: &Field<f64>) {
        let error = around(seen, wanted);
        let mut better = Field::filled(seen.nx(), seen.ny(), 0.0);
        for (k, (new, old)) in error.as_slice().iter().zip(self.error.as_mut_slice()).enumerate() {
            if *new > STALLED * *old {
                self.later[k] = self.later[k].saturating_add(1);
            }
            if new <= old {
                (*old, better.as_mut_slice()[k]) = (*new, 1.0);
            }
        }
        let known = self.seen.as_mut_slice().iter_mut().zip(seen.as_slice());
        known.zip(better.as_slice()).filter(|(_, better)| **better > 0.0).for_each(|((old, new), _)| *old = *new);
        let better = light::interpolate(&better, self.per_cell, |better| better);
        let lights = self.light.as_mut_slice().par_iter_mut().zip(light.as_slice());
        lights.zip(better.as_slice()).for_each(|((old, new), &share)| {
            if share == 1.0 {
                *old = *new;
            } else if share > 0.0 {
                *old = old.powf(1.0 - share) * new.powf(share);
            }
        });
    }

    /// The light to try next: the best so far, times what the cells lack. Light below `floor`
    /// counts as that.
    pub(super) fn next(&self, wanted: &Field<f64>, floor: f64, stage: usize, light: &mut Field<f64>) {
        let data = self
            .seen
            .as_slice()
            .par_iter()
            .zip(wanted.as_slice())
            .map(|(s, w)| ((s + floor) / (w + floor)).ln().clamp(-MOST_CHANGE, MOST_CHANGE))
            .collect();
        let lacks = Field::from_vec(self.seen.nx(), self.seen.ny(), data);
        let mut excess = Field::filled(lacks.nx(), lacks.ny(), 0.0);
        let mut sharp = lacks.clone();
        let mut sharpened = 0;
        // From the gentlest stage to the firmest: sharpening goes on from one to the next.
        for (which, &(sharpenings, share)) in STAGES.iter().enumerate().rev() {
            while sharpened < sharpenings {
                sharpen(&mut sharp, &lacks);
                sharpened += 1;
            }
            let places = excess.as_mut_slice().iter_mut().zip(sharp.as_slice()).zip(&self.later);
            places
                .filter(|(_, later)| stage + usize::from(**later) == which)
                .for_each(|((excess, sharp), _)| *excess = share * sharp);
        }
        let factor = light::interpolate(&excess, self.per_cell, |d| (-d.clamp(-MOST_CHANGE, MOST_CHANGE)).exp());
        let known = self.light.as_slice().par_iter().zip(factor.as_slice());
        light.as_mut_slice().par_iter_mut().zip(known).for_each(|(light, (known, factor))| *light = known * factor);
        light::normalise(light);
    }
}

/// Sum of the squared differences around every cell.
fn around(seen: &Field<f64>, wanted: &Field<f64>) -> Field<f64> {
    let (nx, ny) = (seen.nx(), seen.ny());
    let mut rows = vec![0.0; nx * ny];
    rows.par_chunks_mut(nx).enumerate().for_each(|(j, out)| {
        let square = |i: usize| (seen[(i, j)] - wanted[(i, j)]).powi(2);
        for (i, out) in out.iter_mut().enumerate() {
            *out = (i.saturating_sub(REACH)..=(i + REACH).min(nx - 1)).map(square).sum();
        }
    });
    let mut sums = vec![0.0; nx * ny];
    sums.par_chunks_mut(nx).enumerate().for_each(|(j, out)| {
        for row in j.saturating_sub(REACH)..=(j + REACH).min(ny - 1) {
            out.iter_mut().zip(&rows[row * nx..]).for_each(|(out, v)| *out += v);
        }
    });
    Field::from_vec(nx, ny, sums)
}

/// One step of van Cittert's iteration, which undoes what interpolation between the centres of
/// cells takes away from the mean over a cell.
///
/// With two nodes per cell the mean over a cell of the interpolant weighs the cell with 3/4 and its
/// neighbours with 1/8, along each axis.
fn sharpen(sharp: &mut Field<f64>, cells: &Field<f64>) {
    let (nx, ny) = (cells.nx(), cells.ny());
    let mut blurred = vec![0.0; nx * ny];
    blurred.par_chunks_mut(nx).enumerate().for_each(|(j, out)| {
        let rows = [sharp.row(j.saturating_sub(1)), sharp.row(j), sharp.row((j + 1).min(ny - 1))];
        let column = |i: usize| 0.75 * rows[1][i] + 0.125 * (rows[0][i] + rows[2][i]);
        for (i, out) in out.iter_mut().enumerate() {
            *out = 0.75 * column(i) + 0.125 * (column(i.saturating_sub(1)) + column((i + 1).min(nx - 1)));
        }
    });
    sharp.as_mut_slice().iter_mut().zip(cells.as_slice()).zip(&blurred).for_each(|((s, c), b)| *s += c - b);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{Extent, Outline};
    use crate::measured::within_tenth_of;

    const CELLS: usize = 40;
    const NODES: usize = 2 * CELLS + 1;

    /// Twice of what was wanted within a place.
    fn seen(wrong: usize) -> Field<f64> {
        let near = |i: usize, j: usize| i.abs_diff(wrong) < 2 && j.abs_diff(wrong) < 2;
        Field::from_fn(CELLS, CELLS, |i, j| if near(i, j) { 2.0 } else { 1.0 })
    }

    fn started(outline: Outline) -> (Correction, Field<f64>) {
        let wanted = Field::filled(CELLS, CELLS, 1.0);
        let contour = outline.within(Extent::new(1.0, 1.0));
        let light = Field::filled(NODES, NODES, 1.0);
        (Correction::new(light, seen(10), &wanted, (2, 2), &contour), wanted)
    }

    /// The light that is tried next, at the middle of a cell.
    fn next(correction: &Correction, wanted: &Field<f64>, stage: usize, cell: usize) -> f64 {
        let mut light = Field::filled(NODES, NODES, 0.0);
        correction.next(wanted, 0.0, stage, &mut light);
        light[(2 * cell + 1, 2 * cell + 1)]
    }

    #[test]
    fn a_place_keeps_the_light_that_drew_it_best_and_is_corrected_more_gently() {
        let (mut correction, wanted) = started(Outline::Rectangle);
        within_tenth_of(0.63, next(&correction, &wanted, 0, 10), "less is asked for where there is too much");
        // Other light is better there, and worse elsewhere.
        correction.learn(&Field::filled(NODES, NODES, 3.0), &seen(30), &wanted);
        let at = |cell: usize| correction.light[(2 * cell + 1, 2 * cell + 1)];
        assert_eq!((at(10), at(30)), (3.0, 1.0));
        let later = |cell: usize| correction.later[cell * CELLS + cell];
        assert_eq!((later(10), later(30)), (0, 1));
    }

    #[test]
    fn corners_that_a_smooth_outline_squeezes_are_corrected_gently_from_the_start() {
        for (outline, gentle) in [(Outline::Rectangle, 0), (Outline::Circle, LAST)] {
            let (correction, _) = started(outline);
            assert_eq!((correction.later[0], correction.later[20 * CELLS + 20]), (gentle, 0), "{outline:?}");
        }
    }
}
