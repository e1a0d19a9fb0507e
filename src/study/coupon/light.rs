//! The traced light of a coupon that has been worked on.

use super::{piece::Coupon, plan::CouponError};
use crate::{
    fabricate::{Pass, Rows, SAMPLES_PER_ROW},
    failure::Failure,
    grid::Field,
    study::{
        face::with_face,
        mill::{mill, polished},
    },
    surface::{HeightField, Polish},
};
use glam::{DVec2, DVec3};
use glasswarp_verify::{
    Block, Emission, Image, Light, PhotonPlan, Scene, SourceExtent, Surface, Tracer, Traversal, Window, photons,
};

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

    /// Refuses a pass that does not fit the coupon, or whose scallops take too many nodes.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn check(&self, pass: &Pass) -> Result<(), Failure> {
        pass.check(self.surface().extent()).map_err(Failure::refused)?;
        scallop_nodes(self.surface(), pass).map(drop)
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
        let worked = match (state.pass, state.polish) {
            (None, None) => block.clone(),
            (None, Some(polish)) => with_face(block, &polish.polished(&face))?,
            (Some(pass), None) => {
                scene.surface = Surface::Smooth;
                let rows = Rows::along(&face, pass).map_err(Failure::refused)?;
                let nodes = scallop_nodes(&face, &pass)?;
                let (heights, slopes) = rows.left(nodes.0, nodes.1);
                let sloped = block.clone().with_sloped_face(nodes, heights.into_vec(), slopes.into_vec());
                sloped.map_err(Failure::refused)?
            }
            (Some(pass), Some(polish)) => {
                with_face(block, &polished(&mill(&face, &pass, None)?.surface, &face, polish))?
            }
        };
        let tracer = Tracer::for_block(&worked, &scene).map_err(Failure::refused)?;
        let plan = PhotonPlan::new(photon_count, 1).with_replicates(2);
        Ok(photons(&tracer, &plan).map_err(Failure::refused)?.image())
    }
}

/// Nodes from row to row. Between two of them a ridge is rounded, and the light that it throws
/// furthest falls short by as much of a row.
const PER_ROW: f64 = 3.0 * SAMPLES_PER_ROW;

/// Most nodes of a face with its scallops: they take 0.8 gigabytes.
const MOST_NODES: usize = 1 << 25;

/// Nodes that hold the slopes of scallops up to their ridges.
fn scallop_nodes(face: &HeightField, pass: &Pass) -> Result<(usize, usize), Failure> {
    let (extent, heights, across) = (face.extent(), face.heights_mm(), pass.direction.unit().perp());
    let along = |size_mm: f64, across: f64, nodes: usize| {
        nodes.max(1 + (size_mm * PER_ROW * across.abs() / pass.step_over_mm - 1e-9).ceil() as usize)
    };
    let (nx, ny) = (along(extent.width_mm, across.x, heights.nx()), along(extent.height_mm, across.y, heights.ny()));
    if nx.saturating_mul(ny) > MOST_NODES {
        return Err(Failure::refused(CouponError::Rows { step_over_mm: pass.step_over_mm, nx, ny, most: MOST_NODES }));
    }
    Ok((nx, ny))
}
