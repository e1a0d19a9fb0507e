//! What a face demands of a cutter: how sharply it is hollow, and how steep.

use crate::{
    grid::{Extent, Field},
    surface::{HeightField, SurfaceSpline},
};
use glam::DVec2;
use rayon::prelude::*;

/// Principal curvatures and slopes of a face at its nodes; 0 at nodes beyond its outline.
#[derive(Clone, Debug)]
pub struct FaceShape {
    extent: Extent,
    hollow_per_mm: Field<f64>,
    slope: Field<f64>,
    step: f64,
    /// Nodes within the outline of the face.
    within: usize,
}

/// The sharpest hollow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hollow {
    /// Its radius, mm; infinite for a face that bulges everywhere.
    pub radius_mm: f64,
    /// Where it is, mm.
    pub at: DVec2,
}

impl FaceShape {
    /// Measures the spline through the nodes, at the nodes, between which its second derivatives
    /// are linear.
    pub fn of(surface: &HeightField) -> Self {
        Self::of_spline(surface, &SurfaceSpline::through(surface))
    }

    /// The same with the spline at hand.
    pub fn of_spline(surface: &HeightField, spline: &SurfaceSpline) -> Self {
        let heights = surface.heights_mm();
        let (nx, ny) = (heights.nx(), heights.ny());
        let extent = surface.extent();
        let (spacing, contour) = (extent.node_spacing(nx, ny), surface.contour());
        let node = |k: usize| extent.node(k % nx, k / nx, nx, ny);
        let (mut hollows, mut slopes) = (vec![0.0; nx * ny], vec![0.0; nx * ny]);
        let (step, within) = hollows
            .par_chunks_mut(nx)
            .zip(slopes.par_chunks_mut(nx))
            .enumerate()
            .map(|(j, (hollows, slopes))| {
                let (mut most, mut within) = (0f64, 0);
                for (i, (here, slope)) in hollows.iter_mut().zip(slopes).enumerate() {
                    let at = node(j * nx + i);
                    if !contour.contains(at) {
                        continue;
                    }
                    let face = spline.sample(at);
                    let [xx, xy, yy] = face.curvature;
                    (*here, *slope) = (hollow(face.slope, face.curvature), face.slope.length());
                    let step = (xx * spacing.x).abs().max((yy * spacing.y).abs()) + xy.abs() * spacing.min_element();
                    (most, within) = (most.max(step), within + 1);
                }
                (most, within)
            })
            .reduce(|| (0.0, 0), |a, b| (a.0.max(b.0), a.1 + b.1));
        let [hollow_per_mm, slope] = [hollows, slopes].map(|values| Field::from_vec(nx, ny, values));
        Self { extent, hollow_per_mm, slope, step, within }
    }

    /// The greater principal curvature, per mm: positive where the face is hollow as the cutter
    /// sees it.
    pub fn hollow_per_mm(&self) -> &Field<f64> {
        &self.hollow_per_mm
    }

    /// Slopes, mm per mm.
    pub fn slope(&self) -> &Field<f64> {
        &self.slope
    }

    /// The sharpest hollow.
    pub fn sharpest(&self) -> Hollow {
        let (at, most) = self.greatest(&self.hollow_per_mm);
        Hollow { radius_mm: if most > 0.0 { 1.0 / most } else { f64::INFINITY }, at }
    }

    /// The steepest place, mm, and its slope.
    pub fn steepest(&self) -> (DVec2, f64) {
        self.greatest(&self.slope)
    }

    /// Share of the face's nodes in hollows of less than this radius, mm.
    pub fn sharper_than(&self, radius_mm: f64) -> f64 {
        let nodes = self.hollow_per_mm.as_slice();
        nodes.iter().filter(|curvature| **curvature * radius_mm > 1.0).count() as f64 / self.within as f64
    }

    /// The greatest step of slope from a flat triangle to the next, if the face is cut along its
    /// nodes into such.
    pub fn facet_step(&self) -> f64 {
        self.step
    }

