//! A block from a file, on its bench, as something that is worked on and looked at again.

use super::{
    error::Failure,
    judge::{self, Examiner, Place, Subject},
    plan::open_picture,
    side_file::SideFile,
};
use glam::DVec2;
use glasswarp::{
    fabricate::Milled,
    grid::{Extent, Field},
    report::Exposure,
    surface::HeightField,
    target::{TargetIrradiance, Transfer},
};
use glasswarp_verify::{Block, Geometry, Image, Scene, Surface, Traversal, beams, metrics::Metrics};
use rayon::prelude::*;
use std::path::Path;

/// A block and everything that it takes to judge it.
pub(crate) struct Workpiece {
    pub(crate) side: SideFile,
    pub(crate) surface: HeightField,
    pub(crate) entry_z_mm: f64,
    pub(crate) place: Place,
    pub(crate) examiner: Examiner,
    pub(crate) exposure: Exposure,
}

/// The light of a block and how well it draws the picture.
pub(crate) struct View {
    pub(crate) image: Image,
    pub(crate) metrics: Metrics,
}

impl Workpiece {
    /// Opens a file and its side file. Lengths along z are measured from the mean plane of the exit face.
    pub(crate) fn open(path: &Path, bench: Option<&Path>, pixels: usize) -> Result<Self, Failure> {
        let side = SideFile::of_block(path, bench, "")?;
        let (_, block) = judge::open_block(path, side.origin_of(path))?;
        let design = &side.design;
        let picture = design.picture.as_ref().ok_or_else(|| {
            Failure::Usage("the side file names no picture, by which the block could be judged".into())
        })?;
        let transfer = design.transfer.map(Transfer::from);
        let offset = design.offset.unwrap_or(0.0);
        let target =
            TargetIrradiance::from_picture(&open_picture(picture, transfer)?, offset).map_err(Failure::refused)?;
        let place = Place::from(&side.bench);
        let examiner = Examiner::new(place, Some(&target), pixels);
        let exposure = Exposure::of(&target, transfer.unwrap_or(Transfer::Srgb));
        let (surface, entry_z_mm) = (surface_of(&block), block.entry_z_mm() - block.mean_exit_z_mm());
        Ok(Self { side, surface, entry_z_mm, place, examiner, exposure })
    }

    /// The light of a face on this block.
    pub(crate) fn look(&self, surface: &HeightField) -> Result<View, Failure> {
        look(&self.examiner, surface, self.entry_z_mm)
    }

    /// The light of a face on another bench than its own.
    pub(crate) fn look_from(&self, block: &Block, scene: &Scene, beams_per_pixel: usize) -> Result<Image, Failure> {
        let tracer = glasswarp_verify::Tracer::for_block(block, scene).map_err(Failure::refused)?;
        let (nx, ny) = self.examiner.pixels();
        let (columns, rows) = block.nodes();
        Ok(beams(&tracer, (beams_per_pixel * nx).max(columns - 1), (beams_per_pixel * ny).max(rows - 1)).image)
    }

    /// The bench, its light straight, its crossings found the quick way.
    pub(crate) fn scene(&self, block: &Block) -> Scene {
        let subject = Subject::Block(Box::new(block.clone()));
        Scene { traversal: Traversal::Grid, ..self.examiner.scene_for(&subject) }
    }

    /// How well an image agrees with the picture.
    pub(crate) fn compare(&self, image: &Image) -> Result<Metrics, Failure> {
        compare(&self.examiner, image)
    }
}

/// The light of a milled face, by its own slopes.
pub(crate) fn look_at_scallops(examiner: &Examiner, milled: &Milled, entry_z_mm: f64) -> Result<View, Failure> {
    let normals = milled.slopes.as_slice().par_iter().map(|slope| (-slope.extend(-1.0)).normalize()).collect();
    let block = block_of(&milled.surface, entry_z_mm)?.with_normals(normals).map_err(Failure::refused)?;
    let subject = Subject::Block(Box::new(block));
    let image = examiner.look(&subject, Surface::Smooth, Geometry::Displaced)?.image;
    Ok(View { metrics: compare(examiner, &image)?, image })
}

/// The light of a face over an entry face at `entry_z_mm`.
pub(crate) fn look(examiner: &Examiner, surface: &HeightField, entry_z_mm: f64) -> Result<View, Failure> {
    let subject = Subject::Block(Box::new(block_of(surface, entry_z_mm)?));
    let image = examiner.look(&subject, Surface::Spline, Geometry::Displaced)?.image;
    Ok(View { metrics: compare(examiner, &image)?, image })
}

fn compare(examiner: &Examiner, image: &Image) -> Result<Metrics, Failure> {
    examiner.compare(image)?.ok_or_else(|| Failure::Usage("there is no picture to compare with".into()))
}

/// The exit face of a block as a height field.
pub(crate) fn surface_of(block: &Block) -> HeightField {
    let (size, (nx, ny)) = (block.size_mm(), block.nodes());
    HeightField::new(Extent::new(size.x, size.y), Field::from_vec(nx, ny, block.heights_mm().to_vec()))
}

/// A face as the verifier takes it.
pub(crate) fn block_of(surface: &HeightField, entry_z_mm: f64) -> Result<Block, Failure> {
    let (extent, heights) = (surface.extent(), surface.heights_mm());
    let size = DVec2::new(extent.width_mm, extent.height_mm);
    Block::from_heights(size, entry_z_mm, (heights.nx(), heights.ny()), heights.as_slice().to_vec())
        .map_err(Failure::refused)
}
