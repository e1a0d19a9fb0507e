//! The error budget: what each step between the solver and the file does to the light.

use super::{
    changed::deflection_mm,
    judge::{self, Examiner, Judgement, Subject},
};
use crate::{
    bench::Bench, failure::Failure, forward, grid::Field, pipeline, record::document, solid::Solid,
    surface::SurfaceSpline,
};
use glam::{DVec2, DVec3};
use glasswarp_verify::{
    Block, Geometry, Image, Mesh, Surface,
    metrics::{self, Likeness},
};
use rayon::prelude::*;
use std::borrow::Cow;

/// A way of looking at the block.
pub struct BudgetStep {
    /// What it is.
    pub name: String,
    /// `None` if it is known to be what another step showed, as the name says.
    pub traced: Option<Traced>,
}

impl BudgetStep {
    /// What the paper's assumption shows, among the steps of a block.
    pub fn on_the_plane(steps: &[Self]) -> Option<&Traced> {
        let [(plane, ..), ..] = VIEWS;
        steps.iter().find(|step| step.name == plane).and_then(|step| step.traced.as_ref())
    }

    /// The same for programs.
    pub fn document(&self) -> document::BudgetStep {
        let traced = self.traced.as_ref();
        document::BudgetStep {
            name: self.name.clone(),
            rel_rms: traced.and_then(|traced| document::finite(traced.likeness.rel_rms)),
            ssim: traced.and_then(|traced| document::finite(traced.likeness.ssim)),
            moved: traced.and_then(|traced| document::finite(traced.moved)),
        }
    }
}

/// What a step showed.
pub struct Traced {
    /// Irradiance on the receiver.
    pub image: Image,
    /// How well it draws the picture.
    pub likeness: Likeness,
    /// Relative RMS difference from the light of the true surface of the file: what this step alone
    /// does.
    pub moved: f64,
}

/// The ways to see a block otherwise than as its smooth surface where it is.
const VIEWS: [(&str, Surface, Geometry); 3] = [
    ("on the normal-mapped plane (the paper's assumption)", Surface::Spline, Geometry::NormalMappedPlane),
    ("triangles with smooth normals (renderers)", Surface::Smooth, Geometry::Displaced),
    ("flat triangles (the file as it is)", Surface::Facets, Geometry::Displaced),
];

/// Collects steps with their distance from one image.
struct Ledger<'a> {
    examiner: &'a Examiner,
    truth: &'a Image,
    steps: Vec<BudgetStep>,
}

impl Ledger<'_> {
    fn add(&mut self, name: impl Into<String>, image: Image) -> Result<(), Failure> {
        if let Some(likeness) = self.examiner.likeness(&image)? {
            let moved = metrics::rel_rms(&image, self.truth).map_err(Failure::refused)?;
            self.steps.push(BudgetStep { name: name.into(), traced: Some(Traced { image, likeness, moved }) });
        }
        Ok(())
    }

    /// Several at a time, in their order.
    fn add_all(&mut self, images: Vec<(String, Image)>) -> Result<(), Failure> {
        let add = |(name, image): (String, Image)| {
            let mut ledger = Ledger { examiner: self.examiner, truth: self.truth, steps: Vec::new() };
            ledger.add(name, image)?;
            Ok(ledger.steps)
        };
        let added: Vec<Vec<BudgetStep>> = images.into_par_iter().map(add).collect::<Result<_, Failure>>()?;
        self.steps.extend(added.into_iter().flatten());
        Ok(())
    }

    /// Adds a design, or a file of it, whose vertices are off the judged ones; it is looked at only
    /// if that can be seen.
    fn add_near(
        &mut self,
        name: String,
        off: Off,
        judged: &Subject,
        subject: impl FnOnce() -> Result<Subject, Failure>,
    ) -> Result<(), Failure> {
        let most = farthest(off, judged, self.examiner)?;
        let name = format!("{name} within {:.2} nm", 1e6 * off.across_mm.hypot(off.height_mm));
        let window = self.examiner.scene_for(judged).window;
        if most >= NO_PIXEL * window.size_mm.x / window.nx as f64 {
            return self.trace(name, &subject()?, Surface::Spline, Geometry::Displaced);
        }
        self.steps.push(BudgetStep { name: format!("{name}, light within {:.1} um", 1e3 * most), traced: None });
        Ok(())
    }

    fn trace(
        &mut self,
        name: impl Into<String>,
        subject: &Subject,
        surface: Surface,
        geometry: Geometry,
    ) -> Result<(), Failure> {
        let image = self.examiner.trace(subject, surface, geometry)?.image;
        self.add(name, image)
    }
}

