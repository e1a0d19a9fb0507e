//! Opens a solid, looks at the light that comes through it, and compares it with the picture.

use crate::{failure::Failure, grid::Field, irradiance::to_picture_order, record::document};
use glam::DVec2;
use glasswarp_verify::{
    Beams, Block, BlockError, Flux, Fresnel, Geometry, Image, Mesh, PhotonAgreement, PhotonPlan, PhotonTally, Scene,
    Surface, Tracer, Traversal, UnbiasedError, beams, facet_beams,
    metrics::{self, Likeness, Metrics},
    photons,
    reference::resampled,
};
use std::borrow::Cow;

/// What is looked at.
pub enum Subject {
    /// A planar entry face and an exit face over a regular grid.
    Block(Box<Block>),
    /// Any other closed solid.
    Solid(Box<Mesh>),
}

impl Subject {
    /// Finds out what a mesh is; `name` is what messages call it.
    ///
    /// # Errors
    /// A mesh that is no closed solid.
    pub fn of(mesh: Cow<'_, Mesh>, name: &str) -> Result<Self, Failure> {
        match Block::from_mesh(&mesh) {
            Ok(block) => Ok(Self::Block(Box::new(block.with_spline()))),
            Err(error @ BlockError::Unsound(_)) => Err(not_a_block(name, error)),
            Err(_) => Ok(Self::Solid(Box::new(mesh.into_owned()))),
        }
    }

    /// A tracer of light through it.
    ///
    /// # Errors
    /// A scene that cannot be.
    pub fn tracer(&self, scene: &Scene) -> Result<Tracer, Failure> {
        match self {
            Self::Block(block) => Tracer::for_block(block, scene),
            Self::Solid(mesh) => Tracer::for_solid(mesh, scene),
        }
        .map_err(Failure::refused)
    }

    /// The surface that is meant by the file: of a block the smooth one through its vertices, of
    /// another solid its facets.
    fn surface(&self) -> Surface {
        match self {
            Self::Block(_) => Surface::Spline,
            Self::Solid(_) => Surface::Facets,
        }
    }

    /// The block, if it is one.
    pub fn block(&self) -> Option<&Block> {
        if let Self::Block(block) = self { Some(block) } else { None }
    }

    /// Where light enters, mm: the lowest plane.
    pub fn entry_z_mm(&self) -> f64 {
        match self {
            Self::Block(block) => block.entry_z_mm(),
            Self::Solid(mesh) => mesh.bounds().0.z,
        }
    }

    /// Size seen along the axis, mm.
    pub fn size_mm(&self) -> DVec2 {
        match self {
            Self::Block(block) => block.size_mm(),
            Self::Solid(mesh) => {
                let (lower, upper) = mesh.bounds();
                (upper - lower).truncate()
            }
        }
    }
}

/// A mesh that is no block; `name` is what it is called.
pub fn not_a_block(name: &str, error: BlockError) -> Failure {
    Failure::InvalidMesh { what: format!("{name} is no block of glass"), source: Some(error.into()) }
}

/// Looks at subjects on one bench, always with the same pixels.
pub struct Examiner {
    scene: Scene,
    /// How surfaces are understood, if not as their files mean them.
    surface: Option<Surface>,
    target: Option<Image>,
}

/// Beams per pixel along each side. The image of a photograph is then within 0.001 of that of
/// infinitely many.
const BEAMS_PER_PIXEL: usize = 4;

/// Windows that are this many times as high as wide have as many pixels as asked for across; of
/// narrower ones, fewer, so that there are no more in all.
const MOST_UPRIGHT: f64 = 2.0;

/// Beams across a solid that is no block, and across a block that is no rectangle, at least.
const LEAST_BEAMS: usize = 1024;

impl Examiner {
    /// An examiner with `pixels` across, at most as many as the picture has that light is judged
    /// by.
    pub fn new(mut scene: Scene, target: Option<&Image>, pixels: usize) -> Self {
        let (nx, aspect) = match target {
            Some(target) => (target.nx.min(pixels).max(8), target.ny as f64 / target.nx as f64),
            None => {
                let aspect = scene.window.size_mm.y / scene.window.size_mm.x;
                (pixels.min((pixels as f64 * (MOST_UPRIGHT / aspect).sqrt()) as usize).max(8), aspect)
            }
        };
        let ny = (nx as f64 * aspect).round().clamp(8.0, 32_768.0) as usize;
        (scene.window.nx, scene.window.ny) = (nx, ny);
        Self { scene, surface: None, target: target.map(|target| resampled(target, nx, ny)) }
    }

