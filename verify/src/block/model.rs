//! Recognising a block: a planar entry face, an exit face over a regular grid, side walls, perhaps a rim around the exit face.

mod face;
mod placement;

use crate::{
    mesh::{Mesh, TrimmedFace},
    outline::{Border, wall_tops},
    solid,
    spline::Bicubic,
};
use glam::{DVec2, DVec3};
use std::sync::Arc;

pub use placement::{Placed, Placement, Stand};

/// A block of glass whose exit face is a height field on a regular grid of vertices.
#[derive(Clone, Debug)]
pub struct Block {
    pub(crate) lower: DVec2,
    pub(crate) upper: DVec2,
    pub(crate) entry_z: f64,
    pub(crate) nx: usize,
    pub(crate) ny: usize,
    /// Places of the grid lines, mm.
    xs: Vec<f64>,
    ys: Vec<f64>,
    /// Heights at the nodes, mm, row-major, rows along +y.
    pub(crate) heights: Arc<Vec<f64>>,
    /// How every cell is cut into two triangles.
    pub(crate) diagonals: Arc<Vec<Diagonal>>,
    /// The spline through the nodes, if it is at hand.
    spline: Option<Arc<Bicubic>>,
    /// Normals at the nodes as the file gives them.
    pub(crate) normals: Option<Vec<DVec3>>,
    /// Slopes at the nodes, where they are known.
    pub(crate) slopes: Option<Arc<Vec<DVec2>>>,
    /// The plane around the exit face, mm, if there is one.
    rim_z: Option<f64>,
    /// The curve around the exit face, if that is no rectangle.
    border: Option<Arc<Border>>,
    /// Least and greatest corner of the entry face, mm.
    entry_face: (DVec2, DVec2),
    /// The curve around an entry face that is neither a rectangle nor the plan of the exit face.
    entry_border: Option<Arc<Border>>,
}

/// The diagonal along which a cell of the grid is cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Diagonal {
    /// From the corner of least x and y to that of greatest x and y.
    Rising,
    /// The other one.
    Falling,
}

/// Three of the corners of a cell, numbered as [`corners`] lists them; counter-clockwise as seen from the receiver.
pub(crate) type Half = [usize; 3];

/// The nodes (column, row) of the corners of a cell, going round.
#[inline]
pub(crate) fn corners(i: usize, j: usize) -> [(usize, usize); 4] {
    [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
}

/// The two triangles of a cell.
#[inline]
pub(crate) fn halves(diagonal: Diagonal) -> [Half; 2] {
    match diagonal {
        Diagonal::Rising => [[0, 1, 2], [0, 2, 3]],
        Diagonal::Falling => [[0, 1, 3], [1, 2, 3]],
    }
}

/// Why a mesh is not such a block.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BlockError {
    /// The surface is not closed, not oriented, or not sound in another way.
    #[error("the solid is not sound: {0}")]
    Unsound(solid::Report),
    /// There is nothing to stand on.
    #[error(
        "no planar entry face: only {triangles} triangles lie in the plane z = {z_mm} mm, with {area_mm2:.1} mm2 of {needed_mm2:.1} mm2"
    )]
    EntryFace {
        /// Triangles in the lowest plane.
        triangles: usize,
        /// The lowest plane, mm.
        z_mm: f64,
        /// Area of those triangles, mm².
        area_mm2: f64,
        /// Area of the block's outline, mm².
        needed_mm2: f64,
    },
    /// The vertices of the exit face are no regular grid.
    #[error("the vertices of the exit face are no regular grid: {why}")]
    Grid {
        /// What does not fit.
        why: String,
    },
    /// A triangle of the exit face is not half a cell of the grid.
    #[error("triangle {triangle} of the exit face is not half a cell of the grid")]
    Cell {
        /// Its index.
        triangle: usize,
    },
}

/// Relative tolerance for "in the entry plane": f32 in metres, far from the origin, still passes.
const PLANE_TOLERANCE: f64 = 1e-5;
/// Nodes may miss the regular grid by this part of the spacing: f32 rounding takes up to 1e-3 on a fine grid, and text with few
/// digits a little more.
const GRID_TOLERANCE: f64 = 0.02;

