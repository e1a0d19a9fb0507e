//! Takes folds out of a face: where light at a few places is folded over although the picture does
//! not need it, the spline is bent such that those beams turn over again while all light stays as
//! near to where it landed as it can.
//!
//! A triangle of light is folded if its area on the receiver is negative. Around the folds the sum
//! of two squares is minimised over the spline's coefficients: how far the light of every node has
//! moved, and what folded triangles lack of a small positive area, which weighs more and more until
//! none is folded (penalty method; Gauss and Newton's steps by conjugate gradients, halved while
//! they do harm). What matters is the distance: within a pixel light may be spread as it likes.

use crate::{
    bench::Bench,
    forward::{self, land},
    light::Incidence,
    solver::{Event, Progress, SolveError},
    surface::{HeightField, SurfaceSpline},
};
use glam::DVec2;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Area that a folded triangle is given, as a share of what it would have if light were spread
/// evenly.
const OPENED: f64 = 0.05;
/// Triangles below this share count as folded, so that no fold is between the beams that were
/// looked at.
const LEAST: f64 = 0.004;
/// How much the areas weigh at first, the factor by which they then weigh more, and the steps after
/// which they do.
const WEIGHT: f64 = 0.05;
const GROWTH: f64 = 3.0;
const STEPS_EACH: usize = 3;
/// Most steps, products of each, and the least share of a step.
const STEPS: usize = 42;
const PRODUCTS: usize = 60;
const LEAST_STEP: f64 = 0.01;
/// How far from a fold coefficients may change, in nodes, and how far around the light then depends
/// on them.
const FREE: usize = 4;
const REACH: usize = 3;
/// How much farther light from beyond the outline may move.
const BEYOND: f64 = 5.0;
/// Steps of differences: of a height, mm, and of a slope.
const STEP: f64 = 1e-6;

/// The face without the folds in these of its `beams`, given by row and column.
///
/// # Errors
/// A solve that was cancelled.
pub(super) fn unfold(
    surface: &HeightField,
    bench: &Bench,
    beams: (usize, usize),
    folds: &[(usize, usize)],
    progress: &dyn Progress,
) -> Result<HeightField, SolveError> {
    let mut patch = Patch::around(surface, bench, beams, folds);
    let mut weight = WEIGHT;
    for step in 1..=STEPS {
        progress.tell(Event::Iteration)?;
        if !patch.improve(weight) {
            break;
        }
        if step % STEPS_EACH == 0 {
            weight *= GROWTH;
        }
    }
    Ok(surface.with_heights(patch.spline.heights_mm()))
}

fn twice_area([a, b, c]: [DVec2; 3]) -> f64 {
    (b - a).perp_dot(c - a)
}

/// The surroundings of folds.
struct Patch<'a> {
    bench: &'a Bench,
    light: Incidence<'a>,
    spline: SurfaceSpline,
    /// Places of the coefficients that may change, and their numbers among the unknowns.
    free: BTreeMap<usize, usize>,
    /// Triangles of light: where they leave the block, mm, and twice their area on the receiver if
    /// light were spread evenly, mm^2.
    triangles: Vec<([DVec2; 3], f64)>,
    nodes: Vec<Node>,
}

/// A node of the lens.
struct Node {
    /// Its place on the block, mm, and where its light landed at first, mm.
    at: DVec2,
    landing: DVec2,
    /// How far from there it counts as much as a triangle without area, mm: the side of a node's
    /// area on the receiver, and more beyond the outline.
    distance_mm: f64,
}

/// A linear equation for the change of the unknowns: `sum derivatives change = lacks`.
struct Row {
    derivatives: Vec<(usize, f64)>,
    lacks: f64,
}

