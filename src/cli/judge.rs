//! Opens an exported file and judges the light that comes through it.

use super::{diagnosis, error::Failure, side_file::BenchRecord};
use glam::DVec2;
use glasswarp::{
    grid::Field,
    target::{TargetIrradiance, to_picture_order},
};
use glasswarp_verify::{
    Block, BlockError, Flux, Geometry, Image, Mesh, NoisyError, PhotonPlan, Scene, SceneError, Surface, Tracer,
    Traversal, Window, beams,
    load::{self, LoadError},
    metrics::{self, Metrics},
    photons,
};
use std::path::Path;

/// How to look.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Look {
    /// Pixels across, at most; the picture is averaged down to them.
    pub(crate) pixels: usize,
    /// Photons that confirm the beams.
    pub(crate) photons: u64,
    /// Seed of the photons.
    pub(crate) seed: u64,
}

impl Default for Look {
    fn default() -> Self {
        Self { pixels: 1024, photons: 4_000_000, seed: 1 }
    }
}

/// What was found.
pub(crate) struct Judgement {
    /// Irradiance on the receiver, by beams through the spline of the true surface.
    pub(crate) caustic: Image,
    /// What was wanted there.
    pub(crate) target: Image,
    /// The error of `caustic`.
    pub(crate) metrics: Metrics,
    /// The same light under other views of the surface: what is being neglected, and the error it makes.
    pub(crate) views: Vec<(&'static str, Metrics)>,
    /// Where the light went.
    pub(crate) flux: Flux,
    /// The photons' own opinion of the relative RMS error, less their noise.
    pub(crate) photons: NoisyError,
    /// Number of photons.
    pub(crate) photon_count: u64,
    /// What may be wrong with the block.
    pub(crate) suspicions: Vec<String>,
}

/// Beams per pixel along each side; twice as many change the relative RMS error by less than 3e-4.
const BEAMS_PER_PIXEL: usize = 4;

/// Traces light through the block in `path` on the bench, and compares it with the target.
pub(crate) fn judge(
    path: &Path,
    bench: &BenchRecord,
    target: &TargetIrradiance,
    look: Look,
) -> Result<Judgement, Failure> {
    let (_, block) = open_block(path)?;
    let cells = target.cells();
    let nx = cells.nx().min(look.pixels).max(8);
    let ny = ((nx * cells.ny()) as f64 / cells.nx() as f64).round().max(8.0) as usize;
    let wanted = image_of(target.resampled(nx, ny).cells());
    let window =
        Window { size_mm: DVec2::new(bench.window_width_mm, bench.window_height_mm), centre_mm: DVec2::ZERO, nx, ny };
    let scene = Scene::new(bench.ior, bench.distance_mm, window);
    let tracer = |surface, geometry| {
        let scene = Scene { surface, geometry, traversal: Traversal::Grid, ..scene };
        Tracer::for_block(&block, &scene).map_err(refused_scene)
    };
    let look_through = |tracer: &Tracer| {
        let seen = beams(tracer, nx * BEAMS_PER_PIXEL, ny * BEAMS_PER_PIXEL);
        let metrics = metrics::compare(&seen.image, &wanted).map_err(Failure::refused)?;
        Ok::<_, Failure>((seen, metrics))
    };
    let true_surface = tracer(Surface::Spline, Geometry::Displaced)?;
    let (seen, metrics) = look_through(&true_surface)?;
    let mut suspicions = diagnosis::of_dimensions(&block, bench);
    suspicions.extend(diagnosis::of_picture(&block, &scene, target, &seen.image, &wanted, metrics.rel_rms)?);
    let mut views = Vec::new();
    for (name, surface, geometry) in [
        ("normal-mapped plane (the paper's assumption)", Surface::Spline, Geometry::NormalMappedPlane),
        ("mesh with smooth normals (renderers)", Surface::Smooth, Geometry::Displaced),
        ("mesh with flat facets (the file to the letter)", Surface::Facets, Geometry::Displaced),
    ] {
        views.push((name, look_through(&tracer(surface, geometry)?)?.1));
    }
    // The photons find their way through the hierarchy, which shares nothing with the lattice of the beams.
    let by_hierarchy = Tracer::for_block(&block, &scene).map_err(refused_scene)?;
    let tally = photons(&by_hierarchy, &PhotonPlan::new(look.photons, look.seed)).map_err(Failure::refused)?;
    Ok(Judgement {
        caustic: seen.image,
        metrics,
        views,
        flux: tally.flux(),
        photons: tally.error_against(&wanted).map_err(Failure::refused)?,
        photon_count: tally.photons(),
        target: wanted,
        suspicions,
    })
}

impl Judgement {
    /// Fails if the error exceeds a limit that the user set.
    pub(crate) fn demand(&self, limit: Option<f64>) -> Result<(), Failure> {
        match limit {
            Some(limit) if self.metrics.rel_rms.is_nan() || self.metrics.rel_rms > limit => {
                Err(Failure::FellShort(format!(
                    "the caustic's relative RMS error is {:.4}, above the limit of {limit} (--max-error)",
                    self.metrics.rel_rms
                )))
            }
            _ => Ok(()),
        }
    }

