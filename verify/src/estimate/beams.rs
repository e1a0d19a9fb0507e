//! Noise-free irradiance: a regular lattice of rays, and the light between them spread over the
//! receiver.

use super::{
    film::Film,
    flux::{Flux, PowerTally, UNIT},
    rasteriser::Rasteriser,
};
use crate::{
    block::{Block, corners, halves},
    image::Image,
    trace::{End, FromFacet, RayPath, RayRow, Tracer},
};
use glam::DVec2;
use rayon::prelude::*;
use std::mem::{discriminant, swap};

/// What beam tracing found.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Beams {
    /// Irradiance; 1 is the light of the aperture spread evenly over the window.
    pub image: Image,
    /// Where the light went.
    pub flux: Flux,
    /// Of every block of a row, in the order in which light meets them, where it ended there; of
    /// any other solid one.
    pub losses: Vec<Losses>,
    /// Number of beams.
    pub beams: u64,
}

/// The light that ends at one block of a row, as parts of the light of the aperture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Losses {
    /// Is totally reflected inside of it.
    pub totally_reflected: f64,
    /// Meets a side wall of it, or its rim, or itself again; of the last block also what never
    /// reaches the receiver.
    pub side: f64,
    /// Passes beside it.
    pub beside: f64,
}

/// Most beams in all, for whose power the fixed-point sums have room, and most along a side.
pub const MOST_BEAMS: usize = 1 << 30;
const MOST_ALONG: usize = 1 << 18;

/// Numbers of beams along both sides that can be traced, in the ratio of those that are asked for
/// as far as whole numbers allow.
fn at_most(nx: usize, ny: usize) -> (usize, usize) {
    let (nx, ny) = (nx.clamp(1, MOST_ALONG), ny.clamp(1, MOST_ALONG));
    let excess = nx as f64 * ny as f64 / MOST_BEAMS as f64;
    if excess <= 1.0 {
        return (nx, ny);
    }
    let reduced = |n: usize| ((n as f64 / excess.sqrt()) as usize).max(1);
    (reduced(nx), reduced(ny))
}

/// Rows of beams traced by one task: it traces one row of rays more than that.
const ROWS: usize = 32;

/// Cuts the light of the aperture into `nx * ny` beams of equal cross-section, traces their
/// corners, and spreads every beam's power over the area between its four landing points (section
/// 2.1 of the paper, with the power shared by area). Its power is the mean of that at its corners.
///
/// Beams see ideal light and a smooth face: extended sources and roughness are for photons.
///
/// A beam that the border of the light cuts, or that of a shadow of the solid's own walls, is cut
/// into smaller ones. One whose corners still went different ways is recorded corner by corner. On
/// a smooth surface the error falls with the square of the beams' width: on the caustic of a
/// photograph it was 7.5e-4 of the mean (root mean square over pixels) with 4 x 4 beams per pixel,
/// 1.8e-4 with 8 x 8. Between facets the light tears apart, and it falls with the first power. The
/// result is the same, bit by bit, for any number of threads.
///
/// There is one at least, and there are [`MOST_BEAMS`] at most: where more are asked for, both
/// numbers are reduced alike, and [`Beams::beams`] says how many there were.
pub fn beams(tracer: &Tracer, nx: usize, ny: usize) -> Beams {
    let (nx, ny) = at_most(nx, ny);
    let (lower, upper) = tracer.aperture_mm();
    // The ends are exact, so that the outermost rays still meet the border of the face.
    let along = |lo: f64, hi: f64, k: usize, n: usize| {
        let u = k as f64 / n as f64;
        lo * (1.0 - u) + hi * u
    };
    let xs: Vec<f64> = (0..=nx).map(|i| along(lower.x, upper.x, i, nx)).collect();
    let columns = tracer.columns(&xs);
    tracer.prepare_beams(columns.is_some());
    let film = Film::new(&tracer.scene().window);
    let tally = (0..ny.div_ceil(ROWS))
        .into_par_iter()
        .map(|band| {
            let trace_row = |row: &mut RayRow, j: usize| {
                let y = along(lower.y, upper.y, j, ny);
                match &columns {
                    Some(columns) => tracer.path_row(columns, y, row),
                    None => {
                        row.paths.clear();
                        row.paths.extend(xs.iter().map(|&x| tracer.path_at(DVec2::new(x, y))));
                    }
                }
            };
            let (mut below, mut above) = (RayRow::default(), RayRow::default());
            let recorder = BeamRecorder::on(&film, tracer);
            let mut recorder = BeamRecorder { rays_left: CUT_RAYS * (nx + ROWS), ..recorder };
            trace_row(&mut below, band * ROWS);
            for j in band * ROWS..ny.min((band + 1) * ROWS) {
                trace_row(&mut above, j + 1);
                if below.lands() && above.lands() {
                    let at = |row: &RayRow, i: usize| film.in_pixels(row.landings[i]);
                    let (mut a, mut d) = (at(&below, 0), at(&above, 0));
                    for i in 1..=nx {
                        let (b, c) = (at(&below, i), at(&above, i));
                        recorder.rasteriser.quadrilateral([a, b, c, d], UNIT, &mut recorder.landed);
                        (a, d) = (b, c);
                    }
                } else {
                    let (low, high) = (along(lower.y, upper.y, j, ny), along(lower.y, upper.y, j + 1, ny));
                    for i in 0..nx {
                        let paths = [below.path(i), below.path(i + 1), above.path(i + 1), above.path(i)];
                        let ends = (DVec2::new(xs[i], low), DVec2::new(xs[i + 1], high));
                        recorder.cut_beam(tracer, ends, paths, CUTS, 1.0);
                    }
                }
                swap(&mut below, &mut above);
            }
            recorder.tally()
        })
        .reduce(Tally::default, Tally::plus);
    tally.beams(film, (nx * ny) as u64)
}

