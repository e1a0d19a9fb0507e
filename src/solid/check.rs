use super::{body::Solid, face::Face};
use rayon::prelude::*;

/// What [`Solid::check`] proved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Invariants {
    /// Vertices, all of them used.
    pub vertices: usize,
    /// Edges, each between exactly two triangles that run along it in opposite directions.
    pub edges: usize,
    /// Triangles, none degenerate.
    pub triangles: usize,
    /// Volume by the divergence theorem, mm³; it agrees with the integral of the heights over the
    /// block.
    pub volume_mm3: f64,
}

/// What is wrong with a surface that should bound a solid.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Fault {
    /// An edge without a triangle on each side.
    #[error("the edge between vertices {from} and {to} bounds {triangles} triangles; a closed surface has 2 there")]
    Open {
        /// One end.
        from: u32,
        /// The other end.
        to: u32,
        /// Triangles that use it.
        triangles: usize,
    },
    /// Neighbours of opposite orientation.
    #[error("both triangles at the edge between vertices {from} and {to} run along it in the same direction")]
    Orientation {
        /// One end.
        from: u32,
        /// The other end.
        to: u32,
    },
    /// The surface is no sphere: it has a handle, several parts, or unused vertices.
    #[error("the Euler characteristic is {0}; that of a block is 2")]
    Euler(i64),
    /// A triangle without area.
    #[error("triangle {triangle} has an area of {area_mm2:e} mm² on its face")]
    Degenerate {
        /// Number of the triangle.
        triangle: usize,
        /// Its area seen along the normal of its face, mm²; negative if it is turned over.
        area_mm2: f64,
    },
    /// The volume is not that under the heights.
    #[error("the surface encloses {enclosed_mm3} mm³, but there are {under_heights_mm3} mm³ under the heights")]
    Volume {
        /// By the divergence theorem, mm³.
        enclosed_mm3: f64,
        /// By the heights over the entry face, mm³.
        under_heights_mm3: f64,
    },
}

/// Triangles summed in one piece: fixed, so that sums do not depend on the number of threads.
const PIECE: usize = 1 << 14;

impl Solid {
    /// Proves that the surface bounds a solid: closed, oriented, of Euler characteristic 2, every
    /// triangle of positive area as seen along its face's normal, and a positive volume that agrees
    /// with the heights.
    ///
    /// Takes 24 bytes per triangle while it runs.
    ///
    /// # Errors
    /// The first fault found.
    pub fn check(&self) -> Result<Invariants, Fault> {
        let triangles = self.triangle_count();
        let edges = edges(triangles, |t| self.triangle(t))?;
        euler(self.vertex_count(), edges, triangles)?;
        for (face, range) in self.faces() {
            let areas = range.into_par_iter().map(|t| {
                let normal = self.normal_at(face, self.triangle(t)[0]).map(f64::from);
                let [a, b, c] = self.corners(t).map(|at| at.map(f64::from));
                (t, 0.5 * dot(cross(sub(b, a), sub(c, a)), normal))
            });
            // Written so that a NaN is a fault too.
            if let Some((triangle, area_mm2)) = areas.find_first(|(_, area)| area.is_nan() || *area <= 0.0) {
                return Err(Fault::Degenerate { triangle, area_mm2 });
            }
        }
        let volume_mm3 = self.volume_mm3();
        let under_heights_mm3 = self.volume_under_heights_mm3();
        // Both sums carry a relative rounding error of about 1e-16 times the square root of the
        // number of pieces.
        if volume_mm3 <= 0.0 || (volume_mm3 - under_heights_mm3).abs() > 1e-9 * volume_mm3 {
            return Err(Fault::Volume { enclosed_mm3: volume_mm3, under_heights_mm3 });
        }
        Ok(Invariants { vertices: self.vertex_count(), edges, triangles, volume_mm3 })
    }

    /// Enclosed volume by the divergence theorem, mm³.
    pub fn volume_mm3(&self) -> f64 {
        piecewise_sum(self.triangle_count(), |t| {
            let [a, b, c] = self.corners(t).map(|at| at.map(f64::from));
            dot(a, cross(b, c)) / 6.0
        })
    }

