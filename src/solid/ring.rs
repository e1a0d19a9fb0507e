//! The ring between the whole cells of an exit face and its outline.

use crate::{
    grid::Contour,
    surface::{HeightField, SurfaceSpline},
};
use glam::DVec2;
use std::ops::Range;

/// Least distance of a node from the outline, in spacings.
const LEAST_DISTANCE: f64 = 0.25;

/// An exit face that is no full grid.
#[derive(Clone, Debug)]
pub(super) struct Trimmed {
    pub(super) vertices: Vec<[f32; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) normals: Vec<[f32; 3]>,
    /// The vertices on the outline, counter-clockwise: the last ones.
    pub(super) border: Range<u32>,
}

/// The columns of the whole cells of a row of cells.
pub(super) type Span = Range<usize>;

/// Whole cells row by row; empty rows below and above.
pub(super) fn spans(contour: &Contour, (nx, ny): (usize, usize)) -> Vec<Span> {
    let extent = contour.extent();
    let margin = LEAST_DISTANCE * extent.node_spacing(nx, ny).min_element();
    let kept = |i: usize, j: usize| contour.level(extent.node(i, j, nx, ny)).distance_mm <= -margin;
    // Outlines are convex: the kept nodes of a row are contiguous.
    let rows: Vec<Span> = (0..ny)
        .map(|j| {
            let first = (0..nx).find(|&i| kept(i, j)).unwrap_or(nx);
            first..(first..nx).find(|&i| !kept(i, j)).unwrap_or(nx)
        })
        .collect();
    rows.windows(2)
        .map(|pair| {
            let (begin, end) = (pair[0].start.max(pair[1].start), pair[0].end.min(pair[1].end));
            if end > begin + 1 { begin..end - 1 } else { 0..0 }
        })
        .collect()
}

/// The nodes around the whole cells, counter-clockwise.
pub(super) fn around(spans: &[Span]) -> Vec<(usize, usize)> {
    let Some(low) = spans.iter().position(|span| !span.is_empty()) else { return Vec::new() };
    let high = spans.iter().rposition(|span| !span.is_empty()).unwrap_or(low);
    let mut nodes: Vec<(usize, usize)> = Vec::new();
    let walk = |nodes: &mut Vec<(usize, usize)>, to: (usize, usize)| {
        while let Some(&(i, j)) = nodes.last().filter(|&&at| at != to) {
            let towards = |a: usize, b: usize| if a < b { a + 1 } else { a - usize::from(a > b) };
            nodes.push(if i == to.0 { (i, towards(j, to.1)) } else { (towards(i, to.0), j) });
        }
    };
    nodes.push((spans[low].start, low));
    for j in low..=high {
        walk(&mut nodes, (spans[j].end, j));
        walk(&mut nodes, (spans[j].end, j + 1));
    }
    for j in (low..=high).rev() {
        walk(&mut nodes, (spans[j].start, j + 1));
        walk(&mut nodes, (spans[j].start, j));
    }
    nodes.pop();
    nodes
}

/// The points of the outline that the exit face of a block ends in, with their heights, mm.
pub(super) fn border(surface: &HeightField, spline: &SurfaceSpline) -> Vec<(DVec2, f64)> {
    let (contour, field) = (surface.contour(), surface.heights_mm());
    let (nx, ny) = (field.nx(), field.ny());
    around(&spans(&contour, (nx, ny)))
        .into_iter()
        .map(|(i, j)| contour.foot(surface.extent().node(i, j, nx, ny)))
        .map(|at| (at, spline.sample(at).height_mm))
        .collect()
}
