//! A block from a file, on its bench, as something that is worked on and looked at again.

use super::{
    behind,
    bench::scene_of,
    changed::changed_bench,
    face::{surface_of, with_face},
    judge::{Examiner, Subject},
    placement::{Expected, Placing, place_block},
    requirements::{Requirements, open_target},
    target_light::TargetLight,
};
use crate::{
    bench::Bench,
    fabricate::{Cutter, Milled, Walls},
    failure::Failure,
    grid::Field,
    irradiance::TargetIrradiance,
    record::SideFile,
    solver::Progress,
    spec::Host,
    surface::HeightField,
};
use glam::DVec3;
use glasswarp_verify::{Block, Geometry, Image, Mesh, Scene, Surface, Traversal, beams, metrics::Metrics};

/// A block and everything that it takes to judge it.
pub struct Workpiece {
    /// Its side file.
    pub side: SideFile,
    /// As it was found: every other face stands on its entry face, within its outline and rim, and
    /// on its bench.
    pub block: Block,
    /// Its exit face.
    pub surface: HeightField,
    /// Traces it, and compares with the picture.
    pub examiner: Examiner,
    /// The light to be drawn in perfect light.
    pub ideal: TargetIrradiance,
    /// The light to be seen in the light that there is.
    pub perceived: TargetIrradiance,
    /// The bench that it was designed for.
    pub bench: Bench,
    /// The same picture by the verifier's own reader.
    pub target: TargetLight,
}

/// The light of a block and how well it draws the picture.
pub struct JudgedImage {
    /// Irradiance on the receiver.
    pub image: Image,
    /// How well it draws the picture.
    pub metrics: Metrics,
}

impl Workpiece {
    /// Takes the mesh of a block, `name`, and its side file, to be looked at on its bench, or at
    /// another distance and through another index. `origin_mm` is from where its coordinates are
    /// counted, `placing` whether it is brought where its bench has it.
    ///
    /// # Errors
    /// No block, no picture, files that cannot be read, a bench that cannot be.
    pub fn of(
        (mesh, name): (Mesh, &str),
        (origin_mm, placing): (DVec3, Placing),
        side: SideFile,
        (ior, distance_mm): (Option<f64>, Option<f64>),
        pixels: usize,
        (host, progress): (&dyn Host, &dyn Progress),
    ) -> Result<Self, Failure> {
        let expected = Expected { bench: &side.bench, origin_mm };
        let (_, block, warnings) = place_block(mesh, name, Some(expected), placing)?;
        warnings.iter().for_each(|warning| host.warn(warning));
        let design = &side.design;
        let picture = design.picture.as_ref().ok_or_else(|| {
            Failure::Usage("the side file names no picture, by which the block could be judged".into())
        })?;
        let designers = open_target(picture, design, design.offset.unwrap_or(0.0), host)?;
        let before = behind::open(design, host)?;
        let (requirements, bench) = Requirements::of_side(designers, &side, &before, host, progress)?;
        let target = TargetLight::of(picture, design, &requirements, &bench, host)?;
        let scene = changed_bench(scene_of(&side.bench, design, &before, host)?, Some(&block), ior, distance_mm)?;
        let examiner = Examiner::new(scene, Some(target.in_perfect_light()), pixels);
        let surface = surface_of(&block)?;
        let Requirements { ideal, perceived, .. } = requirements;
        Ok(Self { side, block, surface, examiner, ideal, perceived, bench, target })
    }

    /// The light of a face on this block.
    pub fn view(&self, surface: &HeightField) -> Result<JudgedImage, Failure> {
        view(&self.examiner, &self.block, surface)
    }

    /// The bench with its pixels, for the smooth surface of a face.
    pub fn scene(&self) -> Scene {
        let subject = Subject::Block(Box::new(self.block.clone()));
        Scene { surface: Surface::Spline, traversal: Traversal::Grid, ..self.examiner.scene_for(&subject) }
    }
}

/// Beams per pixel along each side that a milled face is traced with at least. With fewer than of a
/// smooth face: the image is within 0.001 of that of infinitely many, where scallops move it by a
/// hundred times that.
const SCALLOP_BEAMS: usize = 4;
/// Most beams that are traced at once.
const MOST_BEAMS: usize = 1 << 30;

/// The walls of a block's rim around its face, where it stands above it.
pub fn walls_of<'a>(block: &Block, surface: &'a HeightField, cutter: Cutter) -> Option<Walls<'a>> {
    Walls::around(surface, cutter, block.rim_z_mm()?)
}

/// The light of a milled face on a block, by its own slopes, and the face: of many millions of
/// nodes there is never a second copy. `design` is the face before.
pub fn view_milled(
    examiner: &Examiner,
    block: &Block,
    design: &HeightField,
    milled: Milled,
) -> Result<(JudgedImage, HeightField), Failure> {
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
    let view = JudgedImage { metrics: compare(examiner, &image)?, image };
    let Subject::Block(face) = subject else { unreachable!("it was made a block") };
    Ok((view, design.with_heights(Field::from_vec(nx, ny, face.into_heights_mm()))))
}

/// The light of another face on a block.
pub fn view(examiner: &Examiner, block: &Block, surface: &HeightField) -> Result<JudgedImage, Failure> {
    view_of(examiner, &Subject::Block(Box::new(with_face(block, surface)?)))
}

/// The light of the smooth surface of a block.
pub fn view_of(examiner: &Examiner, block: &Subject) -> Result<JudgedImage, Failure> {
    let image = examiner.trace(block, Surface::Spline, Geometry::Displaced)?.image;
    Ok(JudgedImage { metrics: compare(examiner, &image)?, image })
}

fn compare(examiner: &Examiner, image: &Image) -> Result<Metrics, Failure> {
    examiner.compare(image)?.ok_or_else(|| Failure::Usage("there is no picture to compare with".into()))
}
