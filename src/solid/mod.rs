//! From heights to a closed solid.
//!
//! # Guarantees
//! Every [`Solid`] is a closed, outward oriented surface of genus 0 without degenerate triangles, for any aspect and size
//! that [`Solid::new`] accepts; [`Solid::check`] proves it triangle by triangle. Coordinates are `f32`, as in the files:
//! what is checked is what is written, bit for bit.
//!
//! # Triangulation
//! - *Exit face*: the height nodes, two triangles a cell. Each cell is split along the diagonal on which the surface bends
//!   less, so that the flat facets stay nearer to it than with a fixed diagonal. The rule is the same after a mirroring,
//!   and so is the mesh (ties go to the diagonal that points to the centre).
//! - *Entry face*: a plane of square-like cells, about as wide as the block is thick. A fan, or a single quad with all
//!   border nodes on it, would be thousands of slivers; a full grid would double the file and say nothing.
//! - *Walls*: one strip each, between the exit border's own nodes and the few nodes of the entry border. There is no
//!   vertex between the two faces: a reader finds the height nodes as all vertices above the entry plane.

mod check;
mod error;
mod stock;
mod walls;

pub use check::{Fault, Invariants};
pub(crate) use check::{cross, sub};
pub use error::SolidError;
pub use stock::{STANDARD_SHEETS_MM, Stock};

use crate::{
    grid::Extent,
    surface::{HeightField, SurfaceSpline},
};
use glam::DVec2;
use std::ops::Range;
use walls::{entry_cells, strip};

/// One planar or structured side of the block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// The structured face, `z = h(x, y)`.
    Exit,
    /// The plane that the light enters, facing `-z`.
    Entry,
    /// The wall facing `-y`.
    South,
    /// The wall facing `+x`.
    East,
    /// The wall facing `+y`.
    North,
    /// The wall facing `-x`.
    West,
}

impl Face {
    /// The four walls, counter-clockwise as seen from `+z`.
    pub const WALLS: [Self; 4] = [Self::South, Self::East, Self::North, Self::West];

    /// Outward unit normal; of the exit face, that of its mean plane.
    pub const fn normal(self) -> [f32; 3] {
        match self {
            Self::Exit => [0.0, 0.0, 1.0],
            Self::Entry => [0.0, 0.0, -1.0],
            Self::South => [0.0, -1.0, 0.0],
            Self::East => [1.0, 0.0, 0.0],
            Self::North => [0.0, 1.0, 0.0],
            Self::West => [-1.0, 0.0, 0.0],
        }
    }
}

/// A regular grid of vertices, numbered row by row from `first`.
#[derive(Clone, Debug)]
struct Nodes {
    first: usize,
    x: Vec<f32>,
    y: Vec<f32>,
}

impl Nodes {
    fn new(first: usize, extent: Extent, nx: usize, ny: usize) -> Self {
        // The ends are set to half the size, not computed: the walls are exactly planar and exactly where they belong.
        let axis = |n: usize, size: f64, place: &dyn Fn(usize) -> f64| -> Vec<f32> {
            let mut axis: Vec<f32> = (0..n).map(|k| place(k) as f32).collect();
            (axis[0], axis[n - 1]) = ((-0.5 * size) as f32, (0.5 * size) as f32);
            axis
        };
        let x = axis(nx, extent.width_mm, &|i| extent.node(i, 0, nx, ny).x);
        let y = axis(ny, extent.height_mm, &|j| extent.node(0, j, nx, ny).y);
        Self { first, x, y }
    }

    fn len(&self) -> usize {
        self.x.len() * self.y.len()
    }

    fn index(&self, i: usize, j: usize) -> u32 {
        (self.first + j * self.x.len() + i) as u32
    }

    /// The nodes along a wall, in the order of a viewer outside of it, from left to right.
    fn border(&self, wall: Face) -> Vec<u32> {
        let (right, top) = (self.x.len() - 1, self.y.len() - 1);
        match wall {
            Face::South => (0..=right).map(|i| self.index(i, 0)).collect(),
            Face::East => (0..=top).map(|j| self.index(right, j)).collect(),
            Face::North => (0..=right).rev().map(|i| self.index(i, top)).collect(),
            Face::West => (0..=top).rev().map(|j| self.index(0, j)).collect(),
            Face::Exit | Face::Entry => Vec::new(),
        }
    }
}

/// A closed block of glass in the library's frame, mm: vertices as `f32`, triangles by number.
///
/// Vertices are the exit face's nodes, row by row, then the entry face's. Triangles are made on demand, in the order of
/// [`faces`](Self::faces): a block of 4097 x 4097 nodes takes 270 MB, its 33.6 million triangles nothing.
#[derive(Clone, Debug)]
pub struct Solid {
    extent: Extent,
    exit: Nodes,
    entry: Nodes,
    heights: Vec<f32>,
    normals: Vec<[f32; 3]>,
    entry_z: f32,
    walls: [Vec<[u32; 3]>; 4],
    thickness_mm: f64,
    thinnest_mm: f64,
}

