//! A block in the light that there is, which is not perfect.

use super::{
    judge::{self, Examiner, Subject},
    requirements::open_speck,
    target_light::TargetLight,
};
use crate::{
    bench::Bench,
    failure::Failure,
    grid::Extent,
    irradiance::{Psf, SourceSize, to_picture_order},
    light::Light,
    record::document,
    spec::{Host, Roughness, Settings, SpeckFile},
};
use glam::DVec2;
use glasswarp_verify::{
    Geometry, Image, PhotonPlan, Scene, SourceExtent, UnbiasedError, metrics, metrics::Likeness, photons,
};

/// The spread of a source for the verifier.
fn spread_of(source: SourceSize) -> SourceExtent {
    match source {
        SourceSize::Angle { diameter } => SourceExtent::AngularDisc { radius: 0.5 * diameter },
        SourceSize::Disc { diameter_mm } => SourceExtent::SourceDisc { radius_mm: 0.5 * diameter_mm },
        SourceSize::Rectangle { width_mm, height_mm } => {
            SourceExtent::SourceRectangle { size_mm: DVec2::new(width_mm, height_mm) }
        }
    }
}

/// The part of the picture's width that a smallest detail may have, and that is spoken of.
const FINE_DETAIL: f64 = 0.01;
/// A part of the picture's width that nobody would miss.
const UNSEEN_DETAIL: f64 = 0.003;

/// What is lost if parallel light whose size nothing is said of is the sun's: the smallest detail.
pub(super) fn if_it_is_the_sun(bench: &Bench, settings: &Settings) -> Option<String> {
    if settings.source_size.is_some() || settings.psf.is_some() || !matches!(bench.light(), Light::Parallel { .. }) {
        return None;
    }
    // A bench that is never lit says so elsewhere.
    let spot_mm = SourceSize::SUN.spot_mm(bench).ok()?;
    let window_mm = bench.window().as_vec();
    let share = (spot_mm / window_mm).max_element();
    let says = |size: f64| format!("{size:.2}").trim_end_matches('0').trim_end_matches('.').to_owned();
    (share > UNSEEN_DETAIL).then(|| {
        format!(
            "nothing is said of the size of the light: if it is the sun, 0.53 degrees wide, no detail below {} mm is left of the picture, which is {} x {} mm: {:.1} % of it, and {} % at `distance` {:.0}mm; design for the sun with `source-size` sun, or say `source-size` none for a laser",
            says(spot_mm.max_element()),
            says(window_mm.x),
            says(window_mm.y),
            100.0 * share,
            100.0 * FINE_DETAIL,
            // The disc grows as its way does.
            bench.distance_mm() * FINE_DETAIL / share
        )
    })
}

/// What spreads the light, in words.
pub fn spread_in_words(settings: &Settings) -> String {
    let parts = [
        settings.source_size.filter(|source| source.size().is_some()).map(|source| format!("source of {source}")),
        settings.roughness.map(|roughness| format!("roughness of {}", roughness.0)),
        settings.psf.as_ref().map(|speck| format!("spread as {}", speck.path.display())),
    ];
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// Pixels across at which a picture in spread light is looked at, at most: finer ones are noise.
const PIXELS: usize = 256;

/// The picture of a block in the light that there is.
pub struct ImperfectView {
    /// Irradiance on the receiver.
    pub image: Image,
    /// What it is compared with.
    pub target: Image,
    /// How well it draws the picture, without the noise of the photons.
    pub likeness: Likeness,
    /// What the photons know of their own error; none if there are none.
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
        let (image, likeness, error, noise, count) = if settings.spread_source().is_some() || settings.roughness.is_some() {
            let scene = spread(perfect.scene_for(subject), settings);
            let tally = photons(&subject.tracer(&scene)?, plan).map_err(Failure::refused)?;
            let error = tally.error_against(&target).map_err(Failure::refused)?;
            let likeness = tally.likeness_to(&target).map_err(Failure::refused)?;
            (tally.image(), Some(likeness), Some(error), tally.noise(), tally.photons())
        } else {
            let surface = perfect.scene_for(subject).surface;
            (perfect.trace(subject, surface, Geometry::Displaced)?.image, None, None, 0.0, 0)
        };
        // A speck spreads the noise too, as far as it reaches.
        let (image, likeness, error) = match &settings.psf {
            Some(speck) => (spread_by(&image, speck, scene, host)?, None, None),
            None => (image, likeness, error),
        };
        let likeness = likeness.map_or_else(|| metrics::likeness(&image, &target).map_err(Failure::refused), Ok)?;
        Ok(Some(Self { image, target, likeness, error, noise, photons: count }))
    }

    /// The same for programs.
    pub fn document(&self) -> document::Imperfect {
        document::Imperfect {
            rel_rms: document::finite(self.likeness.rel_rms),
            rel_rms_error: self.error.and_then(|error| document::finite(error.rel_rms_error())),
            ssim: document::finite(self.likeness.ssim),
            photons: self.photons,
        }
    }
}

/// A bench with the light and the face that there are, as photons see them.
pub fn spread(scene: Scene, settings: &Settings) -> Scene {
    Scene {
        spread: settings.spread_source().map_or(SourceExtent::None, spread_of),
        roughness: settings.roughness.map_or(0.0, Roughness::slope),
        ..scene
    }
}

/// An image spread by a measured speck.
fn spread_by(image: &Image, speck: &SpeckFile, scene: &Scene, host: &dyn Host) -> Result<Image, Failure> {
    let window = Extent::new(scene.window.size_mm.x, scene.window.size_mm.y);
    let psf = Psf::of_picture(open_speck(speck, host)?, window, (image.nx, image.ny)).map_err(Failure::refused)?;
    Ok(blurred(image, &psf))
}

/// An image spread by what spreads the light, at its own pixels.
pub(super) fn blurred(image: &Image, psf: &Psf) -> Image {
    judge::image_of(&psf.blurred(&to_picture_order(&judge::field_of(image))))
}
