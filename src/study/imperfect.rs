//! A block in the light that there is, which is not perfect.

use super::{
    judge::{self, Examiner, Subject},
    requirements::open_speck,
    target_light::TargetLight,
};
use crate::{
    failure::Failure,
    grid::Extent,
    irradiance::{Psf, to_picture_order},
    record::document,
    spec::{Host, Roughness, Settings, SourceName, SpeckFile},
};
use glam::DVec2;
use glasswarp_verify::{
    Geometry, Image, PhotonPlan, Scene, SourceExtent, UnbiasedError, metrics, metrics::Metrics, photons,
};

/// The spread of a source for the verifier.
fn spread_of(source: SourceName) -> SourceExtent {
    match source {
        SourceName::Angle(angle) => SourceExtent::AngularDisc { radius: 0.5 * angle.radians() },
        SourceName::Disc(diameter) => SourceExtent::SourceDisc { radius_mm: 0.5 * diameter.mm },
        SourceName::Rectangle(width, height) => {
            SourceExtent::SourceRectangle { size_mm: DVec2::new(width.mm, height.mm) }
        }
    }
}

/// Pixels across at which a picture in spread light is looked at, at most: finer ones are noise.
const PIXELS: usize = 256;

/// The picture of a block in the light that there is.
pub struct ImperfectView {
    /// Irradiance on the receiver.
    pub image: Image,
    /// What it is compared with.
    pub target: Image,
    /// How well it draws the picture, noise included.
    pub metrics: Metrics,
    /// Without the noise of the photons; none if there are none.
    pub error: Option<UnbiasedError>,
    /// Of the image, in means.
    pub noise: f64,
    /// Photons traced.
    pub photons: u64,
}

impl ImperfectView {
    /// Looks at a subject in spread light: by photons, from a source with a size and through a
    /// rough face. A measured speck cannot be traced; the light is spread by it afterwards.
    ///
    /// `scene` is the bench in perfect light.
    pub fn of(
        subject: &Subject,
        scene: &Scene,
        target: &TargetLight,
        settings: &Settings,
        plan: &PhotonPlan,
        host: &dyn Host,
    ) -> Result<Option<Self>, Failure> {
        if !settings.has_spread() {
            return Ok(None);
        }
        let perfect = Examiner::new(scene.clone(), Some(&target.picture), PIXELS);
        let Some(target) = perfect.target().cloned() else { return Ok(None) };
        let (image, error, noise, count) = if settings.source_size.is_some() || settings.roughness.is_some() {
            let scene = spread(perfect.scene_for(subject), settings);
            let tally = photons(&subject.tracer(&scene)?, plan).map_err(Failure::refused)?;
            let error = tally.error_against(&target).map_err(Failure::refused)?;
            (tally.image(), Some(error), tally.noise(), tally.photons())
        } else {
            let surface = perfect.scene_for(subject).surface;
            (perfect.trace(subject, surface, Geometry::Displaced)?.image, None, 0.0, 0)
        };
        let (image, error) = match &settings.psf {
            Some(speck) => (spread_by(&image, speck, scene, host)?, None),
            None => (image, error),
        };
        let metrics = metrics::compare(&image, &target).map_err(Failure::refused)?;
        Ok(Some(Self { image, target, metrics, error, noise, photons: count }))
    }

    /// The relative RMS error, without the noise of photons where that is known.
    pub fn rel_rms(&self) -> f64 {
        self.error.map_or(self.metrics.rel_rms, |error| error.rel_rms())
    }

    /// The same for programs.
    pub fn document(&self) -> document::Imperfect {
        document::Imperfect {
            rel_rms: document::finite(self.rel_rms()),
            rel_rms_error: self.error.and_then(|error| document::finite(error.rel_rms_error())),
            ssim: document::finite(self.metrics.ssim),
            photons: self.photons,
        }
    }
}

/// A bench with the light and the face that there are, as photons see them.
pub fn spread(scene: Scene, settings: &Settings) -> Scene {
    Scene {
        spread: settings.source_size.map_or(SourceExtent::None, spread_of),
        roughness: settings.roughness.map_or(0.0, Roughness::slope),
        ..scene
    }
}

/// An image spread by a measured speck.
fn spread_by(image: &Image, speck: &SpeckFile, scene: &Scene, host: &dyn Host) -> Result<Image, Failure> {
    let field = judge::field_of(image);
    let window = Extent::new(scene.window.size_mm.x, scene.window.size_mm.y);
    let psf = Psf::of_picture(open_speck(speck, host)?, window, (field.nx(), field.ny())).map_err(Failure::refused)?;
    Ok(judge::image_of(&psf.blurred(&to_picture_order(&field))))
}
