//! A block that is not rectangular: the vertices on its outline, and the smooth face between the
//! last nodes of its grid and them.
//!
//! Within the outline the vertices of the exit face are nodes of a regular grid; those on the
//! outline are where the face meets the side wall. The spline through the nodes needs nodes beyond:
//! each is that of a cubic fitted to the nodes and outline vertices around, then moved by what the
//! spline still misses on the outline. On a smooth face the slope between the last nodes and the
//! outline is met to the third order of the spacing.

use crate::{mesh::Mesh, spline::Bicubic};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// Layers of nodes that are fitted; what lies beyond hardly counts within.
const LAYERS: usize = 5;
/// How much further than the outline the fit of a node reaches, and the width of its weights there,
/// spacings.
const REACH: f64 = 3.5;
const WIDTH: f64 = 1.0;
/// Rounds in which nodes beyond the outline are moved by what the spline misses.
const ROUNDS: usize = 2;
/// Coefficients of a cubic in two variables.
const TERMS: usize = 10;

/// Rounding of coordinates in files, as a part of the size of a block.
const SLACK: f64 = 1e-6;

/// The closed curve of vertices around the exit face.
#[derive(Clone, Debug)]
pub(crate) struct Outline {
    /// Counter-clockwise by the angle around `centre`, mm.
    points: Vec<DVec3>,
    angles: Vec<f64>,
    centre: DVec2,
    /// What is nearer to the curve than this lies within: straight sides run through nodes and
    /// rays, which rounding shall not decide upon.
    slack_mm: f64,
    /// Which nodes of the grid the file has.
    pub(crate) known: Vec<bool>,
}

/// The vertices above the entry face that belong to a triangle with vertices in it: the upper ends
/// of the walls.
pub(crate) fn wall_tops(mesh: &Mesh, in_entry: impl Fn(u32) -> bool) -> Vec<bool> {
    let mut tops = vec![false; mesh.vertices.len()];
    for triangle in &mesh.triangles {
        if triangle.iter().any(|&v| in_entry(v)) {
            triangle.iter().filter(|&&v| !in_entry(v)).for_each(|&v| tops[v as usize] = true);
        }
    }
    tops
}

impl Outline {
    /// Puts the points in order. None if they do not go once around their middle.
    pub(crate) fn new(mut points: Vec<DVec3>, known: Vec<bool>) -> Option<Self> {
        if points.len() < 3 {
            return None;
        }
        let empty = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let (lo, hi) = points.iter().fold(empty, |(lo, hi), p| (lo.min(p.truncate()), hi.max(p.truncate())));
        let centre = 0.5 * (lo + hi);
        points.sort_by(|a, b| (a.truncate() - centre).to_angle().total_cmp(&(b.truncate() - centre).to_angle()));
        let angles: Vec<f64> = points.iter().map(|p| (p.truncate() - centre).to_angle()).collect();
        let slack_mm = SLACK * (hi - lo).max_element();
        let border = Self { points, angles, centre, slack_mm, known };
        let turns = (0..border.points.len()).all(|k| {
            let (a, b) = border.segment(k);
            (a - centre).perp_dot(b - centre) > 0.0
        });
        turns.then_some(border)
    }

    /// The points in order, mm.
    pub(crate) fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// The same curve on another face, which has other nodes and other heights.
    pub(crate) fn with_face(&self, known: Vec<bool>, height: impl Fn(DVec2) -> f64) -> Self {
        let points = self.points.iter().map(|p| p.truncate().extend(height(p.truncate()))).collect();
        Self { points, known, ..self.clone() }
    }

    /// Heights of the points, mm.
    pub(crate) fn heights(&self) -> impl Iterator<Item = f64> {
        self.points.iter().map(|p| p.z)
    }

    fn segment(&self, k: usize) -> (DVec2, DVec2) {
        (self.points[k].truncate(), self.points[(k + 1) % self.points.len()].truncate())
    }

    /// Whether a point lies within the polygon.
    #[inline]
    pub(crate) fn covers(&self, at: DVec2) -> bool {
        let after = self.angles.partition_point(|&angle| angle <= (at - self.centre).to_angle());
        let (a, b) = self.segment((after + self.points.len() - 1) % self.points.len());
        (b - a).perp_dot(at - a) >= -self.slack_mm * (b - a).length()
    }

