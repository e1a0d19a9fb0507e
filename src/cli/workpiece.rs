//! A block from a file, on its bench, as something that is worked on and looked at again.

use super::{
    bench::scene_of,
    console,
    error::Failure,
    imperfect::Intent,
    judge::{Examiner, Subject},
    otherwise::seen_otherwise,
    placed::{self, Placing},
    plan::open_target,
    reference::Wanted,
    side_file::SideFile,
};
use glam::DVec2;
use glasswarp::{
    fabricate::Milled,
    grid::{Extent, Field, Outline},
    irradiance::Transfer,
    report::Exposure,
    surface::HeightField,
};
use glasswarp_verify::{Block, Geometry, Image, Scene, Surface, Traversal, beams, metrics::Metrics};
use std::path::Path;

/// A block and everything that it takes to judge it.
pub(crate) struct Workpiece {
    pub(crate) side: SideFile,
    /// As it was found: every other face stands on its entry face, within its outline and rim, and on its bench.
    pub(crate) block: Block,
    pub(crate) surface: HeightField,
    pub(crate) examiner: Examiner,
    pub(crate) exposure: Exposure,
}

/// The light of a block and how well it draws the picture.
pub(crate) struct View {
    pub(crate) image: Image,
    pub(crate) metrics: Metrics,
}

impl Workpiece {
    /// Opens a file and its side file, to be looked at on its bench, or at another distance and through another index.
    pub(crate) fn open(
        path: &Path,
        bench: Option<&Path>,
        (ior, distance_mm): (Option<f64>, Option<f64>),
        pixels: usize,
    ) -> Result<Self, Failure> {
        let side = SideFile::of_block(path, bench, "")?;
        let (_, block, warnings) = placed::open_block(path, Some(&side), Placing::RIGHTED)?;
        warnings.into_iter().for_each(console::warn);
        let design = &side.design;
        let picture = design.picture.as_ref().ok_or_else(|| {
            Failure::Usage("the side file names no picture, by which the block could be judged".into())
        })?;
        let transfer = design.transfer.map(Transfer::from);
        let offset = design.offset.unwrap_or(0.0);
        let (intent, bench) =
            Intent::of_side(open_target(picture, &design.picture_options(), offset, design.framing()?)?, &side)?;
        let wanted = Wanted::of(picture, design, &intent, &bench)?;
        let scene = seen_otherwise(scene_of(&side.bench, design)?, Some(&block), ior, distance_mm)?;
        let examiner = Examiner::new(scene, Some(wanted.in_perfect_light()), pixels);
        let exposure = Exposure::of(&intent.target, transfer.unwrap_or(Transfer::Srgb));
        let surface = surface_of(&block)?;
        Ok(Self { side, block, surface, examiner, exposure })
    }

    /// The light of a face on this block.
    pub(crate) fn look(&self, surface: &HeightField) -> Result<View, Failure> {
        look(&self.examiner, &self.block, surface)
    }

    /// The bench with its pixels, for the smooth surface of a face.
    pub(crate) fn scene(&self) -> Scene {
        let subject = Subject::Block(Box::new(self.block.clone()));
        Scene { surface: Surface::Spline, traversal: Traversal::Grid, ..self.examiner.scene_for(&subject) }
    }
}

/// Beams per pixel along each side that a milled face is traced with at least. With fewer than of a smooth face: the image is within
/// 0.001 of that of infinitely many, where scallops move it by a hundred times that.
const SCALLOP_BEAMS: usize = 4;
/// Most beams that are traced at once.
const MOST_BEAMS: usize = 1 << 30;

/// The light of a milled face on a block, by its own slopes, and the face: of many millions of nodes there is never a second copy.
/// `design` is the face before.
pub(crate) fn look_at_scallops(
    examiner: &Examiner,
    block: &Block,
    design: &HeightField,
    milled: Milled,
) -> Result<(View, HeightField), Failure> {
    let heights = milled.surface.into_heights_mm();
    let (nx, ny) = (heights.nx(), heights.ny());
    let face = block.clone().with_sloped_face((nx, ny), heights.into_vec(), milled.slopes.into_vec());
    let face = face.map_err(Failure::refused)?;
    let subject = Subject::Block(Box::new(face));
    let scene = Scene { surface: Surface::Smooth, traversal: Traversal::Grid, ..examiner.scene_for(&subject) };
    let (wide, high) = examiner.pixels();
    // As many to every cell.
    let along_y = (SCALLOP_BEAMS * high).div_ceil(ny - 1) * (ny - 1);
    let along_x = (SCALLOP_BEAMS * wide).max(nx - 1).min(MOST_BEAMS / along_y);
    let image = beams(&subject.tracer(&scene)?, along_x, along_y).image;
    let view = View { metrics: compare(examiner, &image)?, image };
    let Subject::Block(face) = subject else { unreachable!("it was made a block") };
    Ok((view, design.with_heights(Field::from_vec(nx, ny, face.into_heights_mm()))))
}

/// The light of another face on a block.
pub(crate) fn look(examiner: &Examiner, block: &Block, surface: &HeightField) -> Result<View, Failure> {
    look_at(examiner, &Subject::Block(Box::new(with_face(block, surface)?)))
}

/// The light of the smooth surface of a block.
pub(crate) fn look_at(examiner: &Examiner, block: &Subject) -> Result<View, Failure> {
    let image = examiner.look(block, Surface::Spline, Geometry::Displaced)?.image;
    Ok(View { metrics: compare(examiner, &image)?, image })
}

/// A block with another face.
pub(crate) fn with_face(block: &Block, surface: &HeightField) -> Result<Block, Failure> {
    let heights = surface.heights_mm();
    block.clone().with_face((heights.nx(), heights.ny()), heights.as_slice().to_vec()).map_err(Failure::refused)
}

fn compare(examiner: &Examiner, image: &Image) -> Result<Metrics, Failure> {
    examiner.compare(image)?.ok_or_else(|| Failure::Usage("there is no picture to compare with".into()))
}

/// The exit face of a block as a height field in the block's own frame, which goes on smoothly beyond its outline.
///
/// # Errors
/// [`UnknownOutline`].
pub(crate) fn surface_of(block: &Block) -> Result<HeightField, Failure> {
    let (size, (nx, ny)) = (block.size_mm(), block.nodes());
    let extent = Extent::new(size.x, size.y);
    let heights = Field::from_vec(nx, ny, block.heights_mm().to_vec());
    let Some(points) = block.outline() else { return Ok(HeightField::found(extent, Outline::Rectangle, heights)) };
    let points: Vec<DVec2> = points.iter().map(|p| p.truncate()).collect();
    let tolerance_mm = OUTLINE_TOLERANCE * extent.node_spacing(nx, ny).min_element();
    let outline = Outline::through(&points, extent, tolerance_mm).ok_or_else(|| Failure::refused(UnknownOutline))?;
    Ok(HeightField::found(extent, outline, heights).continued())
}

/// How far the points of a file may lie off the curve of an outline, in spacings of its nodes.
const OUTLINE_TOLERANCE: f64 = 0.1;

/// An outline that nobody made here.
#[derive(Clone, Copy, Debug, thiserror::Error)]
#[error(
    "the outline of this block is neither an ellipse nor a rectangle with round corners, which checks and milling take; `glasswarp verify` takes any"
)]
struct UnknownOutline;