    /// The same, but surfaces understood in this way, and with or without partial reflection.
    pub fn with_surface(mut self, surface: Option<Surface>, fresnel: Fresnel) -> Self {
        self.surface = surface;
        self.scene.fresnel = fresnel;
        self
    }

    /// The same pixels and the same picture on another bench.
    pub fn on(&self, mut scene: Scene) -> Self {
        (scene.window.nx, scene.window.ny) = self.pixels();
        Self { scene, surface: self.surface, target: self.target.clone() }
    }

    fn surface_of(&self, subject: &Subject) -> Surface {
        self.surface.unwrap_or_else(|| subject.surface())
    }

    /// The bench with its pixels, and the surface of the subject.
    pub fn scene_for(&self, subject: &Subject) -> Scene {
        Scene { surface: self.surface_of(subject), ..self.scene.clone() }
    }

    /// The pixels of the window.
    pub fn pixels(&self) -> (usize, usize) {
        (self.scene.window.nx, self.scene.window.ny)
    }

    /// Beams across for this many pixels.
    pub fn beams(&self) -> (usize, usize) {
        let (nx, ny) = self.pixels();
        (nx * BEAMS_PER_PIXEL, ny * BEAMS_PER_PIXEL)
    }

    /// What light is compared with, at its pixels.
    pub fn target(&self) -> Option<&Image> {
        self.target.as_ref()
    }

    /// The light that comes through the subject, without noise.
    pub fn trace(&self, subject: &Subject, surface: Surface, geometry: Geometry) -> Result<Beams, Failure> {
        self.trace_by(subject, surface, geometry, BEAMS_PER_PIXEL)
    }

    /// The same by so many beams per pixel along each side.
    fn trace_by(
        &self,
        subject: &Subject,
        surface: Surface,
        geometry: Geometry,
        per_pixel: usize,
    ) -> Result<Beams, Failure> {
        let tracer = subject.tracer(&Scene { surface, geometry, traversal: Traversal::Grid, ..self.scene.clone() })?;
        Ok(match (subject, surface) {
            (Subject::Block(block), Surface::Facets) => facet_beams(&tracer, block),
            (Subject::Block(block), _) => self.beams_through(block, &tracer, per_pixel),
            (Subject::Solid(_), _) => {
                // A lens gathers the light of all of its face in a few pixels.
                let ((nx, ny), least) = (self.pixels(), LEAST_BEAMS * per_pixel / BEAMS_PER_PIXEL);
                beams(&tracer, (per_pixel * nx).max(least), (per_pixel * ny).max(least))
            }
        })
    }

    /// The light that a tracer of this block finds, by beams: so many per pixel along each side, or
    /// up to twice as many where these are less than half as many per cell of nodes, and one per
    /// cell at least. What is finer than pixels, such as the scallops of a cutter, still bends the
    /// light, and so does the surface between nodes: the error of a picture of 384 pixels on 1025
    /// nodes was 0.0043 by 1.5 beams a cell, 0.0028 by 2, and 0.0027 by 8. A block that is no
    /// rectangle takes more where pixels are few: at 64 of them the error of a disc was 0.0495 by 4
    /// beams a pixel, 0.0453 by 16, and 0.0451 by 40 million photons.
    pub fn beams_through(&self, block: &Block, tracer: &Tracer, per_pixel: usize) -> Beams {
        let ((nx, ny), (columns, rows)) = (self.pixels(), block.nodes());
        let least = if block.is_rectangular() { 1 } else { LEAST_BEAMS * per_pixel / BEAMS_PER_PIXEL };
        let along = |pixels: usize, nodes: usize| {
            let (wanted, cells) = (per_pixel * pixels, nodes - 1);
            wanted.max((per_pixel * cells / 2).min(2 * wanted)).max(cells).max(least)
        };
        beams(tracer, along(nx, columns), along(ny, rows))
    }