    /// Prints the judgement for people.
    pub(crate) fn print(&self) {
        let m = &self.metrics;
        println!(
            "\nDoes the light draw the picture? (traced through the file as read back, {} x {} pixels)",
            self.caustic.nx, self.caustic.ny
        );
        println!("  relative RMS   {:.4}", m.rel_rms);
        println!("  PSNR           {:.1} dB", m.psnr_db);
        println!("  SSIM           {:.4}", m.ssim);
        // The photons' estimate is free of their own noise in the mean, and may be off by a few standard errors.
        let off = (self.photons.mean_square - m.rel_rms * m.rel_rms) / self.photons.mean_square_error;
        let verdict = if off.abs() < 5.0 { "confirm it" } else { "DISAGREE" };
        println!(
            "  photons        {:.1} million {verdict}: off by {:.1} standard errors",
            self.photon_count as f64 / 1e6,
            off.abs()
        );
        println!(
            "  light          {:.3} % in the picture, {:.3} % beside it",
            100.0 * self.flux.window,
            100.0 * self.flux.missed
        );
        let gone = self.flux.totally_reflected + self.flux.side + self.flux.lost;
        if gone > 0.0 {
            println!("                 {:.3} % never arrives: totally reflected or caught inside", 100.0 * gone);
        }
        println!("\nThe same block seen otherwise                     relative RMS     SSIM");
        println!("  {:<46} {:>12.4} {:>8.4}", "the smooth surface through the vertices", m.rel_rms, m.ssim);
        for (name, view) in &self.views {
            println!("  {name:<46} {:>12.4} {:>8.4}", view.rel_rms, view.ssim);
        }
    }
}

/// Reads a mesh and recognises the block in it.
pub(crate) fn open_block(path: &Path) -> Result<(Mesh, Block), Failure> {
    let mesh = load::read(path).map_err(|error| not_read(path, error))?;
    let block = Block::from_mesh(&mesh).map_err(|error| not_a_block(path, error))?;
    Ok((mesh, block))
}

/// A field in the frame's order as the verifier's image, in the picture's.
pub(crate) fn image_of(cells: &Field<f64>) -> Image {
    let picture = to_picture_order(cells);
    Image::new(picture.nx(), picture.ny(), picture.into_vec())
}

/// The verifier's image as a field in the picture's order.
pub(crate) fn field_of(image: &Image) -> Field<f64> {
    Field::from_vec(image.nx, image.ny, image.values.clone())
}

fn not_read(path: &Path, error: LoadError) -> Failure {
    let what = format!("{} is no readable mesh", path.display());
    match error {
        LoadError::Read { .. } => Failure::Io { what, source: error.into() },
        _ => Failure::InvalidMesh { what, source: Some(error.into()) },
    }
}

fn not_a_block(path: &Path, error: BlockError) -> Failure {
    Failure::InvalidMesh { what: format!("{} is no block of glass", path.display()), source: Some(error.into()) }
}

fn refused_scene(error: SceneError) -> Failure {
    Failure::refused(error)
}
