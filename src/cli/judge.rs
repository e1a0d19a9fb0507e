//! Opens a solid, looks at the light that comes through it, and compares it with the picture.

use super::{console::say, error::Failure, json};
use glam::DVec2;
use glasswarp::{
    grid::Field,
    target::{TargetIrradiance, to_picture_order},
};
use glasswarp_verify::{
    Beams, Block, BlockError, Flux, Fresnel, Geometry, Image, Mesh, NoisyError, PhotonPlan, Scene, Surface, Tracer,
    Traversal, beams, facet_beams,
    load::{self, LoadError},
    metrics::{self, Likeness, Metrics},
    photons,
};
use std::{borrow::Cow, path::Path};

/// What is looked at.
pub(crate) enum Subject {
    /// A planar entry face and an exit face over a regular grid.
    Block(Box<Block>),
    /// Any other closed solid.
    Solid(Box<Mesh>),
}

impl Subject {
    /// Finds out what a mesh is; `path` is where it comes from.
    pub(crate) fn of(mesh: Cow<'_, Mesh>, path: &Path) -> Result<Self, Failure> {
        match Block::from_mesh(&mesh) {
            Ok(block) => Ok(Self::Block(Box::new(block.with_spline()))),
            Err(error @ BlockError::Unsound(_)) => Err(not_a_block(path, error)),
            Err(_) => Ok(Self::Solid(Box::new(mesh.into_owned()))),
        }
    }

    pub(crate) fn tracer(&self, scene: &Scene) -> Result<Tracer, Failure> {
        match self {
            Self::Block(block) => Tracer::for_block(block, scene),
            Self::Solid(mesh) => Tracer::for_solid(mesh, scene),
        }
        .map_err(Failure::refused)
    }

    /// The surface that is meant by the file: of a block the smooth one through its vertices, of another solid its facets.
    fn surface(&self) -> Surface {
        match self {
            Self::Block(_) => Surface::Spline,
            Self::Solid(_) => Surface::Facets,
        }
    }

    /// Size seen along the axis, mm.
    pub(crate) fn size_mm(&self) -> DVec2 {
        match self {
            Self::Block(block) => block.size_mm(),
            Self::Solid(mesh) => {
                let (lower, upper) = mesh.bounds();
                (upper - lower).truncate()
            }
        }
    }
}

/// Reads a mesh file.
pub(crate) fn read(path: &Path) -> Result<Mesh, Failure> {
    read_by(load::read, path)
}

/// Reads a mesh file but for its normals.
pub(crate) fn read_bare(path: &Path) -> Result<Mesh, Failure> {
    read_by(load::read_bare, path)
}

fn read_by(read: impl Fn(&Path) -> Result<Mesh, LoadError>, path: &Path) -> Result<Mesh, Failure> {
    let _span = tracing::info_span!("read back", file = %path.display()).entered();
    read(path).map_err(|error| {
        let what = format!("{} is no readable mesh", path.display());
        match error {
            LoadError::Read { .. } => Failure::Io { what, source: error.into() },
            LoadError::UnknownExtension { .. } => Failure::refused(error),
            _ => Failure::InvalidMesh { what, source: Some(error.into()) },
        }
    })
}

pub(crate) fn not_a_block(path: &Path, error: BlockError) -> Failure {
    Failure::InvalidMesh { what: format!("{} is no block of glass", path.display()), source: Some(error.into()) }
}

/// Looks at subjects on one bench, always with the same pixels.
pub(crate) struct Examiner {
    scene: Scene,
    /// How surfaces are understood, if not as their files mean them.
    surface: Option<Surface>,
    wanted: Option<Image>,
}

/// Beams per pixel along each side. The image of a photograph is then within 0.001 of that of infinitely many.
const BEAMS_PER_PIXEL: usize = 4;

/// Windows that are this many times as high as wide have as many pixels as asked for across; of narrower ones, fewer, so that there are no
/// more in all.
const MOST_UPRIGHT: f64 = 2.0;

/// Beams across a solid that is no block, and across a block that is no rectangle, at least.
const LEAST_BEAMS: usize = 1024;

impl Examiner {
    /// An examiner with `pixels` across, at most as many as the target has.
    pub(crate) fn new(mut scene: Scene, target: Option<&TargetIrradiance>, pixels: usize) -> Self {
        let (nx, aspect) = match target {
            Some(target) => {
                let cells = target.cells();
                (cells.nx().min(pixels).max(8), cells.ny() as f64 / cells.nx() as f64)
            }
            None => {
                let aspect = scene.window.size_mm.y / scene.window.size_mm.x;
                (pixels.min((pixels as f64 * (MOST_UPRIGHT / aspect).sqrt()) as usize).max(8), aspect)
            }
        };
        let ny = (nx as f64 * aspect).round().clamp(8.0, 32_768.0) as usize;
        (scene.window.nx, scene.window.ny) = (nx, ny);
        Self { scene, surface: None, wanted: target.map(|target| image_of(target.resampled(nx, ny).cells())) }
    }