    /// How well an image agrees with the target, if there is one.
    pub fn compare(&self, image: &Image) -> Result<Option<Metrics>, Failure> {
        self.target.as_ref().map(|target| metrics::compare(image, target).map_err(Failure::refused)).transpose()
    }

    /// The same, but only what tells most.
    pub fn likeness(&self, image: &Image) -> Result<Option<Likeness>, Failure> {
        self.target.as_ref().map(|target| metrics::likeness(image, target).map_err(Failure::refused)).transpose()
    }
}

/// What was found.
pub struct Judgement {
    /// Irradiance on the receiver, by beams through the surface that the file means.
    pub caustic: Image,
    /// Where the light went, by photons.
    pub flux: Flux,
    /// Number of photons.
    pub photon_count: u64,
    /// The photons' image against that of the beams, less their noise.
    pub between: UnbiasedError,
    /// Whether the photons see what the beams see.
    pub agreement: PhotonAgreement,
    /// The comparison with the target, if there is one.
    pub picture: Option<PictureJudgement>,
    /// Size of the window, mm.
    pub window_mm: DVec2,
}

/// How well the light draws the picture.
pub struct PictureJudgement {
    /// The error of the caustic.
    pub metrics: Metrics,
    /// The photons' own opinion of the relative RMS error, less their noise.
    pub photons: UnbiasedError,
}

/// Looks at a subject by beams, and again by photons, which find their way through the hierarchy
/// and share nothing with the lattice of the beams.
pub fn judge(subject: &Subject, examiner: &Examiner, plan: &PhotonPlan) -> Result<Judgement, Failure> {
    // The photons' search structure is built on one core.
    let (seen, tally) = rayon::join(
        || {
            let _span = tracing::info_span!("trace beams").entered();
            examiner.trace(subject, examiner.surface_of(subject), Geometry::Displaced)
        },
        || {
            let _span = tracing::info_span!("trace photons", photons = plan.photons).entered();
            photons(&subject.tracer(&examiner.scene_for(subject))?, plan).map_err(Failure::refused)
        },
    );
    let (seen, tally) = (seen?, tally?);
    let agreement = agreement(subject, examiner, &seen.image, &tally)?;
    let picture = match (examiner.compare(&seen.image)?, examiner.target()) {
        (Some(metrics), Some(target)) => {
            Some(PictureJudgement { metrics, photons: tally.error_against(target).map_err(Failure::refused)? })
        }
        _ => None,
    };
    Ok(Judgement {
        flux: tally.flux(),
        photon_count: tally.photons(),
        between: tally.error_against(&seen.image).map_err(Failure::refused)?,
        agreement,
        picture,
        caustic: seen.image,
        window_mm: examiner.scene.window.size_mm,
    })
}

/// Whether photons see what beams see. Beams have a width, which very many photons can tell: where
/// they do not agree, beams of half the width say how much of it is that.
fn agreement(
    subject: &Subject,
    examiner: &Examiner,
    seen: &Image,
    tally: &PhotonTally,
) -> Result<PhotonAgreement, Failure> {
    let against = |image: &Image| tally.agreement(image).map_err(Failure::refused);
    let first = against(seen)?;
    if first.standard_errors() <= AGREEMENT {
        return Ok(first);
    }
    let surface = examiner.surface_of(subject);
    let finer = examiner.trace_by(subject, surface, Geometry::Displaced, 2 * BEAMS_PER_PIXEL)?.image;
    let mut second = against(&finer)?;
    let width = metrics::rel_rms(&finer, seen).map_err(Failure::refused)?.powi(2);
    second.standard_error = second.standard_error.hypot(width);
    Ok(second)
}

/// Standard errors beyond which photons and beams do not show the same light: chance gets there
/// once in 16 000 runs.
const DISAGREEMENT: f64 = 4.0;
/// Standard errors up to which they do: chance keeps to them 19 times in 20.
const AGREEMENT: f64 = 2.0;

impl Judgement {
    /// Whether photons and beams contradict each other.
    pub fn is_contradicted(&self) -> bool {
        // Not a number is no agreement either.
        !matches!(self.agreement.standard_errors(), off if off <= DISAGREEMENT)
    }

