//! The light of a coupon: single rays, by which the page's scales are drawn, and the traced picture
//! of a coupon that has been worked on.

use super::{Coupon, CouponPlan};
use crate::{
    fabricate::{Pass, PassError, Rows, SAMPLES_PER_ROW},
    failure::Failure,
    grid::Field,
    study::mill::{mill, polished},
    surface::{HeightField, Polish, SurfaceSpline},
};
use glam::{DVec2, DVec3};
use glasswarp_verify::{
    Block, Emission, Image, Light, PhotonPlan, Scene, SourceExtent, Surface, Tracer, Traversal, Window, photons,
};

/// The way of a ray from the lamp through a place of the face to the sheet.
#[derive(Clone, Debug)]
pub(super) struct Ray {
    spline: SurfaceSpline,
    lamp: DVec3,
    entry_z_mm: f64,
    distance_mm: f64,
}

impl Ray {
    pub(super) fn of(plan: &CouponPlan, surface: &HeightField, entry_z_mm: f64) -> Self {
        Self {
            spline: SurfaceSpline::through(surface),
            lamp: DVec3::Z * (entry_z_mm - plan.lamp_mm),
            entry_z_mm,
            distance_mm: plan.distance_mm + entry_z_mm,
        }
    }

    /// The same with the sheet further away.
    pub(super) fn further(&self, by_mm: f64) -> Self {
        Self { distance_mm: self.distance_mm + by_mm, ..self.clone() }
    }

    /// Where the light of a place of the face lands, mm, if the face had this slope besides its
    /// own.
    pub(super) fn landing(&self, at: DVec2, slope: DVec2, ior: f64) -> DVec2 {
        let sample = self.spline.sample(at);
        self.from(at.extend(sample.height_mm), sample.slope + slope, ior)
    }

    /// The same of the face without its slope along x.
    pub(super) fn plain_landing(&self, at: DVec2, ior: f64) -> DVec2 {
        let sample = self.spline.sample(at);
        self.from(at.extend(sample.height_mm), sample.slope * DVec2::Y, ior)
    }

    fn from(&self, exit: DVec3, slope: DVec2, ior: f64) -> DVec2 {
        // Where the ray enters is found from where it leaves.
        let mut entry = exit.truncate();
        let mut inside = DVec3::Z;
        for _ in 0..8 {
            let before = (entry.extend(self.entry_z_mm) - self.lamp).normalize();
            inside = refracted(before, DVec3::Z, 1.0 / ior);
            entry = exit.truncate() - inside.truncate() * ((exit.z - self.entry_z_mm) / inside.z);
        }
        let after = refracted(inside, (-slope).extend(1.0).normalize(), ior);
        exit.truncate() + after.truncate() * ((self.distance_mm - exit.z) / after.z)
    }
}

/// Snell's law in vectors; `eta` is the quotient of the indices before and behind. Total
/// reflection, which no coupon comes near, goes on along the face.
fn refracted(ray: DVec3, normal: DVec3, eta: f64) -> DVec3 {
    let cos = ray.dot(normal);
    let square = 1.0 - eta * eta * (1.0 - cos * cos);
    eta * ray + (square.max(1e-6).sqrt() - eta * cos) * normal
}

/// What has been done to a coupon, and what it is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CouponState {
    /// The index that it really has.
    pub ior: f64,
    /// The pass that cut it; none is a perfect cut.
    pub pass: Option<Pass>,
    /// The polish after it.
    pub polish: Option<Polish>,
}

/// Size of the part of the sheet that is looked at, mm, and pixels to a millimetre.
const SHEET_MM: DVec2 = DVec2::new(240.0, 240.0);
const PER_MM: f64 = 4.0;

impl Coupon {
    /// The part of the sheet that is looked at.
    pub fn window() -> Window {
        let pixels = (SHEET_MM * PER_MM).as_usizevec2();
        Window { size_mm: SHEET_MM, centre_mm: DVec2::ZERO, nx: pixels.x, ny: pixels.y }
    }

    /// The bench on which a coupon is read.
    pub fn scene(&self, ior: f64) -> Scene {
        let position_mm = DVec3::Z * (self.solid.entry_z_mm() - self.plan.lamp_mm);
        Scene {
            light: Light::Point { position_mm, emission: Emission::Isotropic, axis: None },
            spread: SourceExtent::SourceDisc { radius_mm: 0.5 * self.plan.lamp_diameter_mm },
            traversal: Traversal::Bvh,
            ..Scene::new(ior, self.distance_mm(), Self::window())
        }
    }

    /// The light on the sheet of a coupon of this plan, `block`, which was found in a file, after
    /// work on it: traced from a lamp with a size.
    ///
    /// # Errors
    /// A pass that does not fit the coupon.
    pub fn seen(&self, block: &Block, state: &CouponState, photon_count: u64) -> Result<Image, Failure> {
        let (nx, ny) = block.nodes();
        let heights = Field::from_vec(nx, ny, block.heights_mm().to_vec());
        let face = self.surface().with_heights(heights);
        let mut scene = self.scene(state.ior);
        let smooth = |face: &HeightField| {
            let heights = face.heights_mm();
            let nodes = (heights.nx(), heights.ny());
            block.clone().with_face(nodes, heights.as_slice().to_vec()).map_err(Failure::refused)
        };
        let worked = match (state.pass, state.polish) {
            (None, None) => block.clone(),
            (None, Some(polish)) => smooth(&polish.polished(&face))?,
            (Some(pass), None) => {
                scene.surface = Surface::Smooth;
                let rows = Rows::along(&face, pass).map_err(Failure::refused)?;
                let nodes = scallop_nodes(&face, &pass)?;
                let (heights, slopes) = rows.left(nodes.0, nodes.1);
                let sloped = block.clone().with_sloped_face(nodes, heights.into_vec(), slopes.into_vec());
                sloped.map_err(Failure::refused)?
            }
            (Some(pass), Some(polish)) => smooth(&polished(&mill(&face, &pass, None)?.surface, &face, polish))?,
        };
        let tracer = Tracer::for_block(&worked, &scene).map_err(Failure::refused)?;
        let plan = PhotonPlan::new(photon_count, 1).with_replicates(2);
        Ok(photons(&tracer, &plan).map_err(Failure::refused)?.image())
    }
}

/// Nodes from row to row. Between two of them a ridge is rounded, and the light that it throws
/// furthest falls short by as much of a row.
const PER_ROW: f64 = 3.0 * SAMPLES_PER_ROW;

/// Nodes that hold the slopes of scallops up to their ridges.
fn scallop_nodes(face: &HeightField, pass: &Pass) -> Result<(usize, usize), Failure> {
    let (extent, heights, across) = (face.extent(), face.heights_mm(), pass.direction.unit().perp());
    let along = |size_mm: f64, across: f64, nodes: usize| {
        nodes.max(1 + (size_mm * PER_ROW * across.abs() / pass.step_over_mm - 1e-9).ceil() as usize)
    };
    let (nx, ny) = (along(extent.width_mm, across.x, heights.nx()), along(extent.height_mm, across.y, heights.ny()));
    if nx.saturating_mul(ny) > Pass::MOST_NODES {
        return Err(Failure::refused(PassError::TooFine { step_over_mm: pass.step_over_mm, nx, ny }));
    }
    Ok((nx, ny))
}