impl Block {
    /// Recognises a block in a mesh.
    ///
    /// # Errors
    /// A mesh that is not closed and oriented with a positive volume, or is another solid than a block: see
    /// [`BlockError`]. Any sound solid can still be traced as such.
    pub fn from_mesh(mesh: &Mesh) -> Result<Self, BlockError> {
        let report = solid::check(mesh);
        if !report.is_sound() {
            return Err(BlockError::Unsound(report));
        }
        Self::of_sound(mesh)
    }

    /// The same of a mesh that is known to be sound.
    fn of_sound(mesh: &Mesh) -> Result<Self, BlockError> {
        let (lo, hi) = mesh.bounds();
        let size = hi - lo;
        let plane = lo.z + PLANE_TOLERANCE * size.max_element().max(lo.z.abs());
        let in_entry = |v: u32| mesh.vertices[v as usize].z <= plane;
        if let Some(face) = &mesh.trimmed {
            entry_face(mesh, in_entry, lo, plan_area(mesh))?;
            return Self::trimmed(mesh, face, in_entry);
        }
        let above: Vec<u32> = (0..mesh.vertices.len() as u32).filter(|&v| !in_entry(v)).collect();
        let plain = entry_face(mesh, in_entry, lo, size.x * size.y)
            .and_then(|()| Grid::over(mesh, above.clone()).map(|grid| (grid, None, None)));
        let (grid, rim_z, border) = plain.or_else(|plain| {
            // A rim around the exit face, which then is what is left above the entry face.
            let framed = rim(mesh, in_entry, lo).and_then(|(in_rim, rim_z)| {
                let inside = above.iter().copied().filter(|v| !in_rim[*v as usize]).collect();
                Some((Grid::over(mesh, inside).ok()?, Some(rim_z), None))
            });
            // Or an outline that is no rectangle.
            let outlined =
                || Grid::within(mesh, in_entry, &above).ok().map(|(grid, border)| (grid, None, Some(border)));
            // Or a rim around such an outline.
            let both = || {
                let (in_rim, rim_z) = rim(mesh, in_entry, lo)?;
                let inside: Vec<u32> = above.iter().copied().filter(|v| !in_rim[*v as usize]).collect();
                let below = |v: u32| in_entry(v) || in_rim[v as usize];
                let (grid, border) = Grid::within(mesh, below, &inside).ok()?;
                Some((grid, Some(rim_z), Some(border)))
            };
            let found = framed.or_else(outlined).or_else(both).ok_or(plain)?;
            entry_face(mesh, in_entry, lo, plan_area(mesh))?;
            Ok(found)
        })?;
        let Grid { exit, lo: lower, hi: upper, nx, ny } = grid;
        let extent = upper - lower;
        let mut node_of = vec![u32::MAX; mesh.vertices.len()];
        let mut vertex_at = vec![u32::MAX; nx * ny];
        for &v in &exit {
            let p = mesh.vertices[v as usize];
            let i = ((p.x - lower.x) / extent.x * (nx - 1) as f64).round() as usize;
            let j = ((p.y - lower.y) / extent.y * (ny - 1) as f64).round() as usize;
            let node = j * nx + i;
            if vertex_at[node] != u32::MAX {
                return Err(BlockError::Grid { why: format!("two vertices stand at column {i}, row {j}") });
            }
            vertex_at[node] = v;
            node_of[v as usize] = node as u32;
        }
        let known: Vec<bool> = vertex_at.iter().map(|&v| v != u32::MAX).collect();
        let height = |&v: &u32| mesh.vertices.get(v as usize).map_or(f64::NAN, |at| at.z);
        let mut heights: Vec<f64> = vertex_at.iter().map(height).collect();
        let (diagonals, mut normals) = cells(mesh, &node_of, &known, nx, ny)?;
        let border = match border {
            Some(points) => {
                let border = Border::new(points, known).ok_or_else(not_around)?;
                border.complete(&mut heights, (nx, ny), lower, upper);
                normals = None;
                Some(Arc::new(border))
            }
            None => None,
        };
        let framed = rim_z.is_some() && border.is_some();
        let entry_border = if framed { Some(around_entry(mesh, in_entry)?) } else { None };
        Ok(Self {
            lower,
            upper,
            entry_z: lo.z,
            nx,
            ny,
            xs: places(nx, lower.x, upper.x),
            ys: places(ny, lower.y, upper.y),
            heights: Arc::new(heights),
            diagonals: Arc::new(diagonals),
            spline: None,
            normals,
            slopes: None,
            rim_z,
            border,
            entry_face: (lo.truncate(), hi.truncate()),
            entry_border,
        })
    }