    /// What the photons say of the beams, with what chance makes of it.
    pub fn agreement_in_words(&self) -> String {
        let off = self.agreement.standard_errors();
        if self.is_contradicted() {
            format!("DISAGREE: off by {off:.1} standard errors (chance goes beyond 4 once in 16 000 times)")
        } else if off > AGREEMENT {
            format!(
                "neither confirm it nor disagree: off by {off:.1} standard errors (up to 2 is expected 19 times in 20, \
                 beyond 4 once in 16 000 times); a verification with more photons tells"
            )
        } else {
            format!("agree: off by {off:.1} standard errors (up to 2 is expected 19 times in 20)")
        }
    }

    /// What becomes of light that misses the picture, if that is more than a hundredth. `skirt` is
    /// the share of the face beyond the part that draws: its light is meant to fall elsewhere.
    pub fn astray_in_words(&self, skirt: f64) -> Option<String> {
        let flux = &self.flux;
        let astray = 1.0 - flux.window;
        (astray > skirt + 0.01).then(|| {
            format!(
                "{:.1} % of the light does not reach the picture ({:.1} % lands beside it, {:.1} % is totally reflected)",
                100.0 * astray,
                100.0 * flux.missed,
                100.0 * flux.totally_reflected
            )
        })
    }

    /// Fails if photons and beams contradict each other: then no figure can be trusted.
    pub fn demand_agreement(&self) -> Result<(), Failure> {
        if !self.is_contradicted() {
            return Ok(());
        }
        Err(Failure::BelowThreshold(format!(
            "photons and beams disagree about the light by {:.1} standard errors, beyond 4 of which chance goes once in 16 000 times: no figure above can be trusted",
            self.agreement.standard_errors()
        )))
    }

    /// The judgement for programs.
    pub fn document(&self) -> document::Judgement {
        let pixel_mm = self.window_mm.x / self.caustic.nx as f64;
        document::Judgement {
            pixels: [self.caustic.nx, self.caustic.ny],
            picture: self
                .picture
                .as_ref()
                .map(|verdict| picture_document(&verdict.metrics, pixel_mm, verdict.photons.rel_rms())),
            photons: self.photon_count,
            photons_differ: document::finite(self.between.rel_rms()),
            photons_differ_error: document::finite(self.between.rel_rms_error()),
            photons_off: document::finite(self.agreement.standard_errors()),
            light: flux_document(&self.flux),
        }
    }
}

/// How well light draws a picture, for programs. `pixel_mm` is the width of a pixel.
fn picture_document(m: &Metrics, pixel_mm: f64, photons_rel_rms: f64) -> document::Picture {
    let finite = document::finite;
    let [edge, picture_edge] = m.edge_width_mm(pixel_mm).map(finite);
    document::Picture {
        rel_rms: finite(m.rel_rms),
        psnr_db: finite(m.psnr_db),
        ssim: finite(m.ssim),
        edge_width_mm: edge,
        picture_edge_width_mm: picture_edge,
        black_level: finite(m.black_level),
        picture_black_level: finite(m.target_black_level),
        contrast: finite(m.contrast),
        picture_contrast: finite(m.target_contrast),
        photons_rel_rms: finite(photons_rel_rms),
    }
}

/// Where light went, for programs.
pub fn flux_document(flux: &Flux) -> document::Light {
    document::Light {
        window: flux.window,
        missed: flux.missed,
        totally_reflected: flux.totally_reflected,
        side: flux.side,
        reflected: flux.reflected,
        beside: flux.beside,
        lost: flux.lost,
    }
}

/// A field in the frame's order as the verifier's image, in the picture's.
pub fn image_of(cells: &Field<f64>) -> Image {
    let picture = to_picture_order(cells);
    Image::new(picture.nx(), picture.ny(), picture.into_vec())
}

/// The verifier's image as a field in the picture's order, mean 1.
pub fn field_of(image: &Image) -> Field<f64> {
    let mean = image.mean();
    Field::from_vec(image.nx, image.ny, image.values.iter().map(|v| v / mean).collect())
}
