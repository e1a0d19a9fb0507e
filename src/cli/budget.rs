//! The error budget: what each step between the solver and the file does to the light.

use super::{
    console::say,
    error::Failure,
    judge::{self, Examiner, Judgement, Subject},
    side_file::file_name,
    workpiece::block_of,
};
use glasswarp::{
    bench::{Bench, ExitFace},
    forward,
    grid::Field,
    pipeline,
    report::{self, BudgetStep, Exposure},
    solid::Solid,
    surface::SurfaceSpline,
};
use glasswarp_verify::{
    Geometry, Image, Mesh, Surface,
    metrics::{self, Metrics},
};
use image::GrayImage;
use rayon::prelude::*;
use std::{
    borrow::Cow,
    path::{Path, PathBuf},
};

/// A way of looking at the block.
pub(crate) struct Step {
    pub(crate) name: String,
    /// `None` if it is known to be what another step showed, as the name says.
    pub(crate) seen: Option<Seen>,
}

/// What a step showed.
pub(crate) struct Seen {
    pub(crate) image: Image,
    pub(crate) metrics: Metrics,
    /// Relative RMS difference from the light of the true surface of the file: what this step alone does.
    pub(crate) moved: f64,
}

/// The steps that need nothing but the file.
const VIEWS: [(&str, Surface, Geometry); 3] = [
    ("on the normal-mapped plane (the paper's assumption)", Surface::Spline, Geometry::NormalMappedPlane),
    ("triangles with smooth normals (renderers)", Surface::Smooth, Geometry::Displaced),
    ("flat triangles (the file to the letter)", Surface::Facets, Geometry::Displaced),
];

/// Collects steps with their distance from one image.
struct Ledger<'a> {
    examiner: &'a Examiner,
    truth: &'a Image,
    steps: Vec<Step>,
}

impl Ledger<'_> {
    fn book(&mut self, name: impl Into<String>, image: Image) -> Result<(), Failure> {
        if let Some(metrics) = self.examiner.compare(&image)? {
            let moved = metrics::rel_rms(&image, self.truth).map_err(Failure::refused)?;
            self.steps.push(Step { name: name.into(), seen: Some(Seen { image, metrics, moved }) });
        }
        Ok(())
    }

    /// Several at a time, in their order.
    fn book_all(&mut self, seen: Vec<(String, Image)>) -> Result<(), Failure> {
        let book = |(name, image): (String, Image)| {
            let mut ledger = Ledger { examiner: self.examiner, truth: self.truth, steps: Vec::new() };
            ledger.book(name, image)?;
            Ok(ledger.steps)
        };
        let booked: Vec<Vec<Step>> = seen.into_par_iter().map(book).collect::<Result<_, Failure>>()?;
        self.steps.extend(booked.into_iter().flatten());
        Ok(())
    }

    fn look(&mut self, name: &str, subject: &Subject, surface: Surface, geometry: Geometry) -> Result<(), Failure> {
        let image = self.examiner.look(subject, surface, geometry)?.image;
        self.book(name, image)
    }
}

/// A block seen otherwise than as its smooth surface where it really is. Empty for another solid, or without a target.
pub(crate) fn of_file(subject: &Subject, examiner: &Examiner, judgement: &Judgement) -> Result<Vec<Step>, Failure> {
    let mut ledger = Ledger { examiner, truth: &judgement.caustic, steps: Vec::new() };
    if let (Subject::Block(_), Some(_)) = (subject, examiner.wanted()) {
        ledger.book("the smooth surface through the vertices", judgement.caustic.clone())?;
        for (name, surface, geometry) in VIEWS {
            ledger.look(name, subject, surface, geometry)?;
        }
    }
    Ok(ledger.steps)
}

/// The light of a design before there is a file: nothing of it waits for one.
pub(crate) struct Exact {
    /// As the solver itself casts it.
    own: Image,
    /// Of the heights in double precision, on the plane and where they are.
    plane: Image,
    displaced: Image,
}

