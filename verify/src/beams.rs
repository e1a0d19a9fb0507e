//! Noise-free irradiance: a regular lattice of rays, and the light between them spread over the receiver.

use crate::{
    block::{Block, corners, halves},
    film::{Brush, Film, Flux, Image, Tally, UNIT},
    trace::{End, FromFacet, Path, Row, Tracer},
};
use glam::DVec2;
use rayon::prelude::*;

/// What beam tracing found.
#[derive(Clone, Debug, PartialEq)]
pub struct Beams {
    /// Irradiance; 1 is the light of the aperture spread evenly over the window.
    pub image: Image,
    /// Where the light went.
    pub flux: Flux,
    /// Number of beams.
    pub beams: u64,
}

/// Rows of beams traced by one task: it traces one row of rays more than that.
const ROWS: usize = 32;

/// Cuts the light of the aperture into `nx * ny` beams of equal cross-section, traces their corners, and spreads every beam's power
/// over the area between its four landing points (section 2.1 of the paper, with the power shared by area). Its power is the mean
/// of that at its corners.
///
/// Beams see ideal light and a smooth face: spread and roughness are for photons.
///
/// A beam whose corners went different ways is booked corner by corner. On a smooth surface the error falls with the square
/// of the beams' width: on the caustic of a photograph it was 7.5e-4 of the mean (root mean square over pixels) with 4 x 4
/// beams per pixel, 1.8e-4 with 8 x 8. Between facets the light tears apart, and it falls with the first power. The result
/// is the same, bit by bit, for any number of threads.
///
/// # Panics
/// If there is no beam, or more than 2^30.
pub fn beams(tracer: &Tracer, nx: usize, ny: usize) -> Beams {
    assert!((1..=1usize << 30).contains(&nx.saturating_mul(ny)), "{nx} x {ny} beams");
    let (lower, upper) = tracer.aperture_mm();
    // The ends are exact, so that the outermost rays still meet the border of the face.
    let along = |lo: f64, hi: f64, k: usize, n: usize| {
        let u = k as f64 / n as f64;
        lo * (1.0 - u) + hi * u
    };
    let xs: Vec<f64> = (0..=nx).map(|i| along(lower.x, upper.x, i, nx)).collect();
    let columns = tracer.columns(&xs);
    if columns.is_none() {
        tracer.prepare();
    }
    let film = Film::new(&tracer.scene().window);
    let tally = (0..ny.div_ceil(ROWS))
        .into_par_iter()
        .map(|band| {
            let trace_row = |row: &mut Row, j: usize| {
                let y = along(lower.y, upper.y, j, ny);
                match &columns {
                    Some(columns) => tracer.path_row(columns, y, row),
                    None => {
                        row.paths.clear();
                        row.paths.extend(xs.iter().map(|&x| tracer.path_at(DVec2::new(x, y))));
                    }
                }
            };
            let (mut below, mut above) = (Row::default(), Row::default());
            let (mut tally, mut brush) = (Tally::default(), Brush::on(&film));
            trace_row(&mut below, band * ROWS);
            for j in band * ROWS..ny.min((band + 1) * ROWS) {
                trace_row(&mut above, j + 1);
                if below.lands() && above.lands() {
                    let at = |row: &Row, i: usize| film.in_pixels(row.landings[i]);
                    let (mut a, mut d) = (at(&below, 0), at(&above, 0));
                    for i in 1..=nx {
                        let (b, c) = (at(&below, i), at(&above, i));
                        brush.quadrilateral([a, b, c, d], UNIT, &mut tally);
                        (a, d) = (b, c);
                    }
                } else {
                    for i in 0..nx {
                        let paths = [below.path(i), below.path(i + 1), above.path(i + 1), above.path(i)];
                        book(&film, &mut brush, paths, &mut tally);
                    }
                }
                std::mem::swap(&mut below, &mut above);
            }
            tally
        })
        .reduce(Tally::default, Tally::plus);
    let beams = (nx * ny) as u64;
    Beams { image: film.develop(tally.total()), flux: tally.flux(), beams }
}

/// Cuts the light of a block into one beam for every flat triangle of its exit face, and traces their corners, just inside of
/// them. Parallel light that leaves a plane facet is parallel, and so these beams are exact, where those of [`beams`] reach from one
/// facet to the next; in the light of a point they err as those do on a smooth surface. `tracer` has been made for this block with
/// [`Surface::Facets`](crate::Surface::Facets).
pub fn facet_beams(tracer: &Tracer, block: &Block) -> Beams {
    let (columns, rows) = (block.nx - 1, block.ny - 1);
    let film = Film::new(&tracer.scene().window);
    let lines = tracer.facet_lines();
    if lines.is_none() {
        tracer.prepare();
    }
    let tally = (0..rows)
        .into_par_iter()
        .map(|j| {
            let (mut tally, mut brush) = (Tally::default(), Brush::on(&film));
            for i in 0..columns {
                let nodes = corners(i, j).map(|(i, j)| block.node(i, j).truncate());
                for half in halves(block.diagonals[j * columns + i]) {
                    let corners = half.map(|k| nodes[k]);
                    let centre = corners.iter().sum::<DVec2>() / 3.0;
                    let inside = corners.map(|corner| corner.lerp(centre, INSIDE));
                    let known = lines.as_ref().map(|lines| lines.from((i, j), half, inside));
                    let [a, b, c] = match known {
                        Some(FromFacet::Landings(at)) => {
                            brush.triangle(at.map(|at| film.in_pixels(at)), UNIT, &mut tally);
                            continue;
                        }
                        Some(FromFacet::Paths(paths)) => paths,
                        None => inside.map(|at| tracer.path_at(at)),
                    };
                    // The fourth corner of a quadrilateral, in the middle of an edge.
                    let middle = match (b.end, c.end) {
                        (End::Receiver(p), End::Receiver(q)) => Path { end: End::Receiver(0.5 * (p + q)), ..b },
                        _ => b,
                    };
                    book(&film, &mut brush, [a, b, middle, c], &mut tally);
                }
            }
            tally
        })
        .reduce(Tally::default, Tally::plus);
    // All triangles have the same area as seen by the light: half a cell of a regular grid.
    let beams = 2 * (columns * rows) as u64;
    Beams { image: film.develop(tally.total()), flux: tally.flux(), beams }
}

/// How far inside a triangle its corners are traced, as a part of the way to its centre: far enough that rounding does not
/// find the neighbour, near enough that nobody sees it.
const INSIDE: f64 = 1e-6;

/// Books one beam.
#[inline]
fn book(film: &Film, brush: &mut Brush, paths: [Path; 4], tally: &mut Tally) {
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
    let in_units = |power: f64| (power * UNIT as f64) as u64;
    if together {
        let all = in_units(power);
        let units = in_units(arrives).min(all);
        brush.quadrilateral(landings.map(|at| film.in_pixels(at)), units, tally);
        tally.reflected += u128::from(all - units);
    } else {
        for path in paths {
            let all = in_units(0.25 * path.power);
            let units = in_units(0.25 * path.power * path.transmittance).min(all);
            film.record(path.end, units, tally);
            tally.reflected += u128::from(all - units);
        }
    }
}
