//! An entry face that is no plane: a height field below the exit face, node under node.

use super::{
    Shape, SolidError,
    face::{Diagonal, diagonals, normal_of},
};
use crate::{
    grid::Outline,
    surface::{HeightField, SurfaceSpline},
};
use rayon::prelude::*;

/// An entry face in its place.
#[derive(Clone, Debug)]
pub(super) struct EntryRelief {
    /// In the library's frame.
    pub(super) surface: HeightField,
    /// Of every cell, row by row.
    pub(super) diagonals: Vec<Diagonal>,
    /// Outward unit normals of the spline at the nodes.
    pub(super) normals: Vec<[f32; 3]>,
}

impl EntryRelief {
    /// This face, moved along z so that its lowest node is at `base_z_mm`.
    pub(super) fn standing_at(face: &HeightField, base_z_mm: f64) -> Self {
        let by_mm = base_z_mm - face.range_mm().0;
        let mut heights = face.heights_mm().clone();
        heights.as_mut_slice().iter_mut().for_each(|z| *z += by_mm);
        let surface = HeightField::found(face.extent(), Outline::Rectangle, heights);
        let slopes = SurfaceSpline::through(&surface).node_slopes();
        let outwards = |&slope| normal_of(slope).map(|c| -c + 0.0);
        Self {
            diagonals: diagonals(surface.heights_mm()),
            normals: slopes.as_slice().par_iter().map(outwards).collect(),
            surface,
        }
    }
}

/// Refuses an entry face that does not fit under an exit face with its skirt, on the same nodes.
pub(super) fn check(entry: &HeightField, exit: &HeightField, shape: &Shape) -> Result<(), SolidError> {
    if shape.rim.is_some() || !exit.contour().is_rectangle() || !entry.contour().is_rectangle() {
        return Err(SolidError::EntryOutline);
    }
    let (nodes, wanted) = (entry.heights_mm(), exit.heights_mm());
    let (size, under) = (entry.extent().as_vec(), exit.extent().as_vec());
    if (nodes.nx(), nodes.ny()) != (wanted.nx(), wanted.ny()) || !size.abs_diff_eq(under, 1e-9 * under.max_element()) {
        return Err(SolidError::EntryGrid {
            nodes: [nodes.nx(), nodes.ny()],
            size_mm: size.to_array(),
            wanted: [wanted.nx(), wanted.ny()],
            wanted_mm: under.to_array(),
        });
    }
    let nx = nodes.nx();
    match nodes.as_slice().iter().position(|z| !z.is_finite()) {
        Some(k) => Err(SolidError::NotFinite { face: "entry", i: k % nx, j: k / nx, height_mm: nodes.as_slice()[k] }),
        None => Ok(()),
    }
}

/// What both faces together take from a stock whose top is at `top_mm`: its thickness less this is
/// the least glass between them at any node, mm.
pub(super) fn depth_mm(entry: &HeightField, exit: &HeightField, top_mm: f64) -> f64 {
    let lowest = entry.range_mm().0;
    let pairs = entry.heights_mm().as_slice().iter().zip(exit.heights_mm().as_slice());
    pairs.map(|(below, above)| (below - lowest) + (top_mm - above)).fold(0.0, f64::max)
}