/// Cuts the light of a block into one beam for every flat triangle of its exit face, and traces
/// their corners, just inside of them. Parallel light that leaves a plane facet is parallel, and so
/// these beams are exact, where those of [`beams`] reach from one facet to the next; in the light
/// of a point they err as those do on a smooth surface. `tracer` has been made for this block with
/// [`Surface::Facets`](crate::Surface::Facets). Behind other blocks light comes to no facet parallel:
/// there these are [`beams`], four to a cell.
pub fn facet_beams(tracer: &Tracer, block: &Block) -> Beams {
    let (columns, rows) = (block.exit.nx - 1, block.exit.ny - 1);
    if tracer.blocks() > 1 {
        return beams(tracer, 2 * columns, 2 * rows);
    }
    let film = Film::new(&tracer.scene().window);
    let lines = tracer.facet_lines();
    tracer.prepare_beams(lines.is_some());
    let tally = (0..rows)
        .into_par_iter()
        .map(|j| {
            let mut recorder = BeamRecorder::on(&film, tracer);
            for i in 0..columns {
                let nodes = corners(i, j).map(|(i, j)| block.exit.node(i, j).truncate());
                for half in halves(block.exit.diagonals[j * columns + i]) {
                    let corners = half.map(|k| nodes[k]);
                    let centre = corners.iter().sum::<DVec2>() / 3.0;
                    let inside = corners.map(|corner| corner.lerp(centre, INSIDE));
                    let known = lines.as_ref().map(|lines| lines.from((i, j), half, inside));
                    let [a, b, c] = match known {
                        Some(FromFacet::Landings(at)) => {
                            recorder.rasteriser.triangle(at.map(|at| film.in_pixels(at)), UNIT, &mut recorder.landed);
                            continue;
                        }
                        Some(FromFacet::Paths(paths)) => paths,
                        None => inside.map(|at| tracer.path_at(at)),
                    };
                    // The fourth corner of a quadrilateral, in the middle of an edge.
                    let middle = match (b.end, c.end) {
                        (End::Receiver(p), End::Receiver(q)) => RayPath { end: End::Receiver(0.5 * (p + q)), ..b },
                        _ => b,
                    };
                    recorder.beam([a, b, middle, c], 1.0);
                }
            }
            recorder.tally()
        })
        .reduce(Tally::default, Tally::plus);
    // All triangles have the same area as seen by the light: half a cell of a regular grid.
    tally.beams(film, 2 * (columns * rows) as u64)
}

/// How far inside a triangle its corners are traced, as a part of the way to its centre: far enough
/// that rounding does not find the neighbour, near enough that nobody sees it.
const INSIDE: f64 = 1e-6;

/// How often a beam is halved along both axes where the border of the light cuts it, or where a
/// part of it ends elsewhere: the border is then known to a sixteenth of a beam.
const CUTS: u32 = 4;

/// Rays that cutting may take in a band of beams, for each of its columns and rows: a border
/// through all columns takes about 75, and the band itself takes [`ROWS`]. Without this bound, beams
/// through a face of random heights took 36 times as long as without any cut; with it, 12 times.
const CUT_RAYS: usize = 128;

/// Whether a part of a beam is dark, or ends elsewhere, and not all of it.
#[inline]
fn is_cut([first, others @ ..]: &[RayPath; 4]) -> bool {
    let kind = |path: &RayPath| (path.power == 0.0, discriminant(&path.end));
    others.iter().any(|path| kind(path) != kind(first))
}

/// Power by fate, and by the block at which it ended.
#[derive(Clone, Debug, Default)]
struct Tally {
    /// Of every block; none before there is any light.
    ended: Vec<PowerTally>,
}

impl Tally {
    fn plus(mut self, other: Self) -> Self {
        self.ended.resize(self.ended.len().max(other.ended.len()), PowerTally::default());
        self.ended.iter_mut().zip(other.ended).for_each(|(sum, ended)| *sum = sum.plus(ended));
        self
    }