impl Solid {
    /// Most nodes of an exit face: twice as many triangles still have 32-bit numbers.
    pub const MOST_NODES: usize = 1 << 30;
    /// Least distance of neighbouring nodes, in units of the `f32` resolution at the border. Below about 2 nodes coincide;
    /// at 16 a facet's slope is still right to a few percent.
    const LEAST_STEPS: f64 = 16.0;

    /// Closes a height field to a block of the given stock.
    ///
    /// # Errors
    /// A stock too thin for the relief, heights that are not finite, or more or denser nodes than `f32` mesh files can
    /// tell apart.
    pub fn new(surface: &HeightField, stock: Stock) -> Result<Self, SolidError> {
        let (extent, field) = (surface.extent(), surface.heights_mm());
        let (nx, ny) = (field.nx(), field.ny());
        if nx.checked_mul(ny).is_none_or(|nodes| nodes > Self::MOST_NODES) {
            return Err(SolidError::TooManyNodes { nx, ny });
        }
        let spacing = extent.node_spacing(nx, ny);
        for (spacing_mm, size_mm) in [(spacing.x, extent.width_mm), (spacing.y, extent.height_mm)] {
            let least_mm = Self::LEAST_STEPS * f64::from(f32::EPSILON) * 0.5 * size_mm;
            if spacing_mm.is_nan() || spacing_mm <= least_mm.max(f64::from(f32::MIN_POSITIVE)) {
                return Err(SolidError::TooFine { spacing_mm, size_mm, least_mm });
            }
        }
        if let Some(k) = field.as_slice().iter().position(|z| !z.is_finite()) {
            return Err(SolidError::NotFinite { i: k % nx, j: k / nx, height_mm: field.as_slice()[k] });
        }
        let (low, high) = field.min_max();
        let thickness_mm = stock.thickness_mm(high - low)?;
        let entry_z = (high - thickness_mm) as f32;

        let heights: Vec<f32> = field.as_slice().iter().map(|&z| z as f32).collect();
        let exit = Nodes::new(0, extent, nx, ny);
        let above_entry =
            |wall| -> Vec<f32> { exit.border(wall).iter().map(|&v: &u32| heights[v as usize] - entry_z).collect() };
        let [south, east, north, west] = Face::WALLS.map(above_entry);
        let cells_x = entry_cells(extent.width_mm, [&south[..], &north[..]]);
        let cells_y = entry_cells(extent.height_mm, [&east[..], &west[..]]);
        let entry = Nodes::new(exit.len(), extent, cells_x + 1, cells_y + 1);
        let walls = Face::WALLS.map(|wall| strip(&exit.border(wall), &entry.border(wall)));
        let normals = exit_normals(surface);
        let thinnest_mm = thickness_mm - (high - low);
        Ok(Self { extent, exit, entry, heights, normals, entry_z, walls, thickness_mm, thinnest_mm })
    }

    /// Size seen along the axis.
    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// Nodes of the exit face along x and y.
    pub fn exit_nodes(&self) -> (usize, usize) {
        (self.exit.x.len(), self.exit.y.len())
    }

    /// Nodes of the entry face along x and y.
    pub fn entry_nodes(&self) -> (usize, usize) {
        (self.entry.x.len(), self.entry.y.len())
    }

    /// The entry plane, mm; negative.
    pub fn entry_z_mm(&self) -> f64 {
        f64::from(self.entry_z)
    }

    /// From the entry face to the highest point of the exit face, mm.
    pub fn thickness_mm(&self) -> f64 {
        self.thickness_mm
    }

    /// From the entry face to the lowest point of the exit face, mm.
    pub fn thinnest_mm(&self) -> f64 {
        self.thinnest_mm
    }

    /// How many vertices there are.
    pub fn vertex_count(&self) -> usize {
        self.exit.len() + self.entry.len()
    }

    /// Vertex `v`, mm.
    pub fn vertex(&self, v: usize) -> [f32; 3] {
        let (nodes, z) = match self.heights.get(v) {
            Some(&height) => (&self.exit, height),
            None => (&self.entry, self.entry_z),
        };
        let k = v - nodes.first;
        [nodes.x[k % nodes.x.len()], nodes.y[k / nodes.x.len()], z]
    }

    /// Outward unit normals of the smooth exit face at its nodes, in the order of the vertices: those of the spline through
    /// the heights, not of the facets.
    pub fn exit_normals(&self) -> &[[f32; 3]] {
        &self.normals
    }

