//! A block from a file, on its bench, as something that is worked on and looked at again.

use super::{
    bench::scene_of,
    error::Failure,
    imperfect::Intent,
    judge::{self, Examiner, Subject},
    plan::open_target,
    reference::Wanted,
    side_file::SideFile,
};
use glam::{DVec2, DVec3};
use glasswarp::{
    fabricate::Milled,
    grid::{Extent, Field, Outline},
    report::Exposure,
    surface::{HeightField, SurfaceSpline},
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
        let (intent, bench) = Intent::of_side(open_target(picture, transfer, offset, design.framing()?)?, &side)?;
        let wanted = Wanted::of(picture, design, &intent, &bench)?;
        let examiner = Examiner::new(scene_of(&side.bench, design)?, Some(wanted.in_perfect_light()), pixels);
        let exposure = Exposure::of(&intent.target, transfer.unwrap_or(Transfer::Srgb));
        let (surface, entry_z_mm) = (surface_of(&block)?, block.entry_z_mm() - block.mean_exit_z_mm());
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
    let outline = around(&milled.surface);
    let whole_mm2 = outline.as_ref().map_or(extent.area_mm2(), |points| area_mm2(points));
    let mut image = Image::new(wide, high, vec![0.0; wide * high]);
    for strip in 0..strips {
        let (begin, end) = (strip * cells / strips, (strip + 1) * cells / strips);
        let nodes = begin * nx..(end + 1) * nx;
        let normals = slopes.as_slice()[nodes.clone()].par_iter().map(|slope| (-slope.extend(-1.0)).normalize());
        let size = DVec2::new(extent.width_mm, extent.height_mm * (end - begin) as f64 / cells as f64);
        // The strip stands in the middle of its own bench.
        let middle = ((begin + end) as f64 / (2 * cells) as f64 - 0.5) * extent.height_mm;
        let mut block =
            Block::from_heights(size, entry_z_mm, (nx, end + 1 - begin), heights.as_slice()[nodes.clone()].to_vec())
                .and_then(|block| block.with_normals(normals.collect()))
                .map_err(Failure::refused)?;
        let mut share = (end - begin) as f64 / cells as f64;
        if let Some(points) = &outline {
            let own: Vec<DVec3> = points.iter().map(|p| *p - DVec3::Y * middle).collect();
            let reach = 0.5 * size.y;
            let own = clipped(&clipped(&own, DVec2::Y, reach), DVec2::NEG_Y, reach);
            share = area_mm2(&own) / whole_mm2;
            block = block.within(own).map_err(Failure::refused)?;
        }
        let subject = Subject::Block(Box::new(block));
        let mut scene = examiner.scene_for(&subject);
        (scene.surface, scene.geometry, scene.traversal) = (Surface::Smooth, Geometry::Displaced, Traversal::Grid);
        scene.window.centre_mm.y -= middle;
        let seen = beams(&subject.tracer(&scene)?, beams_across, beams_per_cell * (end - begin)).image;
        image.values.iter_mut().zip(&seen.values).for_each(|(sum, value)| *sum += share * value);
    }
    Ok(View { metrics: compare(examiner, &image)?, image })
}

/// What of a convex polygon lies on this side of a line: `along . p <= reach`.
fn clipped(points: &[DVec3], along: DVec2, reach: f64) -> Vec<DVec3> {
    let over = |p: DVec3| p.truncate().dot(along) - reach;
    let mut kept = Vec::with_capacity(points.len() + 2);
    for (k, &from) in points.iter().enumerate() {
        let to = points[(k + 1) % points.len()];
        let (a, b) = (over(from), over(to));
        if a <= 0.0 {
            kept.push(from);
        }
        if (a < 0.0 && b > 0.0) || (a > 0.0 && b < 0.0) {
            kept.push(from.lerp(to, a / (a - b)));
        }
    }
    kept
}

/// Area of a polygon as seen along the axis, mm².
fn area_mm2(points: &[DVec3]) -> f64 {
    let next = |k: usize| points[(k + 1) % points.len()].truncate();
    (0..points.len()).map(|k| 0.5 * points[k].truncate().perp_dot(next(k))).sum()
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

/// The exit face of a block as a height field, which goes on smoothly beyond its outline.
///
/// # Errors
/// [`UnknownOutline`].
pub(crate) fn surface_of(block: &Block) -> Result<HeightField, Failure> {
    let (size, (nx, ny)) = (block.size_mm(), block.nodes());
    let extent = Extent::new(size.x, size.y);
    let heights = Field::from_vec(nx, ny, block.heights_mm().to_vec());
    let Some(points) = block.outline() else { return Ok(HeightField::new(extent, heights)) };
    let points: Vec<DVec2> = points.iter().map(|p| p.truncate()).collect();
    let tolerance_mm = OUTLINE_TOLERANCE * extent.node_spacing(nx, ny).min_element();
    let outline = Outline::through(&points, extent, tolerance_mm).ok_or_else(|| Failure::refused(UnknownOutline))?;
    Ok(HeightField::outlined(extent, outline, heights).continued())
}

/// How far the points of a file may lie off the curve of an outline, in spacings of its nodes.
const OUTLINE_TOLERANCE: f64 = 0.1;

/// An outline that nobody made here.
#[derive(Clone, Copy, Debug, thiserror::Error)]
#[error(
    "the outline of this block is neither an ellipse nor a rectangle with round corners, which checks and milling take; `glasswarp verify` takes any"
)]
struct UnknownOutline;

/// A face as the verifier takes it.
pub(crate) fn block_of(surface: &HeightField, entry_z_mm: f64) -> Result<Block, Failure> {
    let (extent, heights) = (surface.extent(), surface.heights_mm());
    let size = DVec2::new(extent.width_mm, extent.height_mm);
    let block = Block::from_heights(size, entry_z_mm, (heights.nx(), heights.ny()), heights.as_slice().to_vec());
    let block = match around(surface) {
        Some(points) => block.and_then(|block| block.within(points)),
        None => block,
    };
    block.map_err(Failure::refused)
}

/// Points on the outline of a face that is no rectangle, with its heights: chords as fine as those of a file.
fn around(surface: &HeightField) -> Option<Vec<DVec3>> {
    let (contour, heights) = (surface.contour(), surface.heights_mm());
    if contour.is_rectangle() {
        return None;
    }
    let spacing = surface.extent().node_spacing(heights.nx(), heights.ny()).min_element();
    let spline = SurfaceSpline::through(surface);
    let sagitta = 0.125 * spacing * spacing / contour.radius_mm().max_element();
    Some(contour.polygon(sagitta).into_iter().map(|at| at.extend(spline.sample(at).height_mm)).collect())
}