/// The light of a block in every view. Empty for another solid, or without a target.
pub fn views(subject: &Subject, examiner: &Examiner) -> Result<Vec<Image>, Failure> {
    if examiner.target().is_none() || matches!(subject, Subject::Solid(_)) {
        return Ok(Vec::new());
    }
    let trace = |&(_, surface, geometry): &(_, Surface, Geometry)| {
        examiner.trace(subject, surface, geometry).map(|beams| beams.image)
    };
    VIEWS.par_iter().map(trace).collect()
}

/// The steps that need nothing but a file: what its `name` shows as it is judged, and its [views].
fn steps_of(name: &str, judgement: &Judgement, views: Vec<Image>) -> Vec<(String, Image)> {
    let viewed = VIEWS.iter().zip(views).map(|((view, ..), image)| ((*view).to_owned(), image));
    std::iter::once((name.to_owned(), judgement.caustic.clone())).chain(viewed).collect()
}

/// A block seen otherwise than as its smooth surface where it really is. Empty for another solid,
/// or without a target.
pub fn of_file(subject: &Subject, examiner: &Examiner, judgement: &Judgement) -> Result<Vec<BudgetStep>, Failure> {
    let mut ledger = Ledger { examiner, truth: &judgement.caustic, steps: Vec::new() };
    let views = views(subject, examiner)?;
    if !views.is_empty() {
        ledger.add_all(steps_of("the smooth surface through the vertices", judgement, views))?;
    }
    Ok(ledger.steps)
}

/// The light of a design as the solver itself casts it. `seen` is what it saw last, if it is that
/// of this very face; otherwise it is cast again.
pub fn own_light(
    block: &pipeline::DesignedBlock,
    bench: &Bench,
    seen: Option<&Field<f64>>,
    examiner: &Examiner,
) -> Image {
    let seen = seen.filter(|light| (light.nx(), light.ny()) == examiner.pixels());
    judge::image_of(&seen.cloned().unwrap_or_else(|| {
        let spline = SurfaceSpline::through(&block.surface);
        let displaced = forward::Geometry::Displaced;
        forward::irradiance(&spline, bench, displaced, examiner.beams(), examiner.pixels()).irradiance
    }))
}

/// The file of a design that is judged, read back from disk.
pub struct Judged<'a> {
    name: &'a str,
    mesh: Mesh,
    /// What it holds.
    pub subject: Subject,
}

impl<'a> Judged<'a> {
    /// Finds out what was read from a file of this name.
    pub fn of(mesh: Mesh, name: &'a str) -> Result<Self, Failure> {
        Ok(Self { subject: Subject::of(Cow::Borrowed(&mesh), name)?, name, mesh })
    }
}

