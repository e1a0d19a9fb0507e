//! A block that is put before renderers, and the comparison with what they find.

use super::{
    camera::Camera,
    error::CrosscheckError,
    image::ImageAgreement,
    job::Job,
    map::{Landings, MapAgreement},
    povray,
    renderer::Renderer,
    scripted::Script,
    shaded::ShadedMesh,
};
use crate::{
    block::Block,
    estimate::{MOST_BEAMS, beams},
    image::Image,
    mesh::Mesh,
    scene::{Emission, Fresnel, Geometry, Light, Optics, Scene, SceneError, Surface},
    trace::{End, Tracer},
};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::path::Path;

/// A block on a bench, ready to be shown to renderers.
#[derive(Clone, Debug)]
pub struct Comparison<'a> {
    mesh: &'a Mesh,
    block: &'a Block,
    scene: Scene,
}

/// Beams per pixel along each side in the verifier's own image: its error is far below that of any
/// renderer.
const BEAMS_PER_PIXEL: usize = 8;

impl<'a> Comparison<'a> {
    /// A block, the mesh in which it was recognised, and the bench. Surface, geometry and Fresnel's
    /// losses are chosen by each comparison; image mode takes the scene's window.
    ///
    /// # Errors
    /// A turned block, an entry face that is not planar, or a bench that cannot be.
    pub fn new(mesh: &'a Mesh, block: &'a Block, scene: &Scene) -> Result<Self, SceneError> {
        if block.entry_heights_mm().is_some() {
            return Err(SceneError::Needs("renderers are shown blocks with a planar entry face only"));
        }
        if scene.turned != DVec3::ZERO {
            return Err(SceneError::Needs(
                "renderers are shown blocks that are not turned: turn the light and the receiver",
            ));
        }
        let scene = Scene { geometry: Geometry::Displaced, ..scene.clone() };
        Tracer::for_block(block, &scene)?;
        Ok(Self { mesh, block, scene })
    }

    fn tracer(&self, surface: Surface, fresnel: Fresnel) -> Result<Tracer, SceneError> {
        Tracer::for_block(self.block, &Scene { surface, fresnel, ..self.scene.clone() })
    }

    /// The verifier's landing points of rays through the centres of `nx * ny` pixels that hold the
    /// block's plan, as a camera sees it which looks along the light: row 0 at the greatest y;
    /// column 0 at the greatest x of glass, at the least x of a mirror.
    ///
    /// # Errors
    /// See [`Tracer::for_block`].
    pub fn landings(&self, nx: usize, ny: usize) -> Result<Landings, SceneError> {
        let camera = Camera::of(self.block, &self.scene);
        let trace = |surface| {
            let tracer = self.tracer(surface, Fresnel::Off)?;
            let end = |k: usize| tracer.path(camera.start(k % nx, k / nx, (nx, ny))).end;
            Ok((0..nx * ny).into_par_iter().map(end).collect::<Vec<_>>())
        };
        let landed = |ends: &[End]| -> Vec<Option<DVec2>> {
            let land = |end: &End| if let End::Receiver(at) = end { Some(*at) } else { None };
            ends.iter().map(land).collect()
        };
        let (smooth, spline) = (trace(Surface::Smooth)?, trace(Surface::Spline)?);
        // Past the exit face, in oblique or spreading light, renderers follow rays through walls
        // and past the block.
        let aimed = smooth.iter().map(|end| !matches!(end, End::Side | End::Beside)).collect();
        Ok(Landings { nx, ny, smooth: landed(&smooth), spline: landed(&spline), aimed })
    }

    /// The verifier's own image for comparison with this renderer.
    ///
    /// # Errors
    /// See [`Tracer::for_block`].
    pub fn image(&self, renderer: Renderer) -> Result<Image, SceneError> {
        let tracer = self.tracer(Surface::Smooth, renderer.fresnel())?;
        let window = &self.scene.window;
        window.holds_at_most(MOST_BEAMS / (BEAMS_PER_PIXEL * BEAMS_PER_PIXEL))?;
        // Beams as wide as the window's pixels over BEAMS_PER_PIXEL, were the block as large as the
        // window.
        Ok(beams(&tracer, window.nx * BEAMS_PER_PIXEL, window.ny * BEAMS_PER_PIXEL).image)
    }

