//! A block in the light that there is, which is not perfect.

use super::{
    behind,
    bench::bench_of,
    judge::{self, Examiner, Subject},
    requirements::psf_of,
    target_light::TargetLight,
};
use crate::{
    bench::Bench,
    failure::Failure,
    grid::Extent,
    irradiance::{Psf, SourceSize, to_picture_order},
    light::Light,
    record::document,
    spec::{Host, Length, Roughness, Settings},
};
use glam::DVec2;
use glasswarp_verify::{
    Geometry, Image, Optics, PhotonPlan, Scene, SourceExtent, UnbiasedError,
    metrics::{self, Likeness},
    photons,
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
    let remedy = match settings.behind {
        None => "design for the sun with `source-size` sun, or say `source-size` none for a laser",
        Some(_) => "take a laser or a small lamp far away, and say so with `source-size` none",
    };
    (share > UNSEEN_DETAIL).then(|| {
        format!(
            "nothing is said of the size of the light: if it is the sun, 0.53 degrees wide, no detail below {} mm is left of the picture, which is {} x {} mm: {:.1} % of it, and {} % at `distance` {:.0}mm; {remedy}",
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
    /// Irradiance on the receiver: by photons, or where these cannot, by spreading that of the
    /// beams.
    pub image: Image,
    /// The same by spreading that of the beams, which is free of noise.
    pub smooth: Image,
    /// What it is compared with.
    pub target: Image,
    /// How well it draws the picture, without the noise of photons: that of the beams' light, spread
    /// on the receiver, which the photons confirm or not.
    pub likeness: Likeness,
    /// What photons from the source, through the rough face, see. None if they cannot.
    pub photons: Option<SpreadPhotons>,
}

/// What photons in spread light see.
pub struct SpreadPhotons {
    /// Photons traced.
    pub count: u64,
    /// Of their image, in means.
    pub noise: f64,
    /// Their error against the picture, less their noise.
    pub error: UnbiasedError,
    /// How far they are from the beams' light spread on the receiver, less their noise.
    pub between: UnbiasedError,
}

impl SpreadPhotons {
    /// Whether they see what spreading the beams' light on the receiver makes of it, to a hundredth or
    /// a fifth of the error, and their own noise: that takes every place of the face to throw the same
    /// disc of light.
    pub fn confirm(&self) -> bool {
        self.between.rel_rms() <= (0.2 * self.error.rel_rms()).max(0.01) + 2.0 * self.between.rel_rms_error()
    }
}

impl ImperfectView {
    /// Looks at a subject in spread light: by photons, from a source with a size and through a
    /// rough face, and by beams whose light is spread on the receiver. A measured speck cannot be
    /// traced.
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
        let surface = perfect.scene_for(subject).surface;
        let sharp = perfect.trace(subject, surface, Geometry::Displaced)?.image;
        let psf = psf_of(settings, &bench_of_scene(subject, scene, settings, host)?, perfect.pixels(), host)?;
        let beams = psf.map_or_else(|| sharp.clone(), |psf| blurred(&sharp, &psf));
        let likeness = metrics::likeness(&beams, &target).map_err(Failure::refused)?;
        if settings.psf.is_some() || (settings.spread_source().is_none() && settings.roughness.is_none()) {
            return Ok(Some(Self { image: beams.clone(), smooth: beams, target, likeness, photons: None }));
        }
        let scene = spread(perfect.scene_for(subject), settings);
        let tally = photons(&subject.tracer(&scene)?, plan).map_err(Failure::refused)?;
        let error = tally.error_against(&target).map_err(Failure::refused)?;
        let between = tally.error_against(&beams).map_err(Failure::refused)?;
        let photons = SpreadPhotons { count: tally.photons(), noise: tally.noise(), error, between };
        Ok(Some(Self { image: tally.image(), smooth: beams, target, likeness, photons: Some(photons) }))
    }

    /// How alike the picture is: by photons where they can tell, which take nothing for granted.
    pub fn likeness(&self) -> Likeness {
        let rel_rms = self.photons.as_ref().map_or(self.likeness.rel_rms, |photons| photons.error.rel_rms());
        Likeness { rel_rms, ..self.likeness }
    }

    /// The same for programs.
    pub fn document(&self) -> document::Imperfect {
        let Likeness { rel_rms, ssim } = self.likeness();
        let photons = self.photons.as_ref();
        document::Imperfect {
            rel_rms: document::finite(rel_rms),
            rel_rms_error: photons.and_then(|photons| document::finite(photons.error.rel_rms_error())),
            ssim: document::finite(ssim),
            photons: photons.map_or(0, |photons| photons.count),
            photons_differ: photons.and_then(|photons| document::finite(photons.between.rel_rms())),
        }
    }
}

/// The bench of a scene as the designer has it, for the spread of its light.
fn bench_of_scene(subject: &Subject, scene: &Scene, settings: &Settings, host: &dyn Host) -> Result<Bench, Failure> {
    let (ior, material) = match scene.optics {
        Optics::Refracts { ior } => (Some(ior), None),
        Optics::Reflects => (None, None),
    };
    let settings = Settings { distance: Some(Length { mm: scene.distance_mm }), ior, material, ..settings.clone() };
    let window = scene.window.size_mm;
    let bench = bench_of(&settings, &behind::open(&settings, host)?, window.y / window.x, -subject.entry_z_mm(), host)?;
    bench.with_window(Extent::new(window.x, window.y), scene.window.centre_mm).map_err(Failure::refused)
}

/// A bench with the light and the face that there are, as photons see them.
pub fn spread(scene: Scene, settings: &Settings) -> Scene {
    Scene {
        spread: settings.spread_source().map_or(SourceExtent::None, spread_of),
        roughness: settings.roughness.map_or(0.0, Roughness::slope),
        ..scene
    }
}

/// An image spread by what spreads the light, at its own pixels.
pub(super) fn blurred(image: &Image, psf: &Psf) -> Image {
    judge::image_of(&psf.blurred(&to_picture_order(&judge::field_of(image))))
}