impl Exact {
    /// `own` is the light that the solver saw last, if it is that of this very face; otherwise it is cast again.
    pub(crate) fn of(
        block: &pipeline::Block,
        bench: &Bench,
        own: Option<&Field<f64>>,
        examiner: &Examiner,
    ) -> Result<Self, Failure> {
        let own = own.filter(|light| (light.nx(), light.ny()) == examiner.pixels()).cloned().unwrap_or_else(|| {
            let spline = SurfaceSpline::through(&block.surface);
            let displaced = forward::Geometry::Displaced;
            forward::irradiance(&spline, bench, displaced, examiner.beams(), examiner.pixels()).irradiance
        });
        let exact = match block.solid.rim_z_mm() {
            _ if block.solid.contour().is_some() => {
                Subject::of(Cow::Owned(mesh_of(&block.solid, None)), Path::new("the height field"))?
            }
            None => Subject::Block(Box::new(block_of(block.solid.surface(), block.solid.entry_z_mm())?.with_spline())),
            Some(_) => {
                let heights_mm = block.solid.surface().heights_mm();
                Subject::of(Cow::Owned(mesh_of(&block.solid, Some(heights_mm))), Path::new("the height field"))?
            }
        };
        let look = |geometry| examiner.look(&exact, Surface::Spline, geometry).map(|seen| seen.image);
        Ok(Self {
            own: judge::image_of(&own),
            plane: look(Geometry::NormalMappedPlane)?,
            displaced: look(Geometry::Displaced)?,
        })
    }
}

/// Every step of a design: what is known without a file, the first file as read back in every view, and the other files. `judged`
/// is the first file with its [views](Judged::views), and `judgement` was made of it.
pub(crate) fn of_design(
    design: (&pipeline::Block, &Bench),
    exact: Exact,
    (judged, seen): (&Judged, Vec<Image>),
    others: &[(Mesh, PathBuf)],
    examiner: &Examiner,
    judgement: &Judgement,
) -> Result<Vec<Step>, Failure> {
    let _span = tracing::info_span!("error budget").entered();
    let (block, bench) = design;
    let mut ledger = Ledger { examiner, truth: &judgement.caustic, steps: Vec::new() };
    let name = file_name(&judged.path);
    let mut all = vec![
        ("the solver's own map".to_owned(), exact.own),
        ("height field, on the normal-mapped plane".to_owned(), exact.plane),
        ("height field, on the displaced surface".to_owned(), exact.displaced),
        (format!("{name} read back, its smooth surface"), judgement.caustic.clone()),
    ];
    all.extend(VIEWS[1..].iter().zip(seen).map(|((view, ..), image)| ((*view).to_owned(), image)));
    ledger.book_all(all)?;
    for (other, path) in others {
        let other_name = file_name(path);
        if other.triangles == judged.mesh.triangles && other.vertices == judged.mesh.vertices {
            ledger
                .steps
                .push(Step { name: format!("{other_name} read back: the vertices of {name}, bit by bit"), seen: None });
            continue;
        }
        let subject = || Subject::of(Cow::Borrowed(other), path);
        if other.triangles != judged.mesh.triangles {
            let name = format!("{other_name} read back, its smooth surface");
            ledger.look(&name, &subject()?, Surface::Spline, Geometry::Displaced)?;
            continue;
        }
        let worst = other.vertices.iter().zip(&judged.mesh.vertices).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        let name = format!("{other_name} read back, vertices within {:.1} nm", 1e6 * worst);
        let most = farthest(worst, block, bench);
        if most < NO_PIXEL * bench.window().width_mm / examiner.pixels().0 as f64 {
            let name = format!("{name}: they move light by at most {:.1} um", 1e3 * most);
            ledger.steps.push(Step { name, seen: None });
        } else {
            ledger.look(&name, &subject()?, Surface::Spline, Geometry::Displaced)?;
        }
    }
    Ok(ledger.steps)
}

