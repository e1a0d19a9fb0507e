//! What stands before a block in the way of its light.

use super::face::surface_of;
use crate::{
    bench::{Bench, BenchError},
    failure::Failure,
    grid::Outline,
    light::{FaceShape, Intensity, KnownFace},
    record::BenchRecord,
    solid::Solid,
    surface::SurfaceSpline,
};
use glam::DVec3;
use glasswarp_verify::{Block, Displacement, Standing};
use std::sync::Arc;

/// Whether blocks can stand before others. A page opens no files of solids ([`Host::solid`](crate::spec::Host)), and
/// is smaller without what would become of them.
pub(super) const ROWS: bool = !cfg!(target_arch = "wasm32");

/// What stands before a block.
#[derive(Clone, Debug, Default)]
pub struct Before {
    /// The blocks, in the order in which light meets them.
    pub standing: Vec<Standing>,
    /// The bench of the last of them, which knows the light.
    pub(super) bench: Option<BenchRecord>,
}

impl Before {
    /// The same with a designed block behind it, `gap_mm` before the next.
    ///
    /// # Errors
    /// A solid that is no block.
    pub fn and(mut self, bench: BenchRecord, solid: &Solid, gap_mm: f64) -> Result<Self, Failure> {
        let (surface, heights) = (solid.surface(), solid.surface().heights_mm());
        if surface.outline() != Outline::Rectangle {
            return Err(no_rectangle(NAME));
        }
        let nodes = (heights.nx(), heights.ny());
        let block =
            Block::from_heights(surface.extent().as_vec(), solid.entry_z_mm(), nodes, heights.as_slice().to_vec());
        self.standing.push(standing(block.map_err(Failure::refused)?, bench.ior, gap_mm, NAME)?);
        self.bench = Some(bench);
        Ok(self)
    }

    /// A bench in the light that comes through what stands before it; as it is, if nothing does. The
    /// entry face of the block is planar, `thickness_mm` before its mean exit plane.
    ///
    /// # Errors
    /// Light that does not come through.
    pub fn stand_before(&self, bench: Bench, thickness_mm: f64) -> Result<Bench, Failure> {
        let (Some(record), Some(last)) = (&self.bench, self.standing.last()) else { return Ok(bench) };
        let bench = lit_as(bench, record, -thickness_mm - last.gap_mm, thickness_mm).map_err(Failure::refused)?;
        passing(bench, &self.standing, thickness_mm)
    }
}

/// A block that stands before another one, `gap_mm` of air between them; `name` is what messages call
/// it.
///
/// # Errors
/// Too little air, and a block whose light has another outline than a rectangle.
pub(super) fn standing(block: Block, ior: f64, gap_mm: f64, name: &str) -> Result<Standing, Failure> {
    if block.outline().is_some() {
        return Err(no_rectangle(name));
    }
    let least_mm = block.highest_mm().max(0.0) + LEAST_AIR_MM;
    if gap_mm.is_nan() || gap_mm < least_mm {
        return Err(Failure::Usage(format!(
            "{gap_mm} mm of air behind {name} (`gap`, `behind`) are too little: it rises {:.3} mm above its mean exit plane; leave {least_mm:.3} mm or more",
            block.highest_mm()
        )));
    }
    Ok(Standing { block: Arc::new(block.with_spline()), ior, gap_mm, displaced: Displacement::default() })
}

fn no_rectangle(name: &str) -> Failure {
    Failure::Usage(format!(
        "the outline of {name} is no rectangle, and behind such a block no other can be designed yet (`behind`, `outline`)"
    ))
}

/// What messages call a block that is in no file yet.
const NAME: &str = "the plate before";
/// Least air between the highest point of a block and the next, mm.
const LEAST_AIR_MM: f64 = 0.1;

/// A bench whose light passes other blocks first.
///
/// # Errors
/// Light that does not come through.
pub fn passing(bench: Bench, before: &[Standing], thickness_mm: f64) -> Result<Bench, Failure> {
    if before.is_empty() || !ROWS {
        return Ok(bench);
    }
    let plane = |z_mm, index_behind| KnownFace { shape: FaceShape::Plane, z_mm, index_behind };
    let mut entry_mm = -thickness_mm;
    let mut faces = vec![plane(entry_mm, bench.exit_face().ior())];
    for standing in before.iter().rev() {
        let spline = SurfaceSpline::through(&surface_of(&standing.block)?);
        let exit_mm = entry_mm - standing.gap_mm;
        entry_mm = exit_mm + standing.block.entry_z_mm();
        let exit = KnownFace { shape: FaceShape::Heights(Arc::new(spline)), z_mm: exit_mm, index_behind: 1.0 };
        faces.extend([exit, plane(entry_mm, standing.ior)]);
    }
    faces.reverse();
    bench.behind(faces).map_err(Failure::refused)
}

/// A bench in the light of another one, whose mean exit plane lies at `z_mm`.
fn lit_as(bench: Bench, other: &BenchRecord, z_mm: f64, thickness_mm: f64) -> Result<Bench, BenchError> {
    match other.source_mm {
        None => bench.with_light_in_air(DVec3::from(other.light_direction)),
        Some(source) => {
            bench.with_point_source(DVec3::from(source) + DVec3::Z * z_mm, thickness_mm, Intensity::Isotropic)
        }
    }
}
