//! Many rays of light along the axis at once: by rows of a lattice under the spline, and by the facets of the file. Where light goes
//! straight up, what it meets is known, and what neighbours share is computed once.

use super::{BlockTracer, Face};
use crate::{
    block::{Half, corners},
    scene::{Geometry, Traversal},
    spline::Columns,
    trace::Path,
};
use glam::{DVec2, DVec3};

/// What the rows of a lattice of rays have in common.
#[derive(Clone, Debug)]
pub(crate) enum Lattice {
    /// Under a spline.
    Spline(Columns),
    /// Under triangles: the places along x.
    Flat(Vec<f64>),
}

impl BlockTracer {
    /// What rows of rays at these places along x have in common, if their paths can be followed row by row.
    pub(in crate::trace) fn columns(&self, xs: &[f64]) -> Option<Lattice> {
        match &self.face {
            _ if !self.even || !self.block.is_rectangular() || self.traversal != Traversal::Grid => None,
            Face::Spline(spline) => Some(Lattice::Spline(spline.columns(xs))),
            Face::Smooth(_) | Face::Facets => Some(Lattice::Flat(xs.to_vec())),
        }
    }

    /// The paths of the rays of a row, as [`path_at`](Self::path_at) finds them one by one.
    pub(in crate::trace) fn path_row(
        &self,
        columns: &Lattice,
        y: f64,
        scratch: &mut Vec<[f64; 2]>,
        out: &mut Vec<Path>,
    ) {
        let transmittance = self.illumination.enter(self.rays, DVec3::new(0.0, y, self.block.entry_z)).map(|(_, t)| t);
        let leave = |x: f64, z: f64, normal: DVec3| {
            let z = match self.geometry {
                Geometry::Displaced => z,
                Geometry::NormalMappedPlane => 0.0,
            };
            self.leave(DVec3::new(x, y, z), normal, DVec3::Z, transmittance.unwrap_or(1.0))
        };
        out.clear();
        match (columns, &self.face) {
            (Lattice::Spline(columns), Face::Spline(spline)) => spline.row(columns, y, scratch, |x, jet| {
                let normal = DVec3::new(-jet.zx, -jet.zy, 1.0) / (1.0 + jet.zx * jet.zx + jet.zy * jet.zy).sqrt();
                out.push(leave(x, jet.z, normal));
            }),
            (Lattice::Flat(xs), _) => out.extend(xs.iter().map(|&x| {
                let hit = self.hit_at(DVec2::new(x, y));
                let heights = self.nodes_of(&hit).map(|(i, j)| self.block.heights[j * self.block.nx + i]);
                leave(x, hit.crossing.weights.dot(DVec3::from_array(heights)), self.flat_normal(&hit))
            })),
            (Lattice::Spline(_), _) => unreachable!("the lattice was made for this face"),
        }
    }

    /// The paths of light along the axis that meets one facet of a cell at these points of its plan, if the face is made of facets.
    pub(in crate::trace) fn facet_paths<const N: usize>(
        &self,
        (i, j): (usize, usize),
        half: Half,
        at: [DVec2; N],
    ) -> Option<[Path; N]> {
        if !(self.even
            && self.block.is_rectangular()
            && matches!(self.face, Face::Facets)
            && self.geometry == Geometry::Displaced)
        {
            return None;
        }
        let transmittance = self.illumination.enter(self.rays, at[0].extend(self.block.entry_z)).map(|(_, t)| t)?;
        let corners = corners(i, j);
        let [a, b, c] = half.map(|k| self.block.node(corners[k].0, corners[k].1));
        let normal = (b - a).cross(c - a).normalize();
        Some(at.map(|at| {
            let z = a.z - normal.truncate().dot(at - a.truncate()) / normal.z;
            self.leave(at.extend(z), normal, DVec3::Z, transmittance)
        }))
    }
}