    /// The integral of the height above the lowest plane over the exit facets and the rim, less that
    /// over the entry facets, mm³.
    fn volume_under_heights_mm3(&self) -> f64 {
        // As the files have it.
        let base_z = f64::from(self.file_z(self.base_z_mm()));
        let level = self.faces().into_iter().filter(|(face, _)| matches!(face, Face::Exit | Face::Rim | Face::Entry));
        let volumes = level.map(|(_, range)| {
            piecewise_sum(range.len(), |k| {
                let [a, b, c] = self.corners(range.start + k).map(|at| at.map(f64::from));
                // Negative of what looks down.
                let area = 0.5 * cross(sub(b, a), sub(c, a))[2];
                area * ((a[2] + b[2] + c[2]) / 3.0 - base_z)
            })
        });
        volumes.sum()
    }
}

fn piecewise_sum(count: usize, term: impl Fn(usize) -> f64 + Sync) -> f64 {
    let pieces: Vec<f64> = (0..count.div_ceil(PIECE))
        .into_par_iter()
        .map(|piece| (piece * PIECE..count.min((piece + 1) * PIECE)).map(&term).sum())
        .collect();
    pieces.iter().sum()
}

/// The number of edges of a surface on which every edge has two triangles that run along it in
/// opposite directions.
fn edges(triangles: usize, triangle: impl Fn(usize) -> [u32; 3] + Sync) -> Result<usize, Fault> {
    // Least vertex, greatest vertex, direction: sorted, the two sides of an edge stand beside each
    // other.
    let mut sides = vec![0_u64; 3 * triangles];
    sides.par_chunks_mut(3).enumerate().for_each(|(t, sides)| {
        let corners = triangle(t);
        for (k, side) in sides.iter_mut().enumerate() {
            let (from, to) = (u64::from(corners[k]), u64::from(corners[(k + 1) % 3]));
            *side = from.min(to) << 32 | from.max(to) << 1 | u64::from(from > to);
        }
    });
    sides.par_sort_unstable();
    // Every edge of a sound surface is one pair; the first that is not begins at an even place.
    let Some(at) =
        sides.par_chunks(2).position_first(|pair| pair.len() < 2 || pair[0] & 1 == 1 || pair[1] != pair[0] + 1)
    else {
        return Ok(sides.len() / 2);
    };
    let edge = sides[2 * at] >> 1;
    let (from, to) = ((edge >> 31) as u32, edge as u32 & (u32::MAX >> 1));
    match sides.iter().filter(|&&side| side >> 1 == edge).count() {
        2 => Err(Fault::Orientation { from, to }),
        triangles => Err(Fault::Open { from, to, triangles }),
    }
}

fn euler(vertices: usize, edges: usize, triangles: usize) -> Result<(), Fault> {
    match vertices as i64 - edges as i64 + triangles as i64 {
        2 => Ok(()),
        other => Err(Fault::Euler(other)),
    }
}

pub(crate) fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

    fn edges_of(triangles: &[[u32; 3]]) -> Result<usize, Fault> {
        edges(triangles.len(), |t| triangles[t])
    }

    #[test]
    fn a_tetrahedron_is_closed() {
        assert_eq!(edges_of(&TETRAHEDRON), Ok(6));
        assert_eq!(euler(4, 6, 4), Ok(()));
        assert_eq!(euler(5, 6, 4), Err(Fault::Euler(3)));
    }

    #[test]
    fn every_fault_of_a_surface_is_found_and_named() {
        assert_eq!(edges_of(&TETRAHEDRON[1..]), Err(Fault::Open { from: 0, to: 1, triangles: 1 }));
        assert_eq!(edges_of(&TETRAHEDRON[..3]), Err(Fault::Open { from: 0, to: 2, triangles: 1 }));
        let mut turned = TETRAHEDRON;
        turned[2].swap(0, 1);
        assert_eq!(edges_of(&turned), Err(Fault::Orientation { from: 1, to: 2 }));
        let mut doubled = TETRAHEDRON.to_vec();
        doubled.extend(TETRAHEDRON);
        assert_eq!(edges_of(&doubled), Err(Fault::Open { from: 0, to: 1, triangles: 4 }));
    }
}
