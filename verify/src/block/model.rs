//! A block as the verifier knows it: an entry plane, an exit face over a regular grid, an outline,
//! perhaps a rim.

use super::{cell::Diagonal, error::BlockError, outline::Outline};
use crate::spline::Bicubic;
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// A block of glass whose exit face is a height field on a regular grid of vertices.
#[derive(Clone, Debug)]
pub struct Block {
    pub(crate) lower: DVec2,
    pub(crate) upper: DVec2,
    pub(crate) entry_z: f64,
    pub(crate) nx: usize,
    pub(crate) ny: usize,
    /// Places of the grid lines, mm.
    pub(super) xs: Vec<f64>,
    pub(super) ys: Vec<f64>,
    /// Heights at the nodes, mm, row-major, rows along +y.
    pub(crate) heights: Arc<Vec<f64>>,
    /// How every cell is cut into two triangles.
    pub(crate) diagonals: Arc<Vec<Diagonal>>,
    /// The spline through the nodes, if it is at hand.
    pub(super) spline: Option<Arc<Bicubic>>,
    /// Normals at the nodes as the file gives them.
    pub(crate) normals: Option<Vec<DVec3>>,
    /// Slopes at the nodes, where they are known.
    pub(crate) slopes: Option<Arc<Vec<DVec2>>>,
    /// The plane around the exit face, mm, if there is one.
    pub(super) rim_z: Option<f64>,
    /// The curve around the exit face, if that is no rectangle.
    pub(super) outline: Option<Arc<Outline>>,
    /// Least and greatest corner of the entry face, mm.
    pub(super) entry_face: (DVec2, DVec2),
    /// The curve around an entry face that is neither a rectangle nor the plan of the exit face.
    pub(super) entry_outline: Option<Arc<Outline>>,
}

impl Block {
    /// A block of this size (mm, centred on the axis) whose exit face has `nx` by `ny` nodes at
    /// these heights (mm, row-major: rows along `+y`), and whose entry face is at `entry_z_mm`:
    /// what [`from_mesh`](Self::from_mesh) makes of such a solid, without the mesh.
    ///
    /// # Errors
    /// [`BlockError::Grid`] for fewer than 4 nodes along a side, another number of heights, or a
    /// height that is not above the entry face.
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
            outline: None,
            entry_face: (lower, upper),
            entry_outline: None,
        })
    }

    /// The same block with an entry face of another size: with glass around the exit face by which
    /// oblique light can come to all of it, as a rim lower than the face has.
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

    /// The same block with the spline through its nodes at hand, for all tracers that will be made
    /// of it.
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

    /// The same block cut off along the walls below a closed curve of points, mm: nodes beyond it
    /// continue the face.
    ///
    /// # Errors
    /// [`BlockError::Grid`] for points that do not go once around the middle of their bounds, seen
    /// from it.
    pub fn trimmed_to(mut self, around: Vec<DVec3>) -> Result<Self, BlockError> {
        let refused = || BlockError::Grid { why: "the outline does not go once around the exit face".into() };
        let mut outline = Outline::new(around, Vec::new()).ok_or_else(refused)?;
        outline.known =
            (0..self.heights.len()).map(|k| outline.covers(self.node(k % self.nx, k / self.nx).truncate())).collect();
        self.outline = Some(Arc::new(outline));
        Ok(self)
    }

    /// The points on the outline of an exit face that is no rectangle, mm, in order around it.
    pub fn outline(&self) -> Option<&[DVec3]> {
        self.outline.as_ref().map(|outline| outline.points())
    }

    /// Nodes of the exit face along x and y.
    pub fn nodes(&self) -> (usize, usize) {
        (self.nx, self.ny)
    }

    /// The plane of the rim around the exit face, mm, if there is one. Light that would hit a rim
    /// above the face ends there.
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

    /// Whether the exit face is a rectangle. Else its outline is a polygon of the file's vertices,
    /// and nodes beyond it carry heights that continue the face.
    pub fn is_rectangular(&self) -> bool {
        self.outline.is_none()
    }

    /// Whether a point of the plan, mm, lies within the outline of the exit face.
    #[inline]
    pub fn covers(&self, at: DVec2) -> bool {
        self.outline.as_ref().is_none_or(|outline| outline.covers(at))
    }

    /// Whether a point of the plan, mm, lies within the entry face of a block whose exit face is no
    /// rectangle.
    #[inline]
    pub(crate) fn enters(&self, at: DVec2) -> bool {
        match &self.entry_outline {
            Some(outline) => outline.covers(at),
            None => self.covers(at),
        }
    }

    /// Where the straight way from a point within the outline of an exit face that is no rectangle
    /// to one beyond crosses it, as a part of the way.
    pub(crate) fn leaves_at(&self, inside: DVec2, outside: DVec2) -> f64 {
        let (mut near, mut far) = (0.0, 1.0);
        for _ in 0..40 {
            let middle = 0.5 * (near + far);
            if self.covers(inside.lerp(outside, middle)) { near = middle } else { far = middle }
        }
        0.5 * (near + far)
    }

    /// Whether the file has a vertex at this node of the exit face, counted row by row: beyond an
    /// outline it has none.
    pub fn knows(&self, node: usize) -> bool {
        self.outline.as_ref().is_none_or(|outline| outline.known[node])
    }

    /// Heights of the exit face at its nodes, mm, row-major: rows along `+y`, columns along `+x`.
    pub fn heights_mm(&self) -> &[f64] {
        &self.heights
    }

    /// Mean of the node heights, mm: 0 in a file that keeps to the frame.
    pub fn mean_exit_z_mm(&self) -> f64 {
        if let Some(outline) = &self.outline {
            // The file leaves out nodes that are next to the outline; where they would be, the face
            // is known too.
            let within = |k: &usize| outline.covers(self.node(k % self.nx, k / self.nx).truncate());
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
        let outline = self.outline.iter().flat_map(|outline| outline.heights());
        nodes.chain(outline).fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), z| (lo.min(z), hi.max(z)))
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
pub(super) fn above(heights: &[f64], nx: usize, entry_z_mm: f64) -> Result<(), BlockError> {
    let Some(k) = heights.iter().position(|z| !(z.is_finite() && *z > entry_z_mm)) else { return Ok(()) };
    let (i, j, z) = (k % nx, k / nx, heights[k]);
    let why = format!("the height at column {i}, row {j} is {z} mm, not above the entry face at {entry_z_mm} mm");
    Err(BlockError::Grid { why })
}

/// Places of `n` grid lines from `lo` to `hi`. The ends are exact.
pub(super) fn places(n: usize, lo: f64, hi: f64) -> Vec<f64> {
    let place = |k: usize| k as f64 / (n - 1) as f64;
    (0..n).map(|k| lo * (1.0 - place(k)) + hi * place(k)).collect()
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
        let disc = block.clone().trimmed_to(around(4.0)).unwrap();
        assert!(!disc.is_rectangular() && disc.covers(DVec2::new(0.0, 3.9)) && !disc.covers(DVec2::new(4.1, 0.0)));
        assert_eq!(disc.outline().unwrap().len(), 40);
        // The four nodes within 4 mm, and the outline.
        assert_eq!(disc.height_range_mm(), (2.0, 12.0));
        assert!(block.clone().trimmed_to(around(0.0)).is_err());
        let mut sunken = vec![0.0; 20];
        sunken[7] = -3.0;
        let error = Block::from_heights(size, -3.0, (5, 4), sunken).unwrap_err().to_string();
        assert!(error.contains("column 2, row 1"), "{error}");
    }
}