    /// A block whose file has its exit face as a surface.
    fn trimmed(mesh: &Mesh, face: &TrimmedFace, in_entry: impl Fn(u32) -> bool) -> Result<Self, BlockError> {
        let ((nx, ny), lower, upper) = (face.nodes, face.lower_mm, face.upper_mm);
        let (lo, hi) = mesh.bounds();
        let entry_border = if face.rim_z_mm.is_some() { Some(around_entry(mesh, in_entry)?) } else { None };
        let block = Self {
            lower,
            upper,
            entry_z: lo.z,
            nx,
            ny,
            xs: places(nx, lower.x, upper.x),
            ys: places(ny, lower.y, upper.y),
            heights: Arc::new(face.heights_mm.clone()),
            diagonals: Arc::new(vec![Diagonal::Rising; (nx - 1) * (ny - 1)]),
            normals: None,
            slopes: None,
            spline: None,
            rim_z: face.rim_z_mm,
            border: None,
            entry_face: (lo.truncate(), hi.truncate()),
            entry_border,
        };
        block.within(face.outline_mm.clone())
    }

    /// A block of this size (mm, centred on the axis) whose exit face has `nx` by `ny` nodes at these heights (mm, row-major: rows along `+y`), and whose entry face
    /// is at `entry_z_mm`: what [`from_mesh`](Self::from_mesh) makes of such a solid, without the mesh.
    ///
    /// # Errors
    /// [`BlockError::Grid`] for fewer than 4 nodes along a side, another number of heights, or a height that is not above the entry face.
    pub fn from_heights(
        size_mm: DVec2,
        entry_z_mm: f64,
        (nx, ny): (usize, usize),
        heights: Vec<f64>,
    ) -> Result<Self, BlockError> {
        let refused = |why: String| Err(BlockError::Grid { why });
        if nx.min(ny) < Bicubic::LEAST_NODES || nx.checked_mul(ny) != Some(heights.len()) {
            return refused(format!("{} heights on {nx} columns and {ny} rows", heights.len()));
        }
        above(&heights, nx, entry_z_mm)?;
        let (lower, upper) = (-0.5 * size_mm, 0.5 * size_mm);
        Ok(Self {
            lower,
            upper,
            entry_z: entry_z_mm,
            nx,
            ny,
            xs: places(nx, lower.x, upper.x),
            ys: places(ny, lower.y, upper.y),
            heights: Arc::new(heights),
            diagonals: Arc::new(vec![Diagonal::Rising; (nx - 1) * (ny - 1)]),
            spline: None,
            normals: None,
            slopes: None,
            rim_z: None,
            border: None,
            entry_face: (lower, upper),
            entry_border: None,
        })
    }

    /// The same block with an entry face of another size: with glass around the exit face by which oblique light can come to all of
    /// it, as a rim lower than the face has.
    ///
    /// # Errors
    /// [`BlockError::Grid`] for an entry face that does not reach under all of the exit face.
    pub fn with_entry_face(mut self, lower_mm: DVec2, upper_mm: DVec2) -> Result<Self, BlockError> {
        if !(lower_mm.cmple(self.lower).all() && upper_mm.cmpge(self.upper).all() && (upper_mm - lower_mm).is_finite())
        {
            return Err(BlockError::Grid {
                why: format!("an entry face from {lower_mm} mm to {upper_mm} mm is not under all of the exit face"),
            });
        }
        self.entry_face = (lower_mm, upper_mm);
        Ok(self)
    }

    /// The same block with the spline through its nodes at hand, for all tracers that will be made of it.
    #[must_use]
    pub fn with_spline(mut self) -> Self {
        self.spline = Some(self.spline());
        self
    }

    /// The spline through the nodes.
    pub(crate) fn spline(&self) -> Arc<Bicubic> {
        let (lower, upper) = (self.lower.to_array(), self.upper.to_array());
        let through = || Arc::new(Bicubic::through(&self.heights, self.nx, self.ny, lower, upper));
        self.spline.clone().unwrap_or_else(through)
    }

