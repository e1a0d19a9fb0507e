//! A closed block.

use super::{
    entry::{self, EntryRelief},
    error,
    error::SolidError,
    face::{Diagonal, Face, diagonals, normal_of},
    nodes::Nodes,
    ring::{self, Trimmed},
    shape::{Origin, Shape},
    stock::Stock,
};
use crate::{
    grid::{Contour, Extent, cut_off},
    surface::{HeightField, SurfaceSpline},
};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::ops::Range;

/// A closed block of glass, mm: vertices as `f32`, counted from the origin of its [`Shape`];
/// triangles by number.
///
/// Vertices are the exit face's nodes, row by row, then those of the planes. Triangles of the exit
/// face are made on demand, in the order of [`faces`](Self::faces): a block of 4097 x 4097 nodes
/// takes 360 MB, its 33.6 million triangles nothing.
#[derive(Clone, Debug)]
pub struct Solid {
    pub(super) surface: HeightField,
    pub(super) shape: Shape,
    pub(super) origin: DVec3,
    pub(super) exit: Nodes,
    /// Of every cell of the exit face, row by row.
    pub(super) diagonals: Vec<Diagonal>,
    /// The exit face if it is no full grid.
    pub(super) trimmed: Option<Trimmed>,
    pub(super) entry_nodes: (usize, usize),
    pub(super) normals: Vec<[f32; 3]>,
    /// Vertices that are no nodes of the exit face, and the triangles of every plane.
    pub(super) rest: Vec<[f32; 3]>,
    pub(super) planes: Vec<(Face, Vec<[u32; 3]>)>,
    pub(super) faces: Vec<(Face, Range<usize>)>,
    /// The entry face, if it is no plane.
    pub(super) entry: Option<EntryRelief>,
    /// The lowest plane, in the library's frame: of a planar entry face its own.
    pub(super) base_z: f32,
    pub(super) rim_z_mm: Option<f64>,
    pub(super) thickness_mm: f64,
    pub(super) thinnest_mm: f64,
}

impl Solid {
    /// Most nodes of an exit face: twice as many triangles still have 32-bit numbers.
    pub const MOST_NODES: usize = error::MOST_NODES;
    /// Least distance of neighbouring nodes, in units of the `f32` resolution at the border. Below
    /// about 2 nodes coincide; at 16 a facet's slope is still right to a few percent.
    const LEAST_STEPS: f64 = 16.0;

    /// Closes a height field to a plain block of the given stock, in the library's frame.
    ///
    /// # Errors
    /// Those of [`shaped`](Self::shaped).
    pub fn new(surface: &HeightField, stock: Stock) -> Result<Self, SolidError> {
        Self::shaped(surface, stock, Shape::default())
    }

    /// Closes a height field to a block of the given stock and shape.
    ///
    /// # Errors
    /// A stock too thin for the relief, heights that are not finite, more or denser nodes than
    /// `f32` mesh files can tell apart, or a rim that does not fit the face.
    pub fn shaped(surface: &HeightField, stock: Stock, shape: Shape) -> Result<Self, SolidError> {
        Self::closed(surface, None, stock, shape)
    }

    /// Closes a block between two height fields: the exit face, and an entry face on the nodes of the
    /// exit face with its skirt. The heights of the entry face tell its shape; it is moved along z so
    /// that the block, from the lowest point of one to the highest of the other, is as thick as its
    /// stock.
    ///
    /// # Errors
    /// Those of [`shaped`](Self::shaped), faces on different nodes, a rim, or an outline that is no
    /// rectangle.
    pub fn between(exit: &HeightField, entry: &HeightField, stock: Stock, shape: Shape) -> Result<Self, SolidError> {
        Self::closed(exit, Some(entry), stock, shape)
    }

