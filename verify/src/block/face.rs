//! A block with another face than that of its file: worked on, thicker, or known better than by its
//! heights.

use super::{error::BlockError, model::Block, relief::Relief};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::sync::Arc;

impl Block {
    /// The same block with an exit face of `nx` by `ny` nodes at these heights over the same plan:
    /// mm in the block's own frame, row-major, rows along `+y`. Entry face, walls, rim and outline
    /// stay where they are.
    ///
    /// # Errors
    /// Those of [`from_heights`](Self::from_heights).
    pub fn with_face(mut self, (nx, ny): (usize, usize), heights: Vec<f64>) -> Result<Self, BlockError> {
        self.exit = Relief::from_heights((self.exit.lower, self.exit.upper), (nx, ny), heights)?;
        self.stands_on_its_entry()?;
        (self.normals, self.slopes) = (None, None);
        if let Some(outline) = &self.outline {
            let known = (0..nx * ny).into_par_iter().map(|k| outline.covers(self.exit.place(k)));
            let outline = outline.with_face(known.collect(), |at| self.exit.height_between_nodes(at));
            self.outline = Some(Arc::new(outline));
        }
        Ok(self)
    }

    /// The same with slopes at the nodes besides (mm per mm), which
    /// [`Surface::Smooth`](crate::Surface::Smooth) interpolates: of a face whose slopes jump, as
    /// between the rows of a cutter, they are known better than any spline through the heights
    /// tells them.
    ///
    /// # Errors
    /// Those of [`with_face`](Self::with_face), another number of slopes, or one that is not
    /// finite.
    pub fn with_sloped_face(
        self,
        nodes: (usize, usize),
        heights: Vec<f64>,
        slopes: Vec<DVec2>,
    ) -> Result<Self, BlockError> {
        let face = self.with_face(nodes, heights)?;
        if slopes.len() != face.exit.heights.len() {
            return Err(BlockError::Grid {
                why: format!("{} slopes at {} nodes", slopes.len(), face.exit.heights.len()),
            });
        }
        if let Some(k) = slopes.iter().position(|slope| !slope.is_finite()) {
            let (i, j) = (k % face.exit.nx, k / face.exit.nx);
            return Err(BlockError::Grid { why: format!("the slope at column {i}, row {j} is {}", slopes[k]) });
        }
        Ok(Self { slopes: Some(Arc::new(slopes)), ..face })
    }

    /// The same block with its entry face at `entry_z_mm`: one that is not planar keeps its shape,
    /// and its mean comes there.
    ///
    /// # Errors
    /// [`BlockError::Grid`] for one that is not below all of the exit face.
    pub fn with_entry_z(mut self, entry_z_mm: f64) -> Result<Self, BlockError> {
        self.entry = self.entry.map(|entry| entry.moved(entry_z_mm - self.entry_z));
        self.entry_z = entry_z_mm;
        self.stands_on_its_entry()?;
        Ok(self)
    }

    /// The same block with an entry face of `nx` by `ny` nodes at these heights under its exit
    /// face: mm in the block's own frame, row-major, rows along `+y`.
    ///
    /// # Errors
    /// [`BlockError::Grid`] for fewer than 4 nodes along a side, another number of heights, one
    /// that is not below the exit face, or a block with an outline or a rim.
    pub fn with_entry_heights(self, nodes: (usize, usize), heights: Vec<f64>) -> Result<Self, BlockError> {
        if self.outline.is_some() || self.entry_face != (self.exit.lower, self.exit.upper) {
            let why = "an entry face that is not planar lies under a rectangular exit face without a rim".into();
            return Err(BlockError::Grid { why });
        }
        let entry = Relief::from_heights(self.entry_face, nodes, heights)?;
        self.on(entry)
    }

    /// A block between two faces.
    pub(super) fn of_faces(exit: Relief, normals: Option<Vec<DVec3>>, entry: Relief) -> Result<Self, BlockError> {
        Self { normals, ..Self::over(exit, f64::NEG_INFINITY) }.on(entry)
    }

    fn on(mut self, entry: Relief) -> Result<Self, BlockError> {
        self.entry_z = entry.mean_mm();
        self.entry = Some(entry);
        self.stands_on_its_entry()?;
        Ok(self)
    }

    /// Heights at the nodes, mm, of a block that is not needed any more; without a copy where
    /// nothing else holds on to them.
    pub fn into_heights_mm(self) -> Vec<f64> {
        self.exit.into_heights()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::shading::node_normals;

    #[test]
    fn a_block_keeps_everything_but_its_face() {
        let size = DVec2::new(20.0, 10.0);
        let around = (0..40).map(|k| (4.0 * DVec2::from_angle(f64::from(k))).extend(2.0)).collect();
        let plain = Block::from_heights(size, -3.0, (5, 4), vec![2.0; 20]).unwrap();
        let plain = plain.with_entry_face(0.6 * -size, 0.7 * size).unwrap();
        let disc = plain.clone().trimmed_to(around).unwrap();
        // z = x / 10 + 1, on other nodes.
        let ramp: Vec<f64> = (0..77).map(|k| 0.2 * f64::from(k % 11)).collect();
        let (plain, disc) = [plain, disc].map(|block| block.with_face((11, 7), ramp.clone()).unwrap()).into();
        assert_eq!((plain.nodes(), plain.size_mm(), plain.height_range_mm()), ((11, 7), size, (0.0, 2.0)));
        assert_eq!(plain.entry_face_mm(), (0.6 * -size, 0.7 * size));
        assert!(disc.outline().unwrap().iter().all(|p| (p.z - 1.0 - 0.1 * p.x).abs() < 1e-12));
        assert!(disc.knows(38) && !disc.knows(0) && disc.height_range_mm().0 > 0.59);
        assert!(plain.clone().with_face((11, 7), vec![0.0; 76]).is_err());
        assert!(plain.clone().with_face((11, 7), vec![-3.0; 77]).is_err());
        assert_eq!(plain.clone().with_entry_z(-0.5).unwrap().min_thickness_mm(), 0.5);
        assert!(plain.clone().with_entry_z(0.0).is_err());
        assert_eq!(plain.clone().into_heights_mm(), ramp);
        let slopes = vec![DVec2::new(0.1, 0.0); 77];
        let sloped = |slopes: Vec<DVec2>| plain.clone().with_sloped_face((11, 7), ramp.clone(), slopes);
        let normals = node_normals(&sloped(slopes.clone()).unwrap());
        assert!((normals[3] - DVec3::new(-0.1, 0.0, 1.0).normalize()).length() < 1e-15);
        assert!((node_normals(&plain)[3] - normals[3]).length() < 1e-12);
        assert!(sloped(slopes[1..].to_vec()).is_err());
        assert!(sloped(vec![DVec2::NAN; 77]).is_err());
    }
}