    /// Writes the scene of map mode into `folder`, which is made if it is missing.
    ///
    /// # Errors
    /// Whatever the file system refuses, and a block none of whose light arrives.
    pub fn write_map(&self, renderer: Renderer, folder: &Path, ours: &Landings) -> Result<Job, CrosscheckError> {
        let (from, to) = ours.range_mm().ok_or(CrosscheckError::Dark)?;
        let margin = DVec2::splat(1.0).max(0.02 * (to - from));
        let landed = [from - margin, to + margin];
        let shaded = ShadedMesh::new(self.mesh, self.block);
        let job = match Script::of(renderer) {
            None => povray::map(folder, landed, (ours.nx, ours.ny)),
            Some(script) => script.map(renderer, folder, landed, (ours.nx, ours.ny))?,
        };
        self.write(&job, &shaded)?;
        Ok(job)
    }

    /// Writes the scene of image mode into `folder`; `ours` is [`Comparison::image`].
    ///
    /// # Errors
    /// Whatever the file system refuses, and a bench that renderers' own light is not set up for.
    pub fn write_image(&self, renderer: Renderer, folder: &Path, ours: &Image) -> Result<Job, CrosscheckError> {
        self.check_image(renderer)?;
        let shaded = ShadedMesh::new(self.mesh, self.block);
        let job = match Script::of(renderer) {
            None => {
                let peak = ours.values.iter().copied().fold(0.0, f64::max);
                if peak <= 0.0 {
                    return Err(CrosscheckError::Dark);
                }
                povray::image(folder, peak, self.block.size_mm(), (ours.nx, ours.ny))
            }
            Some(script) => script.image(renderer, folder, (ours.nx, ours.ny)),
        };
        self.write(&job, &shaded)?;
        Ok(job)
    }

    /// Refuses benches of which a renderer would draw another caustic.
    fn check_image(&self, renderer: Renderer) -> Result<(), SceneError> {
        let Scene { optics, light, profile, receiver_turned, .. } = &self.scene;
        let even = match light {
            Light::Parallel { .. } => true,
            Light::Point { emission, .. } => *emission == Emission::Isotropic,
        };
        let own = matches!(renderer, Renderer::PovRay | Renderer::Blender);
        Err(SceneError::Needs(if *optics == Optics::Reflects {
            "image mode is for glass, and this block is a mirror: look at the map (--mode map)"
        } else if *receiver_turned != DVec3::ZERO {
            "image mode is for a receiver across the axis, and this one leans: look at the map (--mode map)"
        } else if profile.is_some() || !even {
            "image mode is for parallel light and for sources that shine the same in all directions: look at the map (--mode map)"
        } else if !own && !self.scene.is_straight() {
            "image mode of Mitsuba and LuxCore is for light straight along +z: take POV-Ray or Blender, or look at the map (--mode map)"
        } else {
            return Ok(());
        }))
    }

    fn write(&self, job: &Job, shaded: &ShadedMesh) -> Result<(), CrosscheckError> {
        job.make_folder()?;
        match Script::of(job.renderer) {
            None => povray::write(job, self.block, &self.scene, shaded)?,
            Some(script) => script.write(job, self.block, &self.scene, shaded)?,
        }
        job.write_readme()
    }

    /// Reads the map that a finished job has rendered, and compares it with the verifier's.
    ///
    /// # Errors
    /// A picture that cannot be read, or has another size.
    pub fn compare_map(&self, job: &Job, ours: &Landings) -> Result<MapAgreement, CrosscheckError> {
        MapAgreement::between(ours, &job.read_landings(ours.nx, ours.ny)?).ok_or(CrosscheckError::Dark)
    }

    /// Reads the two caustics that a finished job has rendered, and compares them with the
    /// verifier's. Also gives their mean, normalised as `ours` is.
    ///
    /// # Errors
    /// Pictures that cannot be read, have another size, are dark, or clipped.
    pub fn compare_image(&self, job: &Job, ours: &Image) -> Result<(ImageAgreement, Image), CrosscheckError> {
        let runs = job.read_images(ours.nx, ours.ny)?;
        ImageAgreement::between(ours, &runs).ok_or(CrosscheckError::Dark)
    }
}