    /// Every face and the numbers of its triangles; together all triangles in order.
    pub fn faces(&self) -> [(Face, Range<usize>); 6] {
        let quads = |nodes: &Nodes| (nodes.x.len() - 1) * (nodes.y.len() - 1);
        let mut end = 0;
        let mut next = |count: usize| {
            end += count;
            end - count..end
        };
        let [south, east, north, west] = &self.walls;
        [
            (Face::Exit, next(2 * quads(&self.exit))),
            (Face::Entry, next(2 * quads(&self.entry))),
            (Face::South, next(south.len())),
            (Face::East, next(east.len())),
            (Face::North, next(north.len())),
            (Face::West, next(west.len())),
        ]
    }

    /// How many triangles there are.
    pub fn triangle_count(&self) -> usize {
        self.faces()[5].1.end
    }

    /// The vertices of triangle `t`, counter-clockwise from outside.
    ///
    /// # Panics
    /// If there is no such triangle.
    pub fn triangle(&self, t: usize) -> [u32; 3] {
        let quad = |nodes: &Nodes, k: usize| {
            let cells = nodes.x.len() - 1;
            let (i, j) = (k / 2 % cells, k / 2 / cells);
            // Around the cell, counter-clockwise from +z.
            let corners = [nodes.index(i, j), nodes.index(i + 1, j), nodes.index(i + 1, j + 1), nodes.index(i, j + 1)];
            (i, j, corners)
        };
        let faces = self.faces();
        let (face, range) =
            faces.iter().find(|(_, range)| t < range.end).unwrap_or_else(|| panic!("there is no triangle {t}"));
        let k = t - range.start;
        match face {
            Face::Exit => {
                let (i, j, [a, b, c, d]) = quad(&self.exit, k);
                match (self.diagonal(i, j), k % 2) {
                    (Diagonal::Rising, 0) => [a, b, c],
                    (Diagonal::Rising, _) => [a, c, d],
                    (Diagonal::Falling, 0) => [a, b, d],
                    (Diagonal::Falling, _) => [b, c, d],
                }
            }
            Face::Entry => {
                let (_, _, [a, b, c, d]) = quad(&self.entry, k);
                if k.is_multiple_of(2) { [a, c, b] } else { [a, d, c] }
            }
            wall => self.walls[Face::WALLS.iter().position(|w| w == wall).unwrap_or_default()][k],
        }
    }

    /// The diagonal of exit cell `(i, j)` along which the surface bends less.
    ///
    /// The second derivatives along the two diagonals are `(h_xx + h_yy)/2 +- h_xy` (in units of the cell), so that the
    /// signs of Laplacian and twist decide.
    fn diagonal(&self, i: usize, j: usize) -> Diagonal {
        let (nx, ny) = self.exit_nodes();
        let at = |i: usize, j: usize| f64::from(self.heights[j * nx + i]);
        // Twice the second difference in the middle between nodes k and k + 1, from as many of the four nodes k - 1 to
        // k + 2 as there are.
        let bend = |k: usize, n: usize, h: &dyn Fn(usize) -> f64| {
            let left = if k > 0 { h(k - 1) - 2.0 * h(k) + h(k + 1) } else { 0.0 };
            let right = if k + 2 < n { h(k) - 2.0 * h(k + 1) + h(k + 2) } else { 0.0 };
            if k > 0 && k + 2 < n { left + right } else { 2.0 * (left + right) }
        };
        let along_x = bend(i, nx, &|i| at(i, j)) + bend(i, nx, &|i| at(i, j + 1));
        let along_y = bend(j, ny, &|j| at(i, j)) + bend(j, ny, &|j| at(i + 1, j));
        let twist = (at(i + 1, j + 1) + at(i, j)) - (at(i + 1, j) + at(i, j + 1));
        let rising_bends_more = (along_x + along_y) * twist;
        if rising_bends_more < 0.0 {
            Diagonal::Rising
        } else if rising_bends_more > 0.0 {
            Diagonal::Falling
        } else if (2 * i + 2 > nx) == (2 * j + 2 > ny) {
            Diagonal::Rising
        } else {
            Diagonal::Falling
        }
    }
}

/// Which corners of a cell a diagonal joins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Diagonal {
    /// From least x and y to greatest x and y.
    Rising,
    /// From greatest x and least y to least x and greatest y.
    Falling,
}

/// Unit normals of the smooth exit face at its nodes, towards `+z`.
fn exit_normals(surface: &HeightField) -> Vec<[f32; 3]> {
    let slopes = SurfaceSpline::through(surface).node_slopes();
    // `+ 0.0` turns a negative zero into a positive one.
    let normal = |slope: &DVec2| (-slope.extend(-1.0)).normalize().as_vec3().to_array().map(|c| c + 0.0);
    slopes.as_slice().iter().map(normal).collect()
}

#[cfg(test)]
mod tests;