    /// The same, but surfaces understood in this way, and with or without partial reflection.
    pub(crate) fn seeing(mut self, surface: Option<Surface>, fresnel: Fresnel) -> Self {
        self.surface = surface;
        self.scene.fresnel = fresnel;
        self
    }

    fn surface_of(&self, subject: &Subject) -> Surface {
        self.surface.unwrap_or_else(|| subject.surface())
    }

    /// The bench with its pixels, and the surface of the subject.
    pub(crate) fn scene_for(&self, subject: &Subject) -> Scene {
        Scene { surface: self.surface_of(subject), ..self.scene.clone() }
    }

    /// The pixels of the window.
    pub(crate) fn pixels(&self) -> (usize, usize) {
        (self.scene.window.nx, self.scene.window.ny)
    }

    /// Beams across for this many pixels.
    pub(crate) fn beams(&self) -> (usize, usize) {
        let (nx, ny) = self.pixels();
        (nx * BEAMS_PER_PIXEL, ny * BEAMS_PER_PIXEL)
    }

    pub(crate) fn wanted(&self) -> Option<&Image> {
        self.wanted.as_ref()
    }

    /// The light that comes through the subject, without noise.
    pub(crate) fn look(&self, subject: &Subject, surface: Surface, geometry: Geometry) -> Result<Beams, Failure> {
        let tracer = subject.tracer(&Scene { surface, geometry, traversal: Traversal::Grid, ..self.scene.clone() })?;
        Ok(match (subject, surface) {
            (Subject::Block(block), Surface::Facets) => facet_beams(&tracer, block),
            (Subject::Block(block), _) => self.beams_through(block, &tracer, BEAMS_PER_PIXEL),
            (Subject::Solid(_), _) => {
                // A lens gathers the light of all of its face in a few pixels.
                let (nx, ny) = self.beams();
                beams(&tracer, nx.max(LEAST_BEAMS), ny.max(LEAST_BEAMS))
            }
        })
    }

    /// The light that a tracer of this block finds, by beams: so many per pixel along each side, and at least one per node. What is finer
    /// than pixels, such as the scallops of a cutter, still bends the light.
    pub(crate) fn beams_through(&self, block: &Block, tracer: &Tracer, per_pixel: usize) -> Beams {
        let ((nx, ny), (columns, rows)) = (self.pixels(), block.nodes());
        // Beams that the outline of a block cuts are counted corner by corner, or not cut at all if it is a rectangle.
        let least = if block.is_rectangular() { 1 } else { LEAST_BEAMS };
        beams(tracer, (per_pixel * nx).max(columns - 1).max(least), (per_pixel * ny).max(rows - 1).max(least))
    }

    /// How well an image agrees with the target, if there is one.
    pub(crate) fn compare(&self, image: &Image) -> Result<Option<Metrics>, Failure> {
        self.wanted.as_ref().map(|wanted| metrics::compare(image, wanted).map_err(Failure::refused)).transpose()
    }

    /// The same, but only what tells most.
    pub(crate) fn likeness(&self, image: &Image) -> Result<Option<Likeness>, Failure> {
        self.wanted.as_ref().map(|wanted| metrics::likeness(image, wanted).map_err(Failure::refused)).transpose()
    }
}

/// What was found.
pub(crate) struct Judgement {
    /// Irradiance on the receiver, by beams through the surface that the file means.
    pub(crate) caustic: Image,
    /// Where the light went, by photons.
    pub(crate) flux: Flux,
    /// Number of photons.
    pub(crate) photon_count: u64,
    /// The photons' image against that of the beams, less their noise.
    pub(crate) between: NoisyError,
    /// The comparison with the target, if there is one.
    pub(crate) verdict: Option<Verdict>,
    window_mm: DVec2,
}

/// How well the light draws the picture.
pub(crate) struct Verdict {
    /// The error of the caustic.
    pub(crate) metrics: Metrics,
    /// The photons' own opinion of the relative RMS error, less their noise.
    pub(crate) photons: NoisyError,
}

