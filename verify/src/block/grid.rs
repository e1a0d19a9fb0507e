//! The regular grid of vertices of a face: its lines, and the two triangles of every cell.

use super::{cell::Diagonal, error::BlockError, outline::wall_tops};
use crate::{mesh::Mesh, spline::Bicubic};
use glam::{DVec2, DVec3};

/// Nodes may miss the regular grid by this part of the spacing: f32 rounding takes up to 1e-3 on a
/// fine grid, and text with few digits a little more.
const GRID_TOLERANCE: f64 = 0.02;

/// The vertices of a face and their lines.
pub(super) struct VertexGrid {
    vertices: Vec<u32>,
    pub(super) lo: DVec2,
    pub(super) hi: DVec2,
    pub(super) nx: usize,
    pub(super) ny: usize,
}

impl VertexGrid {
    /// Demands that these vertices are a regular grid, as seen from above.
    pub(super) fn over(mesh: &Mesh, exit: Vec<u32>) -> Result<Self, BlockError> {
        let at = |v: u32| mesh.vertices[v as usize].truncate();
        let empty = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let (lo, hi) = exit.iter().fold(empty, |(lo, hi), &v| (lo.min(at(v)), hi.max(at(v))));
        if !(hi.cmpgt(lo).all()) {
            return Err(BlockError::Grid { why: "there are no vertices above the entry face".into() });
        }
        let nx = lines(mesh, &exit, lo.x, hi.x - lo.x, |v| v.x, "x")?;
        let ny = lines(mesh, &exit, lo.y, hi.y - lo.y, |v| v.y, "y")?;
        if nx.checked_mul(ny) != Some(exit.len()) {
            return Err(BlockError::Grid {
                why: format!("{nx} columns and {ny} rows do not hold {} vertices", exit.len()),
            });
        }
        Ok(Self { vertices: exit, lo, hi, nx, ny })
    }

    /// Demands that these vertices are a regular grid but for those where the walls end, which go
    /// around it; returns the grid that reaches around them, too, and them.
    pub(super) fn inside_walls(
        mesh: &Mesh,
        in_entry: impl Fn(u32) -> bool,
        above: &[u32],
    ) -> Result<(Self, Vec<DVec3>), BlockError> {
        let tops = wall_tops(mesh, in_entry);
        let (around, exit): (Vec<u32>, Vec<u32>) = above.iter().partition(|&&v| tops[v as usize]);
        let bounds = |vertices: &[u32]| {
            let empty = (DVec2::INFINITY, DVec2::NEG_INFINITY);
            vertices.iter().map(|&v| mesh.vertices[v as usize].truncate()).fold(empty, |(a, b), p| (a.min(p), b.max(p)))
        };
        let ((outer_lo, outer_hi), (lo, hi)) = (bounds(&around), bounds(&exit));
        if !(hi.cmpgt(lo).all() && outer_lo.cmplt(lo).all() && outer_hi.cmpgt(hi).all()) {
            return Err(BlockError::Grid { why: "the walls do not go around the exit face".into() });
        }
        let inner = [
            lines(mesh, &exit, lo.x, hi.x - lo.x, |v| v.x, "x")?,
            lines(mesh, &exit, lo.y, hi.y - lo.y, |v| v.y, "y")?,
        ];
        let spacing = (hi - lo) / DVec2::new((inner[0] - 1) as f64, (inner[1] - 1) as f64);
        let (before, after) = ((lo - outer_lo) / spacing, (outer_hi - hi) / spacing);
        let off = (before - before.round()).abs().max((after - after.round()).abs()).max_element();
        let most = before.max(after).max_element();
        if off.is_nan() || off > OUTLINE_TOLERANCE || most > MOST_BEYOND {
            return Err(BlockError::Grid {
                why: format!("the outline stands {:.1} % of a spacing beside the lines of the grid", 100.0 * off),
            });
        }
        let (before, after) = (before.round(), after.round());
        let nx = inner[0] + (before.x + after.x) as usize;
        let ny = inner[1] + (before.y + after.y) as usize;
        // A few vertices along a diagonal span any number of nodes.
        if nx.saturating_mul(ny) > LEAST_FILLED * above.len() + FEW_NODES {
            return Err(BlockError::Grid {
                why: format!("{} vertices fill hardly any of {nx} columns and {ny} rows", above.len()),
            });
        }
        let points = around.iter().map(|&v| mesh.vertices[v as usize]).collect();
        Ok((Self { vertices: exit, lo: lo - before * spacing, hi: hi + after * spacing, nx, ny }, points))
    }
}

impl VertexGrid {
    /// The node of every vertex of the mesh (`u32::MAX` of those elsewhere), counted row by row, and
    /// the vertex at every node (`u32::MAX` where there is none).
    pub(super) fn nodes(&self, mesh: &Mesh) -> Result<(Vec<u32>, Vec<u32>), BlockError> {
        let (nx, ny, extent) = (self.nx, self.ny, self.hi - self.lo);
        let mut node_of = vec![u32::MAX; mesh.vertices.len()];
        let mut vertex_at = vec![u32::MAX; nx * ny];
        for &v in &self.vertices {
            let p = mesh.vertices[v as usize];
            let i = ((p.x - self.lo.x) / extent.x * (nx - 1) as f64).round() as usize;
            let j = ((p.y - self.lo.y) / extent.y * (ny - 1) as f64).round() as usize;
            let node = j * nx + i;
            if vertex_at[node] != u32::MAX {
                return Err(BlockError::Grid { why: format!("two vertices stand at column {i}, row {j}") });
            }
            vertex_at[node] = v;
            node_of[v as usize] = node as u32;
        }
        Ok((node_of, vertex_at))
    }
}

