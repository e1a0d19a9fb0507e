//! A block as the verifier knows it: an entry face, an exit face over a regular grid, an outline,
//! perhaps a rim.

use super::{error::BlockError, outline::Outline, relief::Relief};
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// A block of glass whose exit face is a height field on a regular grid of vertices.
#[derive(Clone, Debug)]
pub struct Block {
    /// The exit face.
    pub(crate) exit: Relief,
    /// The plane of the entry face, mm; of one that is not planar, its mean.
    pub(crate) entry_z: f64,
    /// The entry face, where it is not planar. It lies under all of the exit face.
    pub(crate) entry: Option<Relief>,
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
        let exit = Relief::from_heights((-0.5 * size_mm, 0.5 * size_mm), (nx, ny), heights)?;
        let block = Self::over(exit, entry_z_mm);
        block.stands_on_its_entry()?;
        Ok(block)
    }

    /// A rectangular block without a rim.
    pub(super) fn over(exit: Relief, entry_z: f64) -> Self {
        Self {
            entry_face: (exit.lower, exit.upper),
            exit,
            entry_z,
            entry: None,
            normals: None,
            slopes: None,
            rim_z: None,
            outline: None,
            entry_outline: None,
        }
    }

    /// Demands that all of the exit face is above the entry face.
    pub(super) fn stands_on_its_entry(&self) -> Result<(), BlockError> {
        let none = |glass: f64| !(glass.is_finite() && glass > 0.0);
        let Some(k) = self.glass_mm().position(none) else { return Ok(()) };
        let of_exit = self.exit.heights.len();
        let (which, face, k) = match &self.entry {
            Some(entry) if k >= of_exit => ("entry", entry, k - of_exit),
            _ => ("exit", &self.exit, k),
        };
        let (i, j, z, below) = (k % face.nx, k / face.nx, face.heights[k], self.entry_below(face.place(k)));
        let why = format!(
            "the {which} face at column {i}, row {j} is at {z} mm: the exit face is not above the entry face there, at {below} mm"
        );
        Err(BlockError::Grid { why })
    }

    /// The glass along the axis at the nodes of the exit face, and at those of an entry face that is
    /// not planar, mm.
    fn glass_mm(&self) -> impl Iterator<Item = f64> {
        let of_exit = self.exit.heights.iter().enumerate().map(|(k, z)| z - self.entry_below(self.exit.place(k)));
        let below = |(entry, k): (&Relief, usize)| self.exit.height_between_nodes(entry.place(k)) - entry.heights[k];
        let nodes = self.entry.iter().flat_map(|entry| (0..entry.heights.len()).map(move |k| (entry, k)));
        of_exit.chain(nodes.map(below))
    }

    /// Height of the entry face under a point of the plan, mm.
    fn entry_below(&self, at: DVec2) -> f64 {
        self.entry.as_ref().map_or(self.entry_z, |entry| entry.height_between_nodes(at))
    }

    /// The same block with an entry face of another size: with glass around the exit face by which
    /// oblique light can come to all of it, as a rim lower than the face has.
    ///
    /// # Errors
    /// [`BlockError::Grid`] for an entry face that does not reach under all of the exit face, or
    /// that is not planar.
    pub fn with_entry_face(mut self, lower_mm: DVec2, upper_mm: DVec2) -> Result<Self, BlockError> {
        if self.entry.is_some() {
            return Err(BlockError::Grid {
                why: "an entry face that is not planar has the size of the exit face".into(),
            });
        }
        if !(lower_mm.cmple(self.exit.lower).all()
            && upper_mm.cmpge(self.exit.upper).all()
            && (upper_mm - lower_mm).is_finite())
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
        self.exit = self.exit.with_spline();
        self.entry = self.entry.map(Relief::with_spline);
        self
    }

    /// The same block cut off along the walls below a closed curve of points, mm: nodes beyond it
    /// continue the face.
    ///
    /// # Errors
    /// [`BlockError::Grid`] for points that do not go once around the middle of their bounds, seen
    /// from it, and for an entry face that is not planar.
    pub fn trimmed_to(mut self, around: Vec<DVec3>) -> Result<Self, BlockError> {
        if self.entry.is_some() {
            return Err(BlockError::Grid { why: "an entry face that is not planar has no outline".into() });
        }
        let refused = || BlockError::Grid { why: "the outline does not go once around the exit face".into() };
        let mut outline = Outline::new(around, Vec::new()).ok_or_else(refused)?;
        outline.known = (0..self.exit.heights.len()).map(|k| outline.covers(self.exit.place(k))).collect();
        self.outline = Some(Arc::new(outline));
        Ok(self)
    }

    /// The points on the outline of an exit face that is no rectangle, mm, in order around it.
    pub fn outline(&self) -> Option<&[DVec3]> {
        self.outline.as_ref().map(|outline| outline.points())
    }

    /// Nodes of the exit face along x and y.
    pub fn nodes(&self) -> (usize, usize) {
        (self.exit.nx, self.exit.ny)
    }

    /// The plane of the rim around the exit face, mm, if there is one. Light that would hit a rim
    /// above the face ends there.
    pub fn rim_z_mm(&self) -> Option<f64> {
        self.rim_z
    }

    /// Size of the exit face along x and y, mm.
    pub fn size_mm(&self) -> DVec2 {
        self.exit.upper - self.exit.lower
    }

    /// Position of the entry face, mm; of one that is not planar, the mean of its nodes.
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
        &self.exit.heights
    }

    /// Mean of the node heights, mm: 0 in a file that keeps to the frame.
    pub fn mean_exit_z_mm(&self) -> f64 {
        if let Some(outline) = &self.outline {
            // The file leaves out nodes that are next to the outline; where they would be, the face
            // is known too.
            let within = |&k: &usize| outline.covers(self.exit.place(k));
            let (sum, count) = (0..self.exit.heights.len())
                .filter(within)
                .fold((0.0, 0), |(sum, count), k| (sum + self.exit.heights[k], count + 1));
            return sum / f64::from(count);
        }
        self.exit.mean_mm()
    }

    /// Least and greatest height of the file's vertices on the exit face, mm.
    pub fn height_range_mm(&self) -> (f64, f64) {
        let nodes = (0..self.exit.heights.len()).filter(|&k| self.knows(k)).map(|k| self.exit.heights[k]);
        let outline = self.outline.iter().flat_map(|outline| outline.heights());
        nodes.chain(outline).fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), z| (lo.min(z), hi.max(z)))
    }

    /// The least glass between the faces along the axis, mm: between the entry face and the lowest
    /// point of the exit face, or, where both have a relief, at the nodes of either.
    pub fn min_thickness_mm(&self) -> f64 {
        if self.entry.is_none() {
            return self.height_range_mm().0 - self.entry_z;
        }
        self.glass_mm().fold(f64::INFINITY, f64::min)
    }

    /// Nodes along x and y of an entry face that is not planar, and their heights, mm, row-major:
    /// rows along `+y`, columns along `+x`, over the same rectangle as the exit face.
    pub fn entry_heights_mm(&self) -> Option<((usize, usize), &[f64])> {
        self.entry.as_ref().map(|entry| ((entry.nx, entry.ny), &entry.heights[..]))
    }

    /// Greatest z of the exit face, or of a rim around it, mm.
    pub fn highest_mm(&self) -> f64 {
        self.height_range_mm().1.max(self.rim_z.unwrap_or(f64::NEG_INFINITY))
    }

    /// Least z of the entry face, mm.
    pub fn lowest_mm(&self) -> f64 {
        self.entry.as_ref().map_or(self.entry_z, |entry| entry.range_mm().0)
    }

    /// Whether the file gives normals at the nodes of the exit face.
    pub fn has_normals(&self) -> bool {
        self.normals.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_make_a_block_or_are_refused_with_their_place() {
        let size = DVec2::new(20.0, 10.0);
        let block = Block::from_heights(size, -3.0, (5, 4), (0..20).map(f64::from).collect()).unwrap();
        assert_eq!((block.nodes(), block.size_mm(), block.min_thickness_mm()), ((5, 4), size, 3.0));
        assert_eq!(block.exit.node(4, 3), DVec3::new(10.0, 5.0, 19.0));
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