/// Part of a pixel that nobody sees.
const NO_PIXEL: f64 = 0.05;

/// How far light can move on the receiver if nodes move by this much, mm: the slope between neighbours changes by twice that over
/// their distance.
fn farthest(nodes_mm: f64, block: &pipeline::Block, bench: &Bench) -> f64 {
    let face = block.solid.surface();
    let spacing = face.extent().node_spacing(face.heights_mm().nx(), face.heights_mm().ny()).min_element();
    let turned = match bench.exit_face() {
        ExitFace::Refracts { ior } => ior - 1.0,
        ExitFace::Reflects => 2.0,
    };
    // Rays from the side are longer, and spread the more.
    let way = (bench.receiver().point(bench.window_centre_mm()).length() / bench.distance_mm()).powi(3);
    turned * bench.distance_mm() * way * 2.0 * nodes_mm / spacing
}

/// The file of a design that is judged, read back from disk.
pub(crate) struct Judged {
    path: PathBuf,
    mesh: Mesh,
    pub(crate) subject: Subject,
}

impl Judged {
    /// Finds out what was read from this file.
    pub(crate) fn of(mesh: Mesh, path: PathBuf) -> Result<Self, Failure> {
        Ok(Self { subject: Subject::of(Cow::Borrowed(&mesh), &path)?, path, mesh })
    }

    /// Its light in every view that needs the file, but for its smooth surface, which is what is judged.
    pub(crate) fn views(&self, examiner: &Examiner) -> Result<Vec<Image>, Failure> {
        let look = |&(_, surface, geometry): &(_, Surface, Geometry)| {
            examiner.look(&self.subject, surface, geometry).map(|seen| seen.image)
        };
        VIEWS[1..].par_iter().map(look).collect()
    }
}

/// The surface of a solid as the verifier takes it, with the exit face's heights as given instead of in single precision.
pub(crate) fn mesh_of(solid: &Solid, heights_mm: Option<&Field<f64>>) -> Mesh {
    let mut vertices: Vec<glam::DVec3> =
        (0..solid.vertex_count()).map(|v| glam::Vec3::from(solid.vertex(v)).as_dvec3() + solid.origin_mm()).collect();
    if let Some(heights_mm) = heights_mm {
        vertices.iter_mut().zip(heights_mm.as_slice()).for_each(|(vertex, &z)| vertex.z = z);
    }
    let triangles = (0..solid.triangle_count()).into_par_iter().map(|t| solid.triangle(t)).collect();
    Mesh { vertices, triangles, ..Mesh::default() }
}

/// Prints the steps as a table, and what the paper's assumption is worth.
pub(crate) fn print(steps: &[Step], distance_mm: f64) {
    if steps.is_empty() {
        return;
    }
    say!("\nThe same block, step by step                            relative RMS     SSIM   moved by");
    for Step { name, seen } in steps {
        match seen {
            Some(Seen { metrics, moved, .. }) => {
                say!("  {name:<53} {:>12.4} {:>8.4} {moved:>10.5}", metrics.rel_rms, metrics.ssim);
            }
            None => say!("  {name}"),
        }
    }
    let plane = steps.iter().find(|step| step.name.contains("normal-mapped plane")).and_then(|step| step.seen.as_ref());
    if let Some(plane) = plane {
        say!(
            "\nOn this bench, {distance_mm} mm away, the paper's plane would be wrong by {:.1} %.",
            100.0 * plane.moved
        );
    }
}

/// The steps as a sheet of bars and small pictures.
pub(crate) fn sheet(steps: &[Step], wanted: &Image, exposure: Exposure) -> GrayImage {
    let drawn: Vec<BudgetStep> = steps
        .iter()
        .map(|step| BudgetStep {
            name: step.name.clone(),
            seen: step.seen.as_ref().map(|seen| (judge::field_of(&seen.image), seen.metrics.rel_rms)),
        })
        .collect();
    report::budget_sheet(&judge::field_of(wanted), &drawn, exposure)
}