impl<'a> Patch<'a> {
    fn around(surface: &HeightField, bench: &'a Bench, beams: (usize, usize), folds: &[(usize, usize)]) -> Self {
        let spline = SurfaceSpline::through(surface);
        let (nx, ny) = spline.nodes();
        let per_node = (beams.0.div_ceil(nx - 1), beams.1.div_ceil(ny - 1));
        let near = |nodes: usize| -> BTreeSet<(usize, usize)> {
            let (x, y) = (nodes * per_node.0, nodes * per_node.1);
            let mut found = BTreeSet::new();
            for &(row, column) in folds {
                for row in row.saturating_sub(y)..(row + y + 1).min(beams.1) {
                    found.extend((column.saturating_sub(x)..(column + x + 1).min(beams.0)).map(|column| (row, column)));
                }
            }
            found
        };
        let mut free = BTreeMap::new();
        for (row, column) in near(FREE) {
            forward::triangles(bench, beams, (column, row), |corners| {
                spline.gradient(corners[0], 0.0, DVec2::ZERO, |place, _| {
                    free.insert(place, 0);
                });
            });
        }
        free.values_mut().enumerate().for_each(|(number, place)| *place = number);
        let share = bench.window().area_mm2() / (bench.block().area_mm2() * bench.contour().share_of_extent());
        let (mut triangles, mut nodes) = (Vec::new(), BTreeSet::new());
        for (row, column) in near(FREE + REACH) {
            nodes.insert((row / per_node.1, column / per_node.0));
            forward::triangles(bench, beams, (column, row), |corners| {
                let even = share * twice_area(corners);
                if even > 0.0 {
                    triangles.push((corners, even));
                }
            });
        }
        let distance_mm = (share * bench.block().node_spacing(nx, ny).element_product()).sqrt();
        let mut patch = Self { bench, light: bench.incidence(), spline, free, triangles, nodes: Vec::new() };
        let contour = bench.contour();
        let nodes = nodes.into_iter().map(|(row, column)| bench.block().node(column, row, nx, ny));
        patch.nodes = nodes
            .map(|at| {
                // Light from the side comes through what is beyond the outline.
                let lit = contour.is_rectangle() || contour.contains(at);
                let distance_mm = if lit { distance_mm } else { BEYOND * distance_mm };
                Node { at, landing: patch.landing(&patch.spline, at), distance_mm }
            })
            .filter(|node| node.landing.is_finite())
            .collect();
        patch
    }

    /// Where light that leaves from the point of the block lands, mm.
    fn landing(&self, spline: &SurfaceSpline, at: DVec2) -> DVec2 {
        let sample = spline.sample(at);
        self.landing_of(at, sample.height_mm, sample.slope)
    }

    /// The same for a face of this height and slope there.
    fn landing_of(&self, at: DVec2, height_mm: f64, slope: DVec2) -> DVec2 {
        let from = at.extend(height_mm);
        land(&self.light.at(from), self.bench, from, slope)
    }

    /// What a triangle lacks of the wanted area, and whether it counts as folded. Nothing where
    /// light is reflected.
    fn lack(&self, spline: &SurfaceSpline, &(corners, even): &([DVec2; 3], f64)) -> (f64, bool) {
        let share = twice_area(corners.map(|at| self.landing(spline, at))) / even;
        if share < OPENED { (OPENED - share, share < LEAST) } else { (0.0, false) }
    }

    /// What every triangle lacks.
    fn lacks(&self, spline: &SurfaceSpline) -> Vec<(f64, bool)> {
        self.triangles.par_iter().map(|triangle| self.lack(spline, triangle)).collect()
    }

    /// The sum that is minimised.
    fn cost(&self, spline: &SurfaceSpline, lacks: &[(f64, bool)], weight: f64) -> f64 {
        let moved = |node: &Node| ((self.landing(spline, node.at) - node.landing) / node.distance_mm).length_squared();
        let moved: Vec<f64> = self.nodes.par_iter().map(moved).collect();
        moved.iter().sum::<f64>() + weight * lacks.iter().map(|(lack, _)| lack.powi(2)).sum::<f64>()
    }