    /// The same block cut off along the walls below a closed curve of points, mm: nodes beyond it continue the face.
    ///
    /// # Errors
    /// [`BlockError::Grid`] for points that do not go once around the middle of their bounds, seen from it.
    pub fn within(mut self, around: Vec<DVec3>) -> Result<Self, BlockError> {
        let refused = || BlockError::Grid { why: "the outline does not go once around the exit face".into() };
        let mut border = Border::new(around, Vec::new()).ok_or_else(refused)?;
        border.known =
            (0..self.heights.len()).map(|k| border.covers(self.node(k % self.nx, k / self.nx).truncate())).collect();
        self.border = Some(Arc::new(border));
        Ok(self)
    }

    /// The points on the outline of an exit face that is no rectangle, mm, in order around it.
    pub fn outline(&self) -> Option<&[DVec3]> {
        self.border.as_ref().map(|border| border.points())
    }

    /// Nodes of the exit face along x and y.
    pub fn nodes(&self) -> (usize, usize) {
        (self.nx, self.ny)
    }

    /// The plane of the rim around the exit face, mm, if there is one. Light that would hit a rim above the face ends there.
    pub fn rim_z_mm(&self) -> Option<f64> {
        self.rim_z
    }

    /// Size of the exit face along x and y, mm.
    pub fn size_mm(&self) -> DVec2 {
        self.upper - self.lower
    }

    /// Position of the entry face, mm.
    pub fn entry_z_mm(&self) -> f64 {
        self.entry_z
    }

    /// Least and greatest corner of the entry face, mm: a rim belongs to it.
    pub fn entry_face_mm(&self) -> (DVec2, DVec2) {
        self.entry_face
    }

    /// Whether the exit face is a rectangle. Else its outline is a polygon of the file's vertices, and nodes beyond it carry heights that
    /// continue the face.
    pub fn is_rectangular(&self) -> bool {
        self.border.is_none()
    }

    /// Whether a point of the plan, mm, lies within the outline of the exit face.
    #[inline]
    pub fn covers(&self, at: DVec2) -> bool {
        self.border.as_ref().is_none_or(|border| border.covers(at))
    }

    /// Whether a point of the plan, mm, lies within the entry face of a block whose exit face is no rectangle.
    #[inline]
    pub(crate) fn enters(&self, at: DVec2) -> bool {
        match &self.entry_border {
            Some(border) => border.covers(at),
            None => self.covers(at),
        }
    }

    /// Where the straight way from a point within the outline of an exit face that is no rectangle to one beyond crosses it, as a part of the
    /// way.
    pub(crate) fn leaves_at(&self, inside: DVec2, outside: DVec2) -> f64 {
        let (mut near, mut far) = (0.0, 1.0);
        for _ in 0..40 {
            let middle = 0.5 * (near + far);
            if self.covers(inside.lerp(outside, middle)) { near = middle } else { far = middle }
        }
        0.5 * (near + far)
    }

    /// Whether the file has a vertex at this node of the exit face, counted row by row: beyond an outline it has none.
    pub fn knows(&self, node: usize) -> bool {
        self.border.as_ref().is_none_or(|border| border.known[node])
    }

    /// Heights of the exit face at its nodes, mm, row-major: rows along `+y`, columns along `+x`.
    pub fn heights_mm(&self) -> &[f64] {
        &self.heights
    }

    /// Mean of the node heights, mm: 0 in a file that keeps to the frame.
    pub fn mean_exit_z_mm(&self) -> f64 {
        if let Some(border) = &self.border {
            // The file leaves out nodes that are next to the outline; where they would be, the face is known too.
            let within = |k: &usize| border.covers(self.node(k % self.nx, k / self.nx).truncate());
            let (sum, count) = (0..self.heights.len())
                .filter(within)
                .fold((0.0, 0), |(sum, count), k| (sum + self.heights[k], count + 1));
            return sum / f64::from(count);
        }
        self.heights.chunks(self.nx).map(|row| row.iter().sum::<f64>()).sum::<f64>() / self.heights.len() as f64
    }

