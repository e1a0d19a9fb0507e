//! The light of a block with two relief faces, on receivers one behind the other.

use super::{
    BANDS, Caustic,
    splat::{Corner, Film},
};
use crate::{
    grid::Extent,
    optics::{normal_of_slopes, refracted},
    surface::SurfaceSpline,
};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// A block in light along its axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TwoReliefs<'a> {
    /// Heights over the mean entry plane, mm.
    pub(crate) entry: &'a SurfaceSpline,
    pub(crate) exit: &'a SurfaceSpline,
    /// Between the two mean planes, mm.
    pub(crate) thickness_mm: f64,
    /// Of the glass.
    pub(crate) ior: f64,
}

/// A receiver across the axis, and its cells.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    /// From the mean exit plane, mm.
    pub(crate) distance_mm: f64,
    pub(crate) window: Extent,
    pub(crate) cells: (usize, usize),
}

/// Most Newton steps to the exit face.
const STEPS: usize = 12;
/// How close to it is on it, mm.
const NEAR_MM: f64 = 1e-10;

impl TwoReliefs<'_> {
    /// The irradiance on the cells of two receivers, from `beams` beams of light across the block.
    pub(crate) fn irradiance(&self, views: [View; 2], beams: (usize, usize)) -> [Caustic; 2] {
        let (nx, ny) = beams;
        let lattice = self.entry.lattice(nx + 1, ny + 1);
        let block = self.entry.extent();
        let rows_per_band = ny.div_ceil(BANDS);
        let bands: Vec<[(usize, Film); 2]> = (0..ny.div_ceil(rows_per_band))
            .into_par_iter()
            .map(|band| {
                let (begin, end) = (band * rows_per_band, ((band + 1) * rows_per_band).min(ny));
                let mut corners = [(); 2].map(|()| Vec::with_capacity((end - begin + 1) * (nx + 1)));
                let mut scratch = Vec::new();
                for j in begin..=end {
                    lattice.row(j, &mut scratch, |i, height, slope| {
                        let at = block.node(i, j, nx + 1, ny + 1);
                        let ray = self.ray(at.extend(height - self.thickness_mm), slope);
                        for (corners, view) in corners.iter_mut().zip(views) {
                            corners.push(Corner { at: view.cell(ray), flux: 1.0 });
                        }
                    });
                }
                let [first, second] =
                    [0, 1].map(|k| Film::of_band(&corners[k], nx + 1, views[k].cells, |_, _| true, &[]));
                [(begin, first), (begin, second)]
            })
            .collect();
        let mut films = [Vec::new(), Vec::new()];
        for band in bands {
            films.iter_mut().zip(band).for_each(|(films, film)| films.push(film));
        }
        [0, 1].map(|k| Caustic::of_bands(&films[k], views[k].cells, nx))
    }

    /// The ray in air, by its point on the exit face and direction, of light along the axis that enters
    /// at a point of the entry face; none where it does not come out.
    #[inline(always)]
    fn ray(&self, from: DVec3, slope: DVec2) -> Option<(DVec3, DVec3)> {
        let inside = refracted(DVec3::Z, normal_of_slopes(slope), 1.0 / self.ior)?;
        let (mut up, mut surface) = (-from.z, self.exit.continued(from.truncate()));
        for _ in 0..STEPS {
            let at = from + inside * (up / inside.z);
            surface = self.exit.continued(at.truncate());
            let miss = at.z - surface.height_mm;
            let closing = 1.0 - surface.slope.dot(inside.truncate()) / inside.z;
            // A face that hangs over the ray is not met in order.
            if closing.is_nan() || closing < 0.05 {
                return None;
            }
            up -= miss / closing;
            if miss.abs() < NEAR_MM {
                break;
            }
        }
        let at = from + inside * (up / inside.z);
        refracted(inside, normal_of_slopes(surface.slope), self.ior).filter(|air| air.z > 0.0).map(|air| (at, air))
    }
}

impl View {
    /// Where a ray lands, in cells.
    #[inline(always)]
    fn cell(&self, ray: Option<(DVec3, DVec3)>) -> DVec2 {
        let Some((at, along)) = ray else { return DVec2::NAN };
        let landing = at.truncate() + along.truncate() * ((self.distance_mm - at.z) / along.z);
        let cells = DVec2::new(self.cells.0 as f64, self.cells.1 as f64);
        (landing - self.window.lower()) * cells / self.window.as_vec()
    }
}