/// The steps of a design as far as the file that is judged: what the solver saw, and the file as
/// read back in every view. `views` are [those](views) of the file, and `judgement` was made of it.
pub fn of_design(
    block: &pipeline::DesignedBlock,
    own: Image,
    (judged, views): (&Judged<'_>, Vec<Image>),
    examiner: &Examiner,
    judgement: &Judgement,
) -> Result<Vec<BudgetStep>, Failure> {
    let _span = tracing::info_span!("error budget").entered();
    let name = judged.name;
    let own = ("the solver's own map".to_owned(), own);
    let read_back = steps_of(&format!("{name} read back, its smooth surface"), judgement, views);
    let mut ledger = Ledger { examiner, truth: &judgement.caustic, steps: Vec::new() };
    ledger.add_all(std::iter::once(own).chain(read_back).collect())?;
    let after = ledger.steps.split_off(ledger.steps.len().min(1));
    let exact = "the height field in f64";
    match off_nodes(block, &judged.subject) {
        Some(off) => ledger.add_near(format!("{exact}: nodes"), off, &judged.subject, || double_precision(block))?,
        None => ledger.trace(exact, &double_precision(block)?, Surface::Spline, Geometry::Displaced)?,
    }
    ledger.steps.extend(after);
    Ok(ledger.steps)
}

/// What another file does to the light, beside the one that is judged. Nothing without a target.
pub fn of_other(
    judged: &Judged<'_>,
    (name, mesh): (&str, Mesh),
    examiner: &Examiner,
    judgement: &Judgement,
) -> Result<Vec<BudgetStep>, Failure> {
    let _span = tracing::info_span!("compare", file = name).entered();
    let first = judged.name;
    let mut ledger = Ledger { examiner, truth: &judgement.caustic, steps: Vec::new() };
    let alike = mesh.triangles == judged.mesh.triangles;
    if alike && mesh.vertices == judged.mesh.vertices {
        let name = format!("{name} read back: the vertices of {first}, bit by bit");
        return Ok(vec![BudgetStep { name, traced: None }]);
    }
    let off = alike.then(|| Off::between(&mesh.vertices, &judged.mesh.vertices));
    let subject = || Subject::of(Cow::Owned(mesh), name);
    match off {
        Some(off) => ledger.add_near(format!("{name} read back: vertices"), off, &judged.subject, subject)?,
        None => {
            let name = format!("{name} read back, its smooth surface");
            ledger.trace(name, &subject()?, Surface::Spline, Geometry::Displaced)?;
        }
    }
    Ok(ledger.steps)
}

/// How far the vertices of one face are from those of another, at most, mm.
#[derive(Clone, Copy)]
struct Off {
    across_mm: f64,
    height_mm: f64,
}

impl Off {
    fn between(one: &[DVec3], other: &[DVec3]) -> Self {
        let farther = |most: DVec3, (a, b): (&DVec3, &DVec3)| most.max((*a - *b).abs());
        let most = one.iter().zip(other).fold(DVec3::ZERO, farther);
        Self { across_mm: most.truncate().length(), height_mm: most.z }
    }
}

/// How far the nodes of a block that was read back are from those of its design. `None` if it has
/// others.
fn off_nodes(design: &pipeline::DesignedBlock, found: &Subject) -> Option<Off> {
    let Subject::Block(found) = found else { return None };
    let face = design.solid.surface();
    let nodes = (face.heights_mm().nx(), face.heights_mm().ny());
    let heights_mm = face.heights_mm().as_slice();
    let off = |k: usize| if found.knows(k) { (heights_mm[k] - found.heights_mm()[k]).abs() } else { 0.0 };
    (found.nodes() == nodes).then(|| Off {
        across_mm: (face.extent().as_vec() - found.size_mm()).length(),
        height_mm: (0..heights_mm.len()).map(off).fold(0.0, f64::max),
    })
}

/// The exit face of a design with all digits of its heights.
pub fn double_precision(block: &pipeline::DesignedBlock) -> Result<Subject, Failure> {
    let solid = &block.solid;
    let place = "the height field";
    match solid.rim_z_mm() {
        _ if solid.contour().is_some() => Subject::of(Cow::Owned(mesh_of(solid, None)), place),
        None => {
            let (size, heights) = (solid.extent().as_vec(), solid.surface().heights_mm());
            let nodes = (heights.nx(), heights.ny());
            let exact = Block::from_heights(size, solid.entry_z_mm(), nodes, heights.as_slice().to_vec());
            Ok(Subject::Block(Box::new(exact.map_err(Failure::refused)?.with_spline())))
        }
        Some(_) => Subject::of(Cow::Owned(mesh_of(solid, Some(solid.surface().heights_mm()))), place),
    }
}

/// Part of a pixel that nobody sees.
const NO_PIXEL: f64 = 0.05;

/// How much the slope of a bicubic not-a-knot spline changes at most, in units of e/h, if its
/// heights at nodes of spacing h are off by e: sqrt(2) times 8.62, the greatest sum of the
/// derivatives of its cardinal functions along one axis (at an edge; 3 elsewhere), times 1.97, that
/// of the functions along the other (1.55 elsewhere).
const SPLINE_SLOPE: f64 = 24.1;

/// The slope by which it is found how far light goes astray: small to all that turn it, great to
/// rounding.
const SMALL: f64 = 1e-4;

/// How far light can move on the receiver, mm, if vertices of the judged block are off by so much.
/// They are taken to stand on a regular grid: their heights turn the light, their places take it
/// along. Infinite where nothing is known of the block.
fn farthest(off: Off, judged: &Subject, examiner: &Examiner) -> Result<f64, Failure> {
    let Subject::Block(block) = judged else { return Ok(f64::INFINITY) };
    let cells = DVec2::new((block.nodes().0 - 1) as f64, (block.nodes().1 - 1) as f64);
    let spacing = (block.size_mm() / cells).min_element();
    let thrown = deflection_mm(block, &examiner.scene_for(judged), SMALL, &[DVec2::X, DVec2::Y])? / SMALL;
    Ok(off.across_mm + thrown * SPLINE_SLOPE * off.height_mm / spacing)
}

/// The surface of a solid as the verifier takes it, with the exit face's heights as given instead
/// of in single precision.
pub fn mesh_of(solid: &Solid, heights_mm: Option<&Field<f64>>) -> Mesh {
    let mut vertices: Vec<DVec3> =
        (0..solid.vertex_count()).map(|v| glam::Vec3::from(solid.vertex(v)).as_dvec3() + solid.origin_mm()).collect();
    if let Some(heights_mm) = heights_mm {
        vertices.iter_mut().zip(heights_mm.as_slice()).for_each(|(vertex, &z)| vertex.z = z);
    }
    let triangles = (0..solid.triangle_count()).into_par_iter().map(|t| solid.triangle(t)).collect();
    Mesh { vertices, triangles, ..Mesh::default() }
}