    /// Least and greatest height of the file's vertices on the exit face, mm.
    pub fn height_range_mm(&self) -> (f64, f64) {
        let nodes = (0..self.heights.len()).filter(|&k| self.knows(k)).map(|k| self.heights[k]);
        let border = self.border.iter().flat_map(|border| border.heights());
        nodes.chain(border).fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), z| (lo.min(z), hi.max(z)))
    }

    /// Glass between the entry face and the lowest point of the exit face, mm.
    pub fn min_thickness_mm(&self) -> f64 {
        self.height_range_mm().0 - self.entry_z
    }

    /// Whether the file gives normals at the nodes of the exit face.
    pub fn has_normals(&self) -> bool {
        self.normals.is_some()
    }

    /// Position of node `(i, j)`, mm. The ends are exact.
    #[inline]
    pub(crate) fn node(&self, i: usize, j: usize) -> DVec3 {
        DVec3::new(self.xs[i], self.ys[j], self.heights[j * self.nx + i])
    }

    /// The grid lines on both sides of cell `(i, j)`, mm.
    #[inline]
    pub(crate) fn lines(&self, i: usize, j: usize) -> ([f64; 2], [f64; 2]) {
        ([self.xs[i], self.xs[i + 1]], [self.ys[j], self.ys[j + 1]])
    }
}

/// Demands that all heights are above the entry face.
fn above(heights: &[f64], nx: usize, entry_z_mm: f64) -> Result<(), BlockError> {
    let Some(k) = heights.iter().position(|z| !(z.is_finite() && *z > entry_z_mm)) else { return Ok(()) };
    let (i, j, z) = (k % nx, k / nx, heights[k]);
    let why = format!("the height at column {i}, row {j} is {z} mm, not above the entry face at {entry_z_mm} mm");
    Err(BlockError::Grid { why })
}

/// Places of `n` grid lines from `lo` to `hi`. The ends are exact.
fn places(n: usize, lo: f64, hi: f64) -> Vec<f64> {
    let place = |k: usize| k as f64 / (n - 1) as f64;
    (0..n).map(|k| lo * (1.0 - place(k)) + hi * place(k)).collect()
}

/// The curve around the entry face.
fn around_entry(mesh: &Mesh, in_entry: impl Fn(u32) -> bool) -> Result<Arc<Border>, BlockError> {
    let around = || BlockError::Grid { why: "the walls do not go once around the entry face".into() };
    let bottoms = wall_tops(mesh, |v| !in_entry(v));
    let points = (0..mesh.vertices.len()).filter(|&v| bottoms[v]).map(|v| mesh.vertices[v]).collect();
    Ok(Arc::new(Border::new(points, Vec::new()).ok_or_else(around)?))
}

fn not_around() -> BlockError {
    BlockError::Grid { why: "the walls do not go once around the exit face".into() }
}

/// The vertices of an exit face and their lines.
struct Grid {
    exit: Vec<u32>,
    lo: DVec2,
    hi: DVec2,
    nx: usize,
    ny: usize,
}

impl Grid {
    /// Demands that these vertices are a regular grid, as seen from above.
    fn over(mesh: &Mesh, exit: Vec<u32>) -> Result<Self, BlockError> {
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
        Ok(Self { exit, lo, hi, nx, ny })
    }

    /// Demands that these vertices are a regular grid but for those where the walls end, which go around it; returns the grid
    /// that reaches around them, too, and them.
    fn within(mesh: &Mesh, in_entry: impl Fn(u32) -> bool, above: &[u32]) -> Result<(Self, Vec<DVec3>), BlockError> {
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
        Ok((Self { exit, lo: lo - before * spacing, hi: hi + after * spacing, nx, ny }, points))
    }
}

/// By how much of a spacing an outline may miss the lines of the grid that touch it, and the most lines between it and the nodes.
const OUTLINE_TOLERANCE: f64 = 0.05;
const MOST_BEYOND: f64 = 8.0;
/// One in so many nodes of a grid is within the outline at least, of more than a few.
const LEAST_FILLED: usize = 4;
const FEW_NODES: usize = 1 << 10;