    /// One step; returns whether anything was folded before it.
    fn improve(&mut self, weight: f64) -> bool {
        let lacks = self.lacks(&self.spline);
        if !lacks.iter().any(|(_, folded)| *folded) {
            return false;
        }
        let areas = self.triangles.par_iter().zip(&lacks).filter(|(_, (lack, _))| *lack > 0.0);
        let mut rows: Vec<Row> = areas.map(|(triangle, (lack, _))| self.area(triangle, *lack, weight.sqrt())).collect();
        rows.par_extend(self.nodes.par_iter().flat_map_iter(|node| self.distance(node)));
        let change = least_squares(&rows, self.free.len());
        let before = self.cost(&self.spline, &lacks, weight);
        let mut step = 1.0;
        self.spline = loop {
            let mut next = self.spline.clone();
            next.change(self.free.iter().map(|(&place, &number)| (place, step * change[number])));
            if step < LEAST_STEP || self.cost(&next, &self.lacks(&next), weight) < before {
                break next;
            }
            step *= 0.5;
        };
        true
    }

    /// Derivatives of a point's landing by its height and by its slope along x and y.
    fn derivatives(&self, at: DVec2) -> (DVec2, [DVec2; 3]) {
        let sample = self.spline.sample(at);
        let here = self.landing_of(at, sample.height_mm, sample.slope);
        let by = |height_mm: f64, slope: DVec2| {
            (self.landing_of(at, sample.height_mm + height_mm, sample.slope + slope) - here) / STEP
        };
        (here, [by(STEP, DVec2::ZERO), by(0.0, DVec2::X * STEP), by(0.0, DVec2::Y * STEP)])
    }

    /// Adds the derivatives of `along . landing` by the unknowns to a row.
    fn add(&self, row: &mut Row, at: DVec2, along: DVec2, by: [DVec2; 3]) {
        let [of_height, x, y] = by.map(|derivative| derivative.dot(along));
        self.spline.gradient(at, of_height, DVec2::new(x, y), |place, derivative| {
            let Some(&number) = self.free.get(&place) else { return };
            match row.derivatives.iter_mut().find(|(known, _)| *known == number) {
                Some((_, sum)) => *sum += derivative,
                None => row.derivatives.push((number, derivative)),
            }
        });
    }

    /// The equation for the area of a triangle, scaled.
    fn area(&self, &(corners, even): &([DVec2; 3], f64), lack: f64, scale: f64) -> Row {
        let mut row = Row { derivatives: Vec::with_capacity(36), lacks: scale * lack };
        let known = corners.map(|at| self.derivatives(at));
        for (k, at) in corners.into_iter().enumerate() {
            // The area grows with the distance of a corner from the opposite side.
            let opposite = known[(k + 2) % 3].0 - known[(k + 1) % 3].0;
            self.add(&mut row, at, opposite.perp() * (scale / even), known[k].1);
        }
        row
    }

    /// The equations that take the light of a node back to where it landed, along x and y.
    fn distance(&self, &Node { at, landing, distance_mm }: &Node) -> [Row; 2] {
        let (here, by) = self.derivatives(at);
        [DVec2::X, DVec2::Y].map(|axis| {
            let along = axis / distance_mm;
            let mut row = Row { derivatives: Vec::with_capacity(16), lacks: (landing - here).dot(along) };
            self.add(&mut row, at, along, by);
            row
        })
    }
}