    /// Gives heights to the nodes of the grid that the file has not, from those that it has and
    /// from the border.
    pub(crate) fn complete(&self, heights: &mut [f64], (nx, ny): (usize, usize), lower: DVec2, upper: DVec2) {
        let layer = extrapolate(heights, &self.known, (nx, ny));
        let spacing = (upper - lower) / DVec2::new((nx - 1) as f64, (ny - 1) as f64);
        let places: Vec<DVec2> = self.points.iter().map(|p| (p.truncate() - lower) / spacing).collect();
        let mut buckets: Vec<Vec<u32>> = vec![Vec::new(); nx * ny];
        for (k, place) in places.iter().enumerate() {
            let at = place.round().clamp(DVec2::ZERO, DVec2::new((nx - 1) as f64, (ny - 1) as f64));
            buckets[at.y as usize * nx + at.x as usize].push(k as u32);
        }
        let node = |k: usize| DVec2::new((k % nx) as f64, (k / nx) as f64);
        let movable: Vec<usize> = (0..nx * ny).filter(|&k| (1..=LAYERS).contains(&layer[k])).collect();
        // Fitted heights, and the share of every outline vertex's miss that moves the node.
        let fitted: Vec<(f64, Vec<(u32, f64)>)> = movable
            .par_iter()
            .map(|&k| {
                let at = node(k);
                let reach = layer[k] + REACH.ceil() as usize + 1;
                let near = |at: usize, n: usize| at.saturating_sub(reach)..=(at + reach).min(n - 1);
                let around: Vec<usize> =
                    near(k / nx, ny).flat_map(|j| near(k % nx, nx).map(move |i| j * nx + i)).collect();
                let outline: Vec<u32> = around.iter().flat_map(|&k| &buckets[k]).copied().collect();
                let distance =
                    outline.iter().map(|&p| places[p as usize].distance(at)).fold(f64::INFINITY, f64::min).min(20.0);
                let nodes = around.iter().filter(|&&k| self.known[k]).map(|&k| (node(k), heights[k]));
                let ends = outline.iter().map(|&p| (places[p as usize], self.points[p as usize].z));
                let samples = nodes.chain(ends).map(|(place, z)| (place - at, z));
                let height = cubic_at_origin(samples, distance + REACH, distance + WIDTH).unwrap_or(heights[k]);
                let width = 0.6 + 0.5 * distance;
                let mut shares: Vec<(u32, f64)> = outline
                    .iter()
                    .map(|&p| (p, (-0.5 * places[p as usize].distance_squared(at) / (width * width)).exp()))
                    .filter(|(_, weight)| *weight > 1e-4)
                    .collect();
                let sum: f64 = shares.iter().map(|(_, weight)| weight).sum();
                shares.iter_mut().for_each(|(_, weight)| *weight /= sum);
                (height, shares)
            })
            .collect();
        movable.iter().zip(&fitted).for_each(|(&k, (height, _))| heights[k] = *height);
        for _ in 0..ROUNDS {
            let spline = Bicubic::through(heights, nx, ny, lower.to_array(), upper.to_array());
            let misses: Vec<f64> = self.points.iter().map(|p| p.z - spline.jet(p.x, p.y).z).collect();
            for (&k, (_, shares)) in movable.iter().zip(&fitted) {
                heights[k] += shares.iter().map(|&(p, share)| share * misses[p as usize]).sum::<f64>();
            }
        }
    }
}

/// The value at the origin of the cubic that fits samples best, those within `reach` with Gaussian
/// weights of this width. None if they do not determine it.
fn cubic_at_origin(samples: impl Iterator<Item = (DVec2, f64)>, reach: f64, width: f64) -> Option<f64> {
    let (mut matrix, mut right) = ([[0.0; TERMS]; TERMS], [0.0; TERMS]);
    let mut count = 0;
    for (p, z) in samples.filter(|(p, _)| p.length() <= reach) {
        let weight = (-p.length_squared() / (width * width)).exp();
        let (x, y) = (p.x / reach, p.y / reach);
        let terms = [1.0, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y];
        for (row, a) in terms.iter().enumerate() {
            right[row] += weight * a * z;
            for (column, b) in terms.iter().enumerate().take(row + 1) {
                matrix[row][column] += weight * a * b;
            }
        }
        count += 1;
    }
    if count < TERMS {
        return None;
    }
    // Cholesky's decomposition of the normal equations, in place.
    for row in 0..TERMS {
        for column in 0..=row {
            let sum: f64 = (0..column).map(|k| matrix[row][k] * matrix[column][k]).sum();
            let rest = matrix[row][column] - sum;
            matrix[row][column] = if row > column {
                rest / matrix[column][column]
            } else if rest > 1e-14 * matrix[row][row] {
                rest.sqrt()
            } else {
                return None;
            };
        }
    }
    for row in 0..TERMS {
        let sum: f64 = (0..row).map(|k| matrix[row][k] * right[k]).sum();
        right[row] = (right[row] - sum) / matrix[row][row];
    }
    for row in (0..TERMS).rev() {
        let sum: f64 = (row + 1..TERMS).map(|k| matrix[k][row] * right[k]).sum();
        right[row] = (right[row] - sum) / matrix[row][row];
    }
    Some(right[0])
}