/// The level plane, facing up, that reaches the edge of the solid at its least x: which vertices lie on its triangles, and its
/// height. `None` if there is no such plane.
fn rim(mesh: &Mesh, in_entry: impl Fn(u32) -> bool, lo: DVec3) -> Option<(Vec<bool>, f64)> {
    let at = |v: u32| mesh.vertices[v as usize];
    let size = mesh.bounds().1 - lo;
    let tolerance = PLANE_TOLERANCE * size.max_element();
    let level = |k: usize, z: f64| {
        let [a, b, c] = mesh.corners(k);
        [a, b, c].iter().all(|p| (p.z - z).abs() <= tolerance) && (b - a).cross(c - a).z > 0.0
    };
    let z = (0..mesh.triangles.len()).find_map(|k| {
        let [a, ..] = mesh.triangles[k];
        let at_edge = mesh.triangles[k].iter().any(|&v| at(v).x <= lo.x + tolerance);
        (at_edge && !in_entry(a) && level(k, at(a).z)).then(|| at(a).z)
    })?;
    let mut in_rim = vec![false; mesh.vertices.len()];
    for k in (0..mesh.triangles.len()).filter(|&k| level(k, z)) {
        mesh.triangles[k].iter().for_each(|&v| in_rim[v as usize] = true);
    }
    Some((in_rim, z))
}

/// Area of everything that faces up, as seen from above, mm².
fn plan_area(mesh: &Mesh) -> f64 {
    let area = |k: usize| {
        let [a, b, c] = mesh.corners(k);
        (0.5 * (b - a).cross(c - a).z).max(0.0)
    };
    (0..mesh.triangles.len()).map(area).sum()
}

/// Demands that the lowest plane is covered by a face of this area.
fn entry_face(mesh: &Mesh, in_entry: impl Fn(u32) -> bool, lo: DVec3, needed_mm2: f64) -> Result<(), BlockError> {
    let (mut triangles, mut area_mm2) = (0, 0.0);
    for (k, triangle) in mesh.triangles.iter().enumerate() {
        if triangle.iter().all(|&v| in_entry(v)) {
            let [a, b, c] = mesh.corners(k);
            triangles += 1;
            area_mm2 -= 0.5 * (b - a).cross(c - a).z;
        }
    }
    // Not an f32 tolerance but a question of shape: a disc has 0.785 of its outline.
    if (area_mm2 - needed_mm2).abs() > 1e-4 * needed_mm2 {
        return Err(BlockError::EntryFace { triangles, z_mm: lo.z, area_mm2, needed_mm2 });
    }
    Ok(())
}

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
    // Within a line coordinates differ by rounding only. The gap separates up to 50 000 lines from f32 noise.
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
fn cells(
    mesh: &Mesh,
    node_of: &[u32],
    known: &[bool],
    nx: usize,
    ny: usize,
) -> Result<(Vec<Diagonal>, Option<Vec<DVec3>>), BlockError> {
    // For every cell the corner which each triangle leaves out, as a set of bits: one triangle of each cut has both of
    // two opposite bits.
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
            // Corner 1 is (+x, 0), corner 2 is (0, +y): leaving these out in turn, the cut joins the other two.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_make_a_block_or_are_refused_with_their_place() {
        let size = DVec2::new(20.0, 10.0);
        let block = Block::from_heights(size, -3.0, (5, 4), (0..20).map(f64::from).collect()).unwrap();
        assert_eq!((block.nodes(), block.size_mm(), block.min_thickness_mm()), ((5, 4), size, 3.0));
        assert_eq!(block.node(4, 3), DVec3::new(10.0, 5.0, 19.0));
        assert!(Block::from_heights(size, -3.0, (5, 4), vec![0.0; 19]).is_err());
        assert!(Block::from_heights(size, -3.0, (3, 4), vec![0.0; 12]).is_err());
        let around = |radius: f64| -> Vec<DVec3> {
            (0..40).map(|k| (radius * DVec2::from_angle(f64::from(k))).extend(2.0)).collect()
        };
        let disc = block.clone().within(around(4.0)).unwrap();
        assert!(!disc.is_rectangular() && disc.covers(DVec2::new(0.0, 3.9)) && !disc.covers(DVec2::new(4.1, 0.0)));
        assert_eq!(disc.outline().unwrap().len(), 40);
        // The four nodes within 4 mm, and the outline.
        assert_eq!(disc.height_range_mm(), (2.0, 12.0));
        assert!(block.clone().within(around(0.0)).is_err());
        let mut sunken = vec![0.0; 20];
        sunken[7] = -3.0;
        let error = Block::from_heights(size, -3.0, (5, 4), sunken).unwrap_err().to_string();
        assert!(error.contains("column 2, row 1"), "{error}");
    }
}
