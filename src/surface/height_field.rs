use super::fill::fill_missing;
use crate::grid::{Contour, Extent, Field, Outline};

/// Heights of the exit face at nodes that span its extent edge to edge, mm, with the mean of all
/// nodes within its outline at 0, but for those of a [skirt](Self::with_skirt) and of a face that
/// was [found](Self::found) with one.
///
/// Nodes beyond the outline carry a smooth continuation, which the spline through the nodes needs.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightField {
    pub(super) extent: Extent,
    pub(super) outline: Outline,
    pub(super) heights_mm: Field<f64>,
    /// Whether heights are counted from a zero that is not their mean.
    pub(super) found: bool,
}

impl HeightField {
    /// Takes over node heights of a rectangular face, mm, and shifts them to the mean 0.
    ///
    /// # Panics
    /// With fewer than 4 nodes along a side (a cubic needs four).
    pub fn new(extent: Extent, heights_mm: Field<f64>) -> Self {
        Self::outlined(extent, Outline::Rectangle, heights_mm)
    }

    /// Takes over node heights of a face of any outline, mm, and shifts them to the mean 0 of those
    /// within. Nodes beyond the outline that are not a number are given a smooth continuation.
    ///
    /// # Panics
    /// With fewer than 4 nodes along a side (a cubic needs four).
    pub fn outlined(extent: Extent, outline: Outline, heights_mm: Field<f64>) -> Self {
        Self::closed(extent, outline, heights_mm, false)
    }

    /// Takes over the node heights of a face as they were found on its bench, mm: their zero is not
    /// their mean where the face has a skirt. Nodes beyond the outline that are not a number are
    /// given a smooth continuation.
    ///
    /// # Panics
    /// With fewer than 4 nodes along a side (a cubic needs four).
    pub fn found(extent: Extent, outline: Outline, heights_mm: Field<f64>) -> Self {
        Self::closed(extent, outline, heights_mm, true)
    }

    fn closed(extent: Extent, outline: Outline, mut heights_mm: Field<f64>, found: bool) -> Self {
        assert!(heights_mm.nx() >= 4 && heights_mm.ny() >= 4, "a height field needs 4 x 4 nodes");
        let contour = outline.within(extent);
        if !contour.is_rectangle() {
            fill_missing(&mut heights_mm);
        }
        if !found {
            let mean = if contour.is_rectangle() {
                heights_mm.mean()
            } else {
                let inside = within(&contour, &heights_mm);
                let (sum, count) = inside.fold((0.0, 0), |(sum, count), z| (sum + z, count + 1));
                sum / f64::from(count)
            };
            heights_mm.as_mut_slice().iter_mut().for_each(|z| *z -= mean);
        }
        Self { extent, outline, heights_mm, found }
    }

    /// A face of the same extent and outline with other heights, mm, shifted to the mean 0; of a
    /// [found](Self::found) one, as they are.
    ///
    /// # Panics
    /// With fewer than 4 nodes along a side.
    pub fn with_heights(&self, heights_mm: Field<f64>) -> Self {
        Self::closed(self.extent, self.outline, heights_mm, self.found)
    }

    /// Size of the face.
    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// The outline of the face within its extent.
    pub fn outline(&self) -> Outline {
        self.outline
    }

    /// The curve around the face.
    pub fn contour(&self) -> Contour {
        self.outline.within(self.extent)
    }

    /// Node heights, mm; beyond the outline, their continuation.
    pub fn heights_mm(&self) -> &Field<f64> {
        &self.heights_mm
    }

    /// Node heights alone, mm.
    pub fn into_heights_mm(self) -> Field<f64> {
        self.heights_mm
    }

    /// Node heights, mm; another value beyond the outline.
    pub fn heights_within(&self, beyond: f64) -> Field<f64> {
        let (contour, heights) = (self.contour(), &self.heights_mm);
        let (nx, ny) = (heights.nx(), heights.ny());
        let inside = |i, j| contour.contains(self.extent.node(i, j, nx, ny));
        Field::from_fn(nx, ny, |i, j| if inside(i, j) { heights[(i, j)] } else { beyond })
    }

    /// Least and greatest node height within the outline, mm.
    pub fn range_mm(&self) -> (f64, f64) {
        let contour = self.contour();
        if contour.is_rectangle() {
            return self.heights_mm.min_max();
        }
        within(&contour, &self.heights_mm).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| {
            // Also where a height is not a number.
            if z.is_nan() { (z, z) } else { (low.min(z), high.max(z)) }
        })
    }

    /// Peak to valley, mm.
    pub fn relief_mm(&self) -> f64 {
        let (low, high) = self.range_mm();
        high - low
    }
}

/// The heights of the nodes within a contour, row by row.
fn within<'a>(contour: &'a Contour, heights: &'a Field<f64>) -> impl Iterator<Item = f64> + 'a {
    let (nx, ny) = (heights.nx(), heights.ny());
    let extent = contour.extent();
    heights
        .as_slice()
        .iter()
        .enumerate()
        .filter(move |(k, _)| contour.contains(extent.node(k % nx, k / nx, nx, ny)))
        .map(|(_, &z)| z)
}
