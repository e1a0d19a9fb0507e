//! A block from a file, on its bench, as something that is worked on and looked at again.

use super::{
    bench::scene_of,
    error::Failure,
    imperfect::Intent,
    judge::{self, Examiner, Subject},
    plan::open_target,
    side_file::SideFile,
};
use glam::DVec2;
use glasswarp::{
    fabricate::Milled,
    grid::{Extent, Field},
    report::Exposure,
    surface::HeightField,
    target::Transfer,
};
use glasswarp_verify::{Block, Geometry, Image, Scene, Surface, Traversal, beams, metrics::Metrics};
use rayon::prelude::*;
use std::path::Path;

/// A block and everything that it takes to judge it.
pub(crate) struct Workpiece {
    pub(crate) side: SideFile,
    pub(crate) surface: HeightField,
    pub(crate) entry_z_mm: f64,
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
        let target = Intent::of_side(open_target(picture, transfer, offset, design.framing()?)?, &side)?.target;
        let examiner = Examiner::new(scene_of(&side.bench, &side.design)?, Some(&target), pixels);
        let exposure = Exposure::of(&target, transfer.unwrap_or(Transfer::Srgb));
        let (surface, entry_z_mm) = (surface_of(&block), block.entry_z_mm() - block.mean_exit_z_mm());
        Ok(Self { side, surface, entry_z_mm, examiner, exposure })
    }

    /// The light of a face on this block.
    pub(crate) fn look(&self, surface: &HeightField) -> Result<View, Failure> {
        look(&self.examiner, surface, self.entry_z_mm)
    }

    /// The light of a face on another bench than its own.
    pub(crate) fn look_from(&self, block: &Block, scene: &Scene, beams_per_pixel: usize) -> Result<Image, Failure> {
        let tracer = glasswarp_verify::Tracer::for_block(block, scene).map_err(Failure::refused)?;
        Ok(self.examiner.beams_through(block, &tracer, beams_per_pixel).image)
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

/// Cells along y of a strip of a milled face.
const STRIP: usize = 256;
/// Beams per pixel along each side that a milled face is traced with at least. With fewer than of a smooth face: the image is within
/// 0.001 of that of infinitely many, where scallops move it by a hundred times that.
const SCALLOP_BEAMS: usize = 4;

/// The light of a milled face, by its own slopes. Strip by strip: the tracer keeps several times what the face itself takes, and light
/// along the axis stays in its strip until it leaves the glass.
pub(crate) fn look_at_scallops(examiner: &Examiner, milled: &Milled, entry_z_mm: f64) -> Result<View, Failure> {
    let (heights, slopes) = (milled.surface.heights_mm(), &milled.slopes);
    let (extent, (nx, cells)) = (milled.surface.extent(), (heights.nx(), heights.ny() - 1));
    let (wide, high) = examiner.pixels();
    let beams_across = (SCALLOP_BEAMS * wide).max(nx - 1);
    let beams_per_cell = (SCALLOP_BEAMS * high).div_ceil(cells);
    let strips = cells.div_ceil(STRIP);
    let mut image = Image::new(wide, high, vec![0.0; wide * high]);
    for strip in 0..strips {
        let (begin, end) = (strip * cells / strips, (strip + 1) * cells / strips);
        let share = (end - begin) as f64 / cells as f64;
        let nodes = begin * nx..(end + 1) * nx;
        let normals = slopes.as_slice()[nodes.clone()].par_iter().map(|slope| (-slope.extend(-1.0)).normalize());
        let size = DVec2::new(extent.width_mm, extent.height_mm * share);
        let block =
            Block::from_heights(size, entry_z_mm, (nx, end + 1 - begin), heights.as_slice()[nodes.clone()].to_vec())
                .and_then(|block| block.with_normals(normals.collect()))
                .map_err(Failure::refused)?;
        let subject = Subject::Block(Box::new(block));
        let mut scene = examiner.scene_for(&subject);
        (scene.surface, scene.geometry, scene.traversal) = (Surface::Smooth, Geometry::Displaced, Traversal::Grid);
        // The strip stands in the middle of its own bench.
        scene.window.centre_mm.y -= ((begin + end) as f64 / (2 * cells) as f64 - 0.5) * extent.height_mm;
        let seen = beams(&subject.tracer(&scene)?, beams_across, beams_per_cell * (end - begin)).image;
        image.values.iter_mut().zip(&seen.values).for_each(|(sum, value)| *sum += share * value);
    }
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