    fn beams(self, film: Film, beams: u64) -> Beams {
        let all = self.ended.iter().fold(PowerTally::default(), |sum, ended| sum.plus(*ended));
        let part = |units: u128| units as f64 / all.total().max(1) as f64;
        let losses = |of: &PowerTally| Losses {
            totally_reflected: part(of.totally_reflected),
            side: part(of.side),
            beside: part(of.beside),
        };
        let losses = self.ended.iter().map(losses).collect();
        Beams { image: film.develop(all.total()), flux: all.flux(), losses, beams }
    }
}

/// Where beams are recorded.
struct BeamRecorder<'a> {
    film: &'a Film,
    rasteriser: Rasteriser<'a>,
    /// Of beams that land as a whole.
    landed: PowerTally,
    /// Of all others, by the block at which they end.
    ended: Vec<PowerTally>,
    /// How many rays may still be traced to cut beams.
    rays_left: usize,
}

impl<'a> BeamRecorder<'a> {
    fn on(film: &'a Film, tracer: &Tracer) -> Self {
        let ended = vec![PowerTally::default(); tracer.blocks()];
        Self { film, rasteriser: Rasteriser::on(film), landed: PowerTally::default(), ended, rays_left: 0 }
    }

    /// All that was recorded. What lands has passed the last block.
    fn tally(mut self) -> Tally {
        if let Some(last) = self.ended.last_mut() {
            *last = last.plus(self.landed);
        }
        Tally { ended: self.ended }
    }

    /// Records a share of a beam between two corners; if the border of the light cuts it, in
    /// quarters, and those again, as often as `cuts` says. Paths are counter-clockwise from
    /// `lower`.
    fn cut_beam(
        &mut self,
        tracer: &Tracer,
        (lower, upper): (DVec2, DVec2),
        paths: [RayPath; 4],
        cuts: u32,
        share: f64,
    ) {
        let middle = 0.5 * (lower + upper);
        let between = [
            DVec2::new(lower.x, middle.y),
            DVec2::new(upper.x, middle.y),
            DVec2::new(middle.x, lower.y),
            DVec2::new(middle.x, upper.y),
            middle,
        ];
        if cuts == 0 || self.rays_left < between.len() || !is_cut(&paths) {
            self.beam(paths, share);
            return;
        }
        self.rays_left -= between.len();
        let [left, right, below, above, centre] = between.map(|at| tracer.path_at(at));
        let [a, b, c, d] = paths;
        for (ends, paths) in [
            ((lower, middle), [a, below, centre, left]),
            ((DVec2::new(middle.x, lower.y), DVec2::new(upper.x, middle.y)), [below, b, right, centre]),
            ((middle, upper), [centre, right, c, above]),
            ((DVec2::new(lower.x, middle.y), DVec2::new(middle.x, upper.y)), [left, centre, above, d]),
        ] {
            self.cut_beam(tracer, ends, paths, cuts - 1, 0.25 * share);
        }
    }

    /// Records a share of one beam.
    #[inline]
    fn beam(&mut self, paths: [RayPath; 4], share: f64) {
        let Self { film, rasteriser, landed, ended, .. } = self;
        let mut landings = [DVec2::ZERO; 4];
        let mut together = true;
        let (mut power, mut arrives) = (0.0, 0.0);
        for (landing, path) in landings.iter_mut().zip(&paths) {
            power += 0.25 * path.power;
            arrives += 0.25 * path.power * path.transmittance;
            match path.end {
                End::Receiver(at) if path.signature == paths[0].signature => *landing = at,
                _ => together = false,
            }
        }
        let in_units = |power: f64| (power * share * UNIT as f64) as u64;
        if together {
            let all = in_units(power);
            let units = in_units(arrives).min(all);
            rasteriser.quadrilateral(landings.map(|at| film.in_pixels(at)), units, landed);
            landed.reflected += u128::from(all - units);
        } else {
            for path in paths {
                let all = in_units(0.25 * path.power);
                let units = in_units(0.25 * path.power * path.transmittance).min(all);
                let tally = &mut ended[path.block as usize];
                film.record(path.end, units, tally);
                tally.reflected += u128::from(all - units);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_beams_are_taken_as_they_are_or_reduced_alike() {
        for (asked, taken) in [
            ((0, 0), (1, 1)),
            ((640, 480), (640, 480)),
            ((1 << 15, 1 << 15), (1 << 15, 1 << 15)),
            ((1 << 16, 1 << 16), (1 << 15, 1 << 15)),
            ((1 << 15, 1 << 17), (1 << 14, 1 << 16)),
            ((usize::MAX, 1), (1 << 18, 1)),
        ] {
            assert_eq!(at_most(asked.0, asked.1), taken, "{asked:?}");
        }
        let (nx, ny) = at_most(usize::MAX, usize::MAX);
        assert!(nx == ny && nx * ny <= MOST_BEAMS);
    }
}