/// The least squares of these equations, by conjugate gradients on the normal equations from 0.
fn least_squares(rows: &[Row], unknowns: usize) -> Vec<f64> {
    let transposed = |values: &[f64]| {
        let mut sums = vec![0.0; unknowns];
        for (row, value) in rows.iter().zip(values) {
            row.derivatives.iter().for_each(|&(number, derivative)| sums[number] += derivative * value);
        }
        sums
    };
    let squares = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>();
    let mut found = vec![0.0; unknowns];
    let mut lacks: Vec<f64> = rows.iter().map(|row| row.lacks).collect();
    let mut gradient = transposed(&lacks);
    let mut direction = gradient.clone();
    let mut size = squares(&gradient);
    for _ in 0..PRODUCTS {
        let product = |row: &Row| row.derivatives.iter().map(|&(number, of)| of * direction[number]).sum();
        let moved: Vec<f64> = rows.par_iter().map(product).collect();
        let step = size / squares(&moved);
        if !step.is_finite() {
            break;
        }
        found.iter_mut().zip(&direction).for_each(|(found, d)| *found += step * d);
        lacks.iter_mut().zip(&moved).for_each(|(lacks, moved)| *lacks -= step * moved);
        gradient = transposed(&lacks);
        let next = squares(&gradient);
        direction.iter_mut().zip(&gradient).for_each(|(d, g)| *d = g + next / size * *d);
        size = next;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::at_worst;
    use crate::{
        bench::ExitFace,
        forward::{Caustic, Geometry},
        grid::{Extent, Field, Outline},
        solver::Silent,
    };

    const SIDE: f64 = 20.0;
    const NODES: usize = 61;
    const BEAMS: (usize, usize) = (120, 120);

    fn seen(surface: &HeightField, bench: &Bench) -> Caustic {
        forward::irradiance(&SurfaceSpline::through(surface), bench, Geometry::Displaced, BEAMS, (20, 20))
    }

    /// A weak lens with dents that fold light.
    fn dented(outline: Outline, dents: &[(usize, usize)]) -> (HeightField, Bench) {
        let extent = Extent::new(SIDE, SIDE);
        let bench = Bench::new(extent, 60.0, ExitFace::Refracts { ior: 1.5 }).unwrap().with_outline(outline).unwrap();
        let mut heights = Field::from_fn(NODES, NODES, |i, j| -2e-3 * extent.node(i, j, NODES, NODES).length_squared());
        dents.iter().for_each(|&(i, j)| heights[(i, j)] -= 4e-3);
        (HeightField::outlined(extent, outline, heights), bench)
    }

    #[test]
    fn dents_lose_their_folds_and_light_stays_where_it_was() {
        for (outline, dents) in [
            (Outline::Rectangle, [(30, 30), (32, 30), (1, 20)]),
            // One on the rim, where beams are cut.
            (Outline::Circle, [(30, 30), (10, 30), (9, 9)]),
        ] {
            let (surface, bench) = dented(outline, &dents);
            let before = seen(&surface, &bench);
            assert!(before.folded > 1e-4 && before.folds.len() > 10, "{}", before.folded);
            let after = unfold(&surface, &bench, BEAMS, &before.folds, &Silent).unwrap();
            assert_eq!(seen(&after, &bench).folds, [], "{outline:?}");
            let (old, new) = (SurfaceSpline::through(&surface), SurfaceSpline::through(&after));
            let patch = Patch::around(&surface, &bench, BEAMS, &[]);
            let mut furthest = 0.0_f64;
            for j in 0..NODES {
                for i in 0..NODES {
                    let at = bench.block().node(i, j, NODES, NODES);
                    if !(bench.contour().is_rectangle() || bench.contour().contains(at)) {
                        continue;
                    }
                    let moved = (patch.landing(&old, at) - patch.landing(&new, at)).length();
                    furthest = furthest.max(moved);
                    let near = dents.iter().any(|dent| dent.0.abs_diff(i).max(dent.1.abs_diff(j)) < 14);
                    // The mean of all heights moves a little.
                    assert!(near || moved < 1e-5, "{i}, {j}: {moved} mm");
                }
            }
            // A pixel is 1 mm.
            at_worst(0.37, furthest, format_args!("{outline:?}"));
        }
    }

    #[test]
    fn least_squares_meet_equations_that_can_be_met() {
        let row = |derivatives: &[(usize, f64)], lacks: f64| Row { derivatives: derivatives.to_vec(), lacks };
        let rows = [row(&[(0, 2.0), (1, 1.0)], 4.0), row(&[(1, 3.0)], 6.0), row(&[(0, 1.0), (2, -1.0)], 0.0)];
        let found = least_squares(&rows, 3);
        assert!(found.iter().zip([1.0, 2.0, 1.0]).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}");
        assert_eq!(least_squares(&[], 2), [0.0; 2]);
    }
}