/// Extrapolates layer by layer, with parabolas along rows, columns and diagonals; returns in which
/// layer every node lies, 0 for those that are known. Beyond the last layer nodes get the mean of
/// their neighbours.
fn extrapolate(heights: &mut [f64], known: &[bool], (nx, ny): (usize, usize)) -> Vec<usize> {
    const UNSEEN: usize = usize::MAX;
    let mut layer: Vec<usize> = known.iter().map(|&known| if known { 0 } else { UNSEEN }).collect();
    let mut front: Vec<usize> = (0..nx * ny).filter(|&k| layer[k] == UNSEEN).collect();
    for depth in 1.. {
        let mut found = Vec::new();
        for &k in &front {
            let (i, j) = ((k % nx) as isize, (k / nx) as isize);
            let (mut sum, mut count) = (0.0, 0.0);
            for (di, dj) in [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)] {
                let at = |steps: isize| {
                    let (i, j) = (i + steps * di, j + steps * dj);
                    let inside = (0..nx as isize).contains(&i) && (0..ny as isize).contains(&j);
                    inside.then(|| j as usize * nx + i as usize).filter(|&k| layer[k] != UNSEEN).map(|k| heights[k])
                };
                let Some(a) = at(1) else { continue };
                let value = match (at(2), at(3)) {
                    (Some(b), Some(c)) if depth <= LAYERS => 3.0 * a - 3.0 * b + c,
                    _ => a,
                };
                sum += value;
                count += 1.0;
            }
            if count > 0.0 {
                found.push((k, sum / count));
            }
        }
        if found.is_empty() {
            break;
        }
        for &(k, height) in &found {
            (heights[k], layer[k]) = (height, depth);
        }
        front.retain(|&k| layer[k] == UNSEEN);
    }
    layer
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::at_worst;

    fn disc(n: usize, f: impl Fn(DVec2) -> f64) -> (Outline, Vec<f64>) {
        let node = |k: usize| DVec2::new((k % n) as f64, (k / n) as f64) * (20.0 / (n - 1) as f64) - 10.0;
        let spacing = 20.0 / (n - 1) as f64;
        let known: Vec<bool> = (0..n * n).map(|k| node(k).length() < 10.0 - 0.25 * spacing).collect();
        let heights = (0..n * n).map(|k| if known[k] { f(node(k)) } else { f64::NAN }).collect();
        let points = (0..4 * n)
            .map(|k| 10.0 * DVec2::from_angle(std::f64::consts::TAU * k as f64 / (4 * n) as f64))
            .map(|p| p.extend(f(p)))
            .collect();
        (Outline::new(points, known).unwrap(), heights)
    }

    #[test]
    fn the_face_is_known_up_to_the_border_with_its_slope() {
        let f = |p: DVec2| 0.4 * (0.5 * p.x).sin() * (0.3 * p.y + 0.2).cos() + 0.02 * p.x * p.y;
        let slope = |p: DVec2| 0.2 * (0.5 * p.x).cos() * (0.3 * p.y + 0.2).cos() + 0.02 * p.y;
        let worst = |n: usize| {
            let (border, mut heights) = disc(n, f);
            border.complete(&mut heights, (n, n), DVec2::splat(-10.0), DVec2::splat(10.0));
            assert!(heights.iter().all(|z| z.is_finite()));
            let spline = Bicubic::through(&heights, n, n, [-10.0; 2], [10.0; 2]);
            (0..3000).fold((0.0_f64, 0.0_f64), |(height, rise), k| {
                let p = DVec2::from_angle(0.37 * f64::from(k)) * (10.0 - 0.002 * f64::from(k % 1000));
                let jet = spline.jet(p.x, p.y);
                (height.max((jet.z - f(p)).abs()), rise.max((jet.zx - slope(p)).abs()))
            })
        };
        let (coarse, fine) = (worst(41), worst(81));
        at_worst(7.5e-6, fine.0, "heights");
        at_worst(6.8e-5, fine.1, "slopes");
        at_worst(0.104, fine.1 / coarse.1, "slopes on half the spacing");
    }

    #[test]
    fn points_within_are_told_from_points_beyond() {
        let (border, _) = disc(41, |_| 0.0);
        for k in 0..500 {
            let direction = DVec2::from_angle(0.1 * f64::from(k));
            assert!(border.covers(9.99 * direction) && !border.covers(10.001 * direction));
        }
        assert!(border.covers(DVec2::ZERO));
        assert!(Outline::new(vec![DVec3::ZERO; 20], Vec::new()).is_none());
    }
}