/// By how much of a spacing an outline may miss the lines of the grid that touch it, and the most
/// lines between it and the nodes.
const OUTLINE_TOLERANCE: f64 = 0.05;
const MOST_BEYOND: f64 = 8.0;
/// One in so many nodes of a grid is within the outline at least, of more than a few.
const LEAST_FILLED: usize = 4;
const FEW_NODES: usize = 1 << 10;

/// How many places of late vertices are kept to tell which are new.
const LATE: usize = 1 << 12;

/// Counts the grid lines along one axis and demands that they are equidistant.
fn lines(
    mesh: &Mesh,
    exit: &[u32],
    lower: f64,
    size: f64,
    coordinate: impl Fn(DVec3) -> f64,
    name: &str,
) -> Result<usize, BlockError> {
    // Most are exactly those of other rows, and need not be sorted.
    let mut late = [f64::NAN; LATE];
    let mut is_new = |position: &f64| {
        let kept = &mut late[(position.to_bits().wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 52) as usize];
        std::mem::replace(kept, *position) != *position
    };
    let positions = exit.iter().map(|&v| (coordinate(mesh.vertices[v as usize]) - lower) / size);
    let mut at: Vec<f64> = positions.filter(&mut is_new).collect();
    at.sort_unstable_by(f64::total_cmp);
    // Within a line coordinates differ by rounding only. The gap separates up to 50 000 lines from
    // f32 noise.
    at.dedup_by(|b, a| *b - *a < 1e-5);
    let count = at.len();
    if count < Bicubic::LEAST_NODES {
        return Err(BlockError::Grid { why: format!("only {count} lines along {name}; 4 are needed") });
    }
    for (k, &position) in at.iter().enumerate() {
        let off = position * (count - 1) as f64 - k as f64;
        if off.abs() > GRID_TOLERANCE {
            return Err(BlockError::Grid {
                why: format!(
                    "line {k} of {count} along {name} stands {:.1} % of a spacing from its place",
                    100.0 * off
                ),
            });
        }
    }
    Ok(count)
}

/// Finds the diagonal of every cell, and the normal at every node if there are any.
pub(super) fn cells(
    mesh: &Mesh,
    node_of: &[u32],
    known: &[bool],
    nx: usize,
    ny: usize,
) -> Result<(Vec<Diagonal>, Option<Vec<DVec3>>), BlockError> {
    // For every cell the corner which each triangle leaves out, as a set of bits: one triangle of
    // each cut has both of two opposite bits.
    let mut missing = vec![0u8; (nx - 1) * (ny - 1)];
    let mut normals = mesh.normals.as_ref().map(|_| vec![DVec3::ZERO; nx * ny]);
    for (k, triangle) in mesh.triangles.iter().enumerate() {
        let nodes = triangle.map(|v| node_of[v as usize]);
        if nodes.contains(&u32::MAX) {
            continue; // Side wall or entry face.
        }
        let at = nodes.map(|n| (n as usize % nx, n as usize / nx));
        if at.iter().all(|p| p.0 == at[0].0) || at.iter().all(|p| p.1 == at[0].1) {
            continue; // A wall between nodes of the border alone.
        }
        let (i, j) = (at.iter().map(|p| p.0).min().unwrap_or(0), at.iter().map(|p| p.1).min().unwrap_or(0));
        let mut corners = 0u8;
        for (ni, nj) in at {
            if ni > i + 1 || nj > j + 1 {
                return Err(BlockError::Cell { triangle: k });
            }
            corners |= 1 << ((ni - i) + 2 * (nj - j));
        }
        let left_out = !corners & 0b1111;
        if left_out.count_ones() != 1 || i + 1 >= nx || j + 1 >= ny || missing[j * (nx - 1) + i] & left_out != 0 {
            return Err(BlockError::Cell { triangle: k });
        }
        missing[j * (nx - 1) + i] |= left_out;
        if let (Some(normals), Some(of_file)) = (&mut normals, &mesh.normals) {
            for (corner, &node) in nodes.iter().enumerate() {
                normals[node as usize] += of_file.directions[of_file.corners[k][corner] as usize];
            }
        }
    }
    let is_whole = |cell: usize| {
        let first = cell / (nx - 1) * nx + cell % (nx - 1);
        [first, first + 1, first + nx, first + nx + 1].iter().all(|&node| known[node])
    };
    let diagonals = missing
        .iter()
        .enumerate()
        .map(|(cell, &bits)| match bits {
            // Corner 1 is (+x, 0), corner 2 is (0, +y): leaving these out in turn, the cut joins
            // the other two.
            0b0110 => Ok(Diagonal::Rising),
            0b1001 => Ok(Diagonal::Falling),
            _ if !is_whole(cell) => Ok(Diagonal::Rising),
            _ => Err(BlockError::Grid {
                why: format!(
                    "the cell at column {}, row {} is not covered by two triangles",
                    cell % (nx - 1),
                    cell / (nx - 1)
                ),
            }),
        })
        .collect::<Result<_, _>>()?;
    let normals = normals.map(|n| n.into_iter().map(DVec3::normalize_or_zero).collect::<Vec<_>>());
    // A file whose normals cancel or point down has none that can be used.
    let normals = normals.filter(|n| n.iter().all(|v| v.z > 0.0));
    Ok((diagonals, normals))
}