    fn greatest(&self, field: &Field<f64>) -> (DVec2, f64) {
        let (mut at, mut most) = (0, f64::NEG_INFINITY);
        for (k, &value) in field.as_slice().iter().enumerate() {
            if value > most {
                (at, most) = (k, value);
            }
        }
        (self.extent.node(at % field.nx(), at / field.nx(), field.nx(), field.ny()), most)
    }
}

/// The greater principal curvature of the graph of a function with this gradient and these second
/// derivatives.
fn hollow(slope: DVec2, [xx, xy, yy]: [f64; 3]) -> f64 {
    let (e, f, g) = (1.0 + slope.x * slope.x, slope.x * slope.y, 1.0 + slope.y * slope.y);
    let area = e * g - f * f;
    let root = area.sqrt();
    let mean = 0.5 * (e * yy - 2.0 * f * xy + g * xx) / (area * root);
    let gauss = (xx * yy - xy * xy) / (area * area);
    mean + (mean * mean - gauss).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::{at_worst, within_tenth_of};

    const BLOCK: Extent = Extent::new(20.0, 16.0);

    #[test]
    fn a_bowl_has_its_radius_everywhere_and_a_dome_none() {
        let sphere = |sign: f64| {
            HeightField::new(
                BLOCK,
                Field::from_fn(81, 65, |i, j| sign * -(900.0 - BLOCK.node(i, j, 81, 65).length_squared()).sqrt()),
            )
        };
        let bowl = FaceShape::of(&sphere(1.0));
        // Not-a-knot ends are exact for cubics only.
        for j in 4..61 {
            for i in 4..77 {
                at_worst(8.1e-4, (1.0 / bowl.hollow_per_mm()[(i, j)] - 30.0).abs(), "radius");
            }
        }
        assert!(bowl.sharper_than(31.0) == 1.0 && bowl.sharper_than(29.0) == 0.0);
        let (at, slope) = bowl.steepest();
        assert!((at.abs() - DVec2::new(10.0, 8.0)).length() < 1e-9);
        within_tenth_of(1e-6, (slope - 164.0_f64.sqrt() / (900.0_f64 - 164.0).sqrt()).abs(), "slope");
        assert_eq!(FaceShape::of(&sphere(-1.0)).sharpest().radius_mm, f64::INFINITY);
    }

    #[test]
    fn what_lies_beyond_the_outline_does_not_count() {
        use crate::grid::Outline;
        let contour = Outline::Circle.within(BLOCK);
        let face = Field::from_fn(81, 65, |i, j| {
            let at = BLOCK.node(i, j, 81, 65);
            // A bowl with a sharp wall beyond the outline.
            let wall = contour.level(at).distance_mm - 2.4;
            -(900.0 - at.length_squared()).sqrt() + wall.max(0.0).powi(2)
        });
        let disc = FaceShape::of(&HeightField::outlined(BLOCK, Outline::Circle, face.clone()));
        within_tenth_of(9.3e-4, (disc.sharpest().radius_mm - 30.0).abs(), "sharpest radius");
        assert!(disc.sharper_than(31.0) == 1.0 && disc.sharper_than(29.0) == 0.0);
        assert!((disc.steepest().0.abs() - DVec2::new(10.0, 0.0)).length() < 1e-9);
        within_tenth_of(
            0.79,
            FaceShape::of(&HeightField::new(BLOCK, face)).sharpest().radius_mm,
            "sharpest radius of the whole",
        );
    }

    #[test]
    fn a_cylinder_in_any_direction_has_one_curvature() {
        let axis = DVec2::from_angle(0.4);
        let trough = HeightField::new(
            BLOCK,
            Field::from_fn(161, 129, |i, j| -(625.0 - BLOCK.node(i, j, 161, 129).dot(axis).powi(2)).sqrt()),
        );
        let shape = FaceShape::of(&trough);
        within_tenth_of(1.04e-4, (1.0 / shape.hollow_per_mm()[(60, 50)] - 25.0).abs(), "radius");
    }
}