    fn closed(
        surface: &HeightField,
        entry: Option<&HeightField>,
        stock: Stock,
        shape: Shape,
    ) -> Result<Self, SolidError> {
        shape.check(surface.extent())?;
        let surface = surface.with_skirt(shape.skirt_mm);
        entry.map_or(Ok(()), |entry| entry::check(entry, &surface, &shape))?;
        let (extent, field) = (surface.extent(), surface.heights_mm());
        let (nx, ny) = (field.nx(), field.ny());
        if nx.checked_mul(ny).is_none_or(|nodes| nodes > Self::MOST_NODES) {
            return Err(SolidError::TooManyNodes { nx, ny });
        }
        let outline = shape.outline(extent);
        let lower = outline[0];
        let spacing = extent.node_spacing(nx, ny);
        for (spacing_mm, size_mm, beyond) in
            [(spacing.x, extent.width_mm, lower.x), (spacing.y, extent.height_mm, lower.y)]
        {
            let reach = 0.5 * size_mm - if shape.origin == Origin::Corner { beyond } else { 0.0 };
            let least_mm = Self::LEAST_STEPS * f64::from(f32::EPSILON) * reach;
            if spacing_mm.is_nan() || spacing_mm <= least_mm.max(f64::from(f32::MIN_POSITIVE)) {
                return Err(SolidError::TooFine { spacing_mm, size_mm, least_mm });
            }
        }
        if let Some(k) = field.as_slice().iter().position(|z| !z.is_finite()) {
            return Err(SolidError::NotFinite { face: "exit", i: k % nx, j: k / nx, height_mm: field.as_slice()[k] });
        }
        let spline = SurfaceSpline::through(&surface);
        let border = if surface.contour().is_rectangle() { Vec::new() } else { ring::border(&surface, &spline) };
        let (low, high) = range_with(&surface, &border);
        let top = high + shape.rise_mm();
        let depth_mm = entry.map_or(top - low, |entry| entry::depth_mm(entry, &surface, top));
        let thickness_mm = stock.thickness_mm(depth_mm)?;
        let base_z = (top - thickness_mm) as f32;
        let origin = match shape.origin {
            Origin::Exit => DVec3::ZERO,
            Origin::Entry => DVec3::Z * f64::from(base_z),
            Origin::StockTop => DVec3::Z * top,
            Origin::Corner => lower.extend(f64::from(base_z)),
        };
        let mut solid = Self {
            surface: surface.clone(),
            shape,
            origin,
            exit: Nodes::new(0, extent, (nx, ny), origin),
            diagonals: diagonals(field),
            trimmed: None,
            entry_nodes: (2, 2),
            normals: Vec::new(),
            rest: Vec::new(),
            planes: Vec::new(),
            faces: Vec::new(),
            entry: entry.map(|entry| EntryRelief::standing_at(entry, f64::from(base_z))),
            base_z,
            rim_z_mm: None,
            thickness_mm,
            thinnest_mm: thickness_mm - depth_mm,
        };
        if !border.is_empty() {
            let trimmed = solid.trim(&spline, &border);
            match shape.rim {
                None => solid.close_along(trimmed),
                Some(rim) => {
                    let heights = || border.iter().map(|(_, height)| *height);
                    let limits = (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
                    solid.rim_z_mm = Some(rim.plane_mm(high, limits, f64::from(base_z))?);
                    solid.close_along_rim(trimmed, rim.width_mm);
                }
            }
            solid.number_faces();
            return Ok(solid);
        }
        solid.normals = spline.node_slopes().as_slice().par_iter().map(|&slope| normal_of(slope)).collect();
        match shape.rim {
            None => solid.close_below(),
            Some(rim) => {
                let border = Face::WALLS.map(|wall| solid.border_heights(wall));
                let heights = || border.iter().flatten().copied();
                let (least, greatest) =
                    (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
                solid.rim_z_mm = Some(rim.plane_mm(high, (least, greatest), f64::from(base_z))?);
                solid.close_around(&outline);
            }
        }
        solid.number_faces();
        Ok(solid)
    }

    /// The highest place of the exit face of the block that a height field is closed to, mm: at a
    /// node or, of a block that is not rectangular, on its outline.
    pub fn highest_mm(surface: &HeightField) -> f64 {
        let border = if surface.contour().is_rectangle() {
            Vec::new()
        } else {
            ring::border(surface, &SurfaceSpline::through(surface))
        };
        range_with(surface, &border).1
    }

    /// A height of the library's frame as the files have it.
    pub(super) fn file_z(&self, z_mm: f64) -> f32 {
        (z_mm - self.origin.z) as f32
    }

    /// The exit face in double precision, in the library's frame.
    pub fn surface(&self) -> &HeightField {
        &self.surface
    }

    /// Rim and origin.
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// The origin of the vertices in the library's frame, mm.
    pub fn origin_mm(&self) -> DVec3 {
        self.origin
    }

    /// Units, axes and origin of the vertices, as a line of 7-bit text.
    pub fn frame_line(&self) -> String {
        let plane = "millimetres, z up; light travels +z, the mean exit plane is";
        match self.shape.origin {
            Origin::Exit => format!("{plane} z = 0, the receiver z = distance"),
            other => format!(
                "{plane} z = {z}, the receiver z = {z} + distance; the origin is {}",
                other.place(),
                z = -self.origin.z
            ),
        }
    }

    /// The plane of the rim in the library's frame, mm, if there is one.
    pub fn rim_z_mm(&self) -> Option<f64> {
        self.rim_z_mm
    }

    /// Size of the exit face seen along the axis.
    pub fn extent(&self) -> Extent {
        self.surface.extent()
    }

    /// Size of the whole block seen along the axis.
    pub fn stock_extent(&self) -> Extent {
        let beyond = self.shape.rim.map_or(0.0, |rim| 2.0 * rim.width_mm);
        Extent::new(self.extent().width_mm + beyond, self.extent().height_mm + beyond)
    }

    /// Nodes of the exit face along x and y.
    pub fn exit_nodes(&self) -> (usize, usize) {
        (self.exit.x.len(), self.exit.y.len())
    }

    /// Nodes of the entry face along x and y, which of a block with a rim are its corners.
    pub fn entry_nodes(&self) -> (usize, usize) {
        self.entry_nodes
    }

    /// The entry plane in the library's frame, mm; negative. Of an entry face that is no plane, the
    /// mean of its nodes.
    pub fn entry_z_mm(&self) -> f64 {
        self.entry.as_ref().map_or(self.base_z_mm(), |entry| entry.surface.heights_mm().mean())
    }

    /// The entry face in double precision, in the library's frame, if it is no plane.
    pub fn entry_surface(&self) -> Option<&HeightField> {
        self.entry.as_ref().map(|entry| &entry.surface)
    }

    /// The lowest point of the block in the library's frame, mm: where it stands on a table.
    pub fn base_z_mm(&self) -> f64 {
        f64::from(self.base_z)
    }

    /// From the lowest point of the entry face to the highest point of the block, mm: the stock.
    pub fn thickness_mm(&self) -> f64 {
        self.thickness_mm
    }

    /// The least glass along the axis, mm: from the entry face to the lowest point of the exit face,
    /// or, of an entry face that is no plane, between any two nodes over each other.
    pub fn thinnest_mm(&self) -> f64 {
        self.thinnest_mm
    }

    /// How many vertices there are.
    pub fn vertex_count(&self) -> usize {
        self.exit_vertex_count() + self.rest.len()
    }

    /// How many vertices the exit face has; they are the first ones.
    pub fn exit_vertex_count(&self) -> usize {
        self.trimmed.as_ref().map_or(self.exit.len(), |trimmed| trimmed.vertices.len())
    }

    /// How many vertices an entry face has that is no plane; they follow those of the exit face.
    pub fn entry_vertex_count(&self) -> usize {
        self.entry.as_ref().map_or(0, |entry| entry.normals.len())
    }

    /// The curve around the block with its rim, and the flat that a mark cuts off it: what lies
    /// further than a length, mm, along a unit vector.
    pub(crate) fn curve(&self) -> (Contour, Option<(DVec2, f64)>) {
        let rim_mm = self.shape.rim.map_or(0.0, |rim| rim.width_mm);
        let curve = self.surface.outline().grown(rim_mm).within(self.stock_extent());
        (curve, self.shape.flat(&curve))
    }

    /// The block with its rim as seen along the axis, mm: its corners, or a polygon on its curve,
    /// counter-clockwise.
    pub fn outline(&self) -> Vec<DVec2> {
        if self.surface.contour().is_rectangle() {
            return self.shape.outline(self.extent());
        }
        let (curve, flat) = self.curve();
        let points = curve.polygon(1e-4 * self.stock_extent().as_vec().max_element());
        let Some((along, reach)) = flat else { return points };
        cut_off(&points, along, reach)
    }

    /// The curve around the exit face as seen along the axis, if it is not rectangular.
    pub fn contour(&self) -> Option<Contour> {
        Some(self.surface.contour()).filter(|contour| !contour.is_rectangle())
    }

    /// Vertex `v`, mm from the origin of the shape.
    pub fn vertex(&self, v: usize) -> [f32; 3] {
        if let Some(trimmed) = &self.trimmed {
            return trimmed.vertices.get(v).copied().unwrap_or_else(|| self.rest[v - trimmed.vertices.len()]);
        }
        let nx = self.exit.x.len();
        if v < self.exit.len() { self.node(v % nx, v / nx) } else { self.rest[v - self.exit.len()] }
    }

    /// Least and greatest coordinates of all vertices, mm.
    pub fn bounds(&self) -> ([f32; 3], [f32; 3]) {
        let start = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        (0..self.vertex_count()).map(|v| self.vertex(v)).fold(start, |(low, high), at| {
            ([0, 1, 2].map(|k| low[k].min(at[k])), [0, 1, 2].map(|k| high[k].max(at[k])))
        })
    }

    /// Outward unit normals of the smooth exit face at its vertices, in the order of the vertices:
    /// those of the spline through the heights, not of the facets.
    pub fn exit_normals(&self) -> &[[f32; 3]] {
        &self.normals
    }

    /// Every face and the numbers of its triangles; together all triangles in order, the exit
    /// face's first. A wall that faces where another one does has its name too.
    pub fn faces(&self) -> Vec<(Face, Range<usize>)> {
        self.faces.clone()
    }

    /// How many triangles there are.
    pub fn triangle_count(&self) -> usize {
        self.faces.last().map_or(0, |(_, range)| range.end)
    }

    /// The vertices of triangle `t`, counter-clockwise from outside.
    ///
    /// # Panics
    /// If there is no such triangle.
    pub fn triangle(&self, t: usize) -> [u32; 3] {
        if let Some(nodes) = self.half_cell(t) {
            return nodes.map(|(i, j)| self.exit.index(i, j));
        }
        if let Some(trimmed) = self.trimmed.as_ref().filter(|_| t < self.faces[0].1.end) {
            return trimmed.triangles[t];
        }
        let mut faces = self.faces[1..].iter().zip(&self.planes);
        let ((_, range), (_, triangles)) =
            faces.find(|((_, range), _)| t < range.end).unwrap_or_else(|| panic!("there is no triangle {t}"));
        triangles[t - range.start]
    }

    /// The positions of the corners of triangle `t`, in the order of its
    /// [vertices](Self::triangle).
    ///
    /// # Panics
    /// If there is no such triangle.
    pub fn corners(&self, t: usize) -> [[f32; 3]; 3] {
        match self.half_cell(t) {
            Some(nodes) => nodes.map(|(i, j)| self.node(i, j)),
            None => self.triangle(t).map(|v| self.vertex(v as usize)),
        }
    }

    /// The nodes (column, row) of triangle `t`, if it is half a cell of an exit face that is a full
    /// grid.
    #[inline]
    pub(super) fn half_cell(&self, t: usize) -> Option<[(usize, usize); 3]> {
        if self.trimmed.is_some() || t >= self.faces[0].1.end {
            return None;
        }
        let cells = self.exit.x.len() - 1;
        let (i, j) = (t / 2 % cells, t / 2 / cells);
        // Around the cell, counter-clockwise from +z.
        let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
        Some(match (self.diagonals[t / 2], t % 2) {
            (Diagonal::Rising, 0) => [a, b, c],
            (Diagonal::Rising, _) => [a, c, d],
            (Diagonal::Falling, 0) => [a, b, d],
            (Diagonal::Falling, _) => [b, c, d],
        })
    }

    /// The position of a node of an exit face that is a full grid.
    #[inline]
    pub(super) fn node(&self, i: usize, j: usize) -> [f32; 3] {
        [self.exit.x[i], self.exit.y[j], self.file_z(self.surface.heights_mm()[(i, j)])]
    }

    /// The diagonal of exit cell `(i, j)`.
    pub(super) fn diagonal(&self, i: usize, j: usize) -> Diagonal {
        self.diagonals[j * (self.exit.x.len() - 1) + i]
    }
}

/// Least and greatest height of a face and of the points of its outline, mm.
fn range_with(surface: &HeightField, border: &[(DVec2, f64)]) -> (f64, f64) {
    border.iter().fold(surface.range_mm(), |(low, high), (_, z)| (low.min(*z), high.max(*z)))
}