/// Looks at a subject by beams, and again by photons, which find their way through the hierarchy and share nothing with the
/// lattice of the beams.
pub(crate) fn judge(subject: &Subject, examiner: &Examiner, plan: &PhotonPlan) -> Result<Judgement, Failure> {
    // The photons' search structure is built on one core.
    let (seen, tally) = rayon::join(
        || {
            let _span = tracing::info_span!("trace beams").entered();
            examiner.look(subject, examiner.surface_of(subject), Geometry::Displaced)
        },
        || {
            let _span = tracing::info_span!("trace photons", photons = plan.photons).entered();
            photons(&subject.tracer(&examiner.scene_for(subject))?, plan).map_err(Failure::refused)
        },
    );
    let (seen, tally) = (seen?, tally?);
    let verdict = match (examiner.compare(&seen.image)?, examiner.wanted()) {
        (Some(metrics), Some(wanted)) => {
            Some(Verdict { metrics, photons: tally.error_against(wanted).map_err(Failure::refused)? })
        }
        _ => None,
    };
    Ok(Judgement {
        flux: tally.flux(),
        photon_count: tally.photons(),
        between: tally.error_against(&seen.image).map_err(Failure::refused)?,
        verdict,
        caustic: seen.image,
        window_mm: examiner.scene.window.size_mm,
    })
}

impl Judgement {
    /// Fails if the error exceeds a limit that the user set.
    pub(crate) fn demand(&self, limit: Option<f64>) -> Result<(), Failure> {
        let Some(verdict) = &self.verdict else { return Ok(()) };
        Failure::unless_within(limit, verdict.metrics.rel_rms, "the caustic's", "")
    }

    /// The judgement for programs.
    pub(crate) fn to_json(&self) -> json::Judgement {
        let pixel_mm = self.window_mm.x / self.caustic.nx as f64;
        json::Judgement {
            pixels: [self.caustic.nx, self.caustic.ny],
            picture: self
                .verdict
                .as_ref()
                .map(|verdict| json::Picture::of(&verdict.metrics, pixel_mm, verdict.photons.rel_rms())),
            photons: self.photon_count,
            photons_differ: json::finite(self.between.rel_rms()),
            photons_differ_error: json::finite(self.between.rel_rms_error()),
            light: (&self.flux).into(),
        }
    }

    /// Prints the judgement for people.
    pub(crate) fn print(&self) {
        let (nx, ny) = (self.caustic.nx, self.caustic.ny);
        let millions = self.photon_count as f64 / 1e6;
        if let Some(Verdict { metrics: m, photons }) = &self.verdict {
            say!("\nDoes the light draw the picture? (traced through the file as read back, {nx} x {ny} pixels)");
            say!("  relative RMS   {:.4}", m.rel_rms);
            say!("  PSNR           {:.1} dB", m.psnr_db);
            say!("  SSIM           {:.4}", m.ssim);
            let [edge, edge_wanted] = m.edge_width_mm(self.window_mm.x / nx as f64);
            if edge_wanted.is_finite() {
                say!("  edge width     {edge:.3} mm, {edge_wanted:.3} mm in the picture (10 % to 90 %)");
            }
            say!("  black level    {:.4} of the mean, {:.4} in the picture", m.black_level, m.target_black_level);
            say!("  contrast       {:.1}, {:.1} in the picture", m.contrast, m.target_contrast);
            // The photons' estimate is free of their own noise in the mean, and may be off by a few standard errors.
            let off = (photons.mean_square - m.rel_rms * m.rel_rms) / photons.mean_square_error;
            let verdict = if off.abs() < 5.0 { "confirm it" } else { "DISAGREE" };
            say!("  photons        {millions:.1} million {verdict}: off by {:.1} standard errors", off.abs());
        } else {
            say!("\nWhere does the light go? ({nx} x {ny} pixels)");
            say!(
                "  photons        {millions:.1} million, image {:.4} +- {:.4} relative RMS from that of the beams",
                self.between.rel_rms(),
                self.between.rel_rms_error()
            );
        }
        print_flux(&self.flux);
    }
}

/// Prints where the light went, and how much outside of the window.
pub(crate) fn print_flux(flux: &Flux) {
    say!("  light          {:.3} % in the window, {:.3} % beside it", 100.0 * flux.window, 100.0 * flux.missed);
    for (part, fate) in [
        (flux.totally_reflected, "is totally reflected inside"),
        (flux.side, "ends at a side wall or meets the solid again"),
        (flux.reflected, "is partially reflected"),
        (flux.beside, "passes beside the solid"),
        (flux.lost, "was LOST by the tracer"),
    ] {
        if part > 0.0 {
            say!("                 {:.3} % {fate}", 100.0 * part);
        }
    }
}

/// A field in the frame's order as the verifier's image, in the picture's.
pub(crate) fn image_of(cells: &Field<f64>) -> Image {
    let picture = to_picture_order(cells);
    Image::new(picture.nx(), picture.ny(), picture.into_vec())
}

/// The verifier's image as a field in the picture's order, mean 1.
pub(crate) fn field_of(image: &Image) -> Field<f64> {
    let mean = image.mean();
    Field::from_vec(image.nx, image.ny, image.values.iter().map(|v| v / mean).collect())
}
