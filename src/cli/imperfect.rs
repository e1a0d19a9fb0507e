//! Light that is not perfect, and caustic meshes: what they are on the command line, what the picture becomes for them, and what is
//! seen of it.

use super::{
    angle::Angle,
    bench::bench_of,
    console::say,
    error::Failure,
    json,
    judge::{self, Examiner, Subject},
    length::Length,
    progress::TerminalProgress,
    quantity::read_as_text,
    reference::Wanted,
    settings::{Settings, SolverName, name_of},
    side_file::SideFile,
};
use clap::ValueEnum;
use glam::DVec2;
use glasswarp::{
    bench::Bench,
    grid::Extent,
    irradiance::{
        Border, CausticMesh, Deconvolution, Deconvolved, Ending, ImperfectLight, Picture, Psf, PsfPicture, SourceSize,
        TargetIrradiance, Transfer, to_picture_order,
    },
    solver::Progress,
};
use glasswarp_verify::{
    Geometry, Image, PhotonPlan, Scene, SourceExtent, UnbiasedError, metrics, metrics::Metrics, photons,
};
use serde::Deserialize;
use std::{fmt, path::PathBuf, str::FromStr, sync::Arc};

read_as_text!(SourceName, Roughness, SpeckFile);

/// The size of the source: `sun`, `0.53deg`, `5mm` or `5x3mm`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum SourceName {
    /// A disc far away, by its angular diameter.
    Angle(Angle),
    /// A disc, by its diameter.
    Disc(Length),
    /// A rectangle: along x, and along y.
    Rectangle(Length, Length),
}

impl FromStr for SourceName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        if text == "sun" {
            return Ok(Self::Angle(Angle { deg: 0.53 }));
        }
        if let Some((width, height)) = text.split_once('x') {
            // 5x3mm: the unit stands once.
            let unit = height.trim_start_matches(|c: char| !c.is_alphabetic() && c != '"');
            let has_unit = width.contains(|c: char| c.is_alphabetic() || c == '"');
            let width = if has_unit { width.to_owned() } else { format!("{width}{unit}") };
            return Ok(Self::Rectangle(width.parse()?, height.parse()?));
        }
        if text.parse::<f64>().is_ok() {
            return Err(format!("'{text}' lacks its unit; write sun, 0.53deg, 5mm or 5x3mm"));
        }
        text.parse().map(Self::Disc).or_else(|_| text.parse().map(Self::Angle)).map_err(|_: String| {
            format!(
                "'{text}' is no size of a source; write sun, 0.53deg (parallel light), 5mm or 5x3mm (a point source)"
            )
        })
    }
}

impl fmt::Display for SourceName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Angle(angle) => write!(f, "{angle}"),
            Self::Disc(diameter) => write!(f, "{}mm", diameter.mm),
            Self::Rectangle(width, height) => write!(f, "{}x{}mm", width.mm, height.mm),
        }
    }
}

impl From<SourceName> for SourceSize {
    fn from(name: SourceName) -> Self {
        match name {
            SourceName::Angle(angle) => Self::Angle { diameter: angle.radians() },
            SourceName::Disc(diameter) => Self::Disc { diameter_mm: diameter.mm },
            SourceName::Rectangle(width, height) => Self::Rectangle { width_mm: width.mm, height_mm: height.mm },
        }
    }
}

impl From<SourceName> for SourceExtent {
    fn from(name: SourceName) -> Self {
        match name {
            SourceName::Angle(angle) => Self::AngularDisc { radius: 0.5 * angle.radians() },
            SourceName::Disc(diameter) => Self::SourceDisc { radius_mm: 0.5 * diameter.mm },
            SourceName::Rectangle(width, height) => Self::SourceRectangle { size_mm: DVec2::new(width.mm, height.mm) },
        }
    }
}

/// How rough the face is: the angle whose tangent is the standard deviation of its slope along any one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Roughness(pub(crate) Angle);

impl Roughness {
    fn slope(self) -> f64 {
        self.0.radians().tan()
    }
}

impl FromStr for Roughness {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        text.parse().map(Self)
    }
}

/// A picture of a speck of light, and the size of its pixels: `speck.png,0.05mm`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SpeckFile {
    pub(crate) path: PathBuf,
    pub(crate) pixel: Length,
}

impl FromStr for SpeckFile {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (path, pixel) = text
            .rsplit_once(',')
            .ok_or_else(|| format!("'{text}' lacks the size of a pixel on the receiver; write speck.png,0.05mm"))?;
        Ok(Self { path: path.into(), pixel: pixel.parse()? })
    }
}

impl SpeckFile {
    fn open(&self) -> Result<PsfPicture, Failure> {
        let picture = Picture::open(&self.path, Some(Transfer::Linear)).map_err(|error| Failure::Io {
            what: format!("{} is no picture of a speck of light", self.path.display()),
            source: error.into(),
        })?;
        PsfPicture::new(&to_picture_order(picture.values()), self.pixel.mm).map_err(Failure::refused)
    }
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum DeconvolutionName {
    /// Make up for the spread of the light; beyond the window there is none, so that its brim is made brighter
    #[default]
    Window,
    /// As the paper does: the picture is continued and bevelled beyond its border, whose light then fades
    Paper,
    /// Design for perfect light, and judge in what is there
    Off,
}

/// What is known of the light.
fn imperfect_light(settings: &Settings) -> Result<ImperfectLight, Failure> {
    Ok(ImperfectLight {
        source: settings.source_size.map(SourceSize::from),
        roughness: settings.roughness.map(Roughness::slope),
        psf: settings.psf.as_ref().map(SpeckFile::open).transpose()?,
    })
}

/// The mesh on the receiver, if there is one.
fn caustic_mesh(settings: &Settings, bench: &Bench) -> Result<Option<Arc<CausticMesh>>, Failure> {
    let Some(path) = &settings.caustic_mesh else { return Ok(None) };
    let solver = settings.solver.unwrap_or_default();
    if solver == SolverName::Transport {
        return Err(Failure::Usage(format!(
            "the {} solver has no mesh: it finds by itself which point of the block lights which point of the window; --caustic-mesh fixes that, and needs --solver warping or warping-paper",
            name_of(solver)
        )));
    }
    let mesh = CausticMesh::open(path).map_err(Failure::refused)?;
    mesh.check(bench).map_err(Failure::refused)?;
    Ok(Some(Arc::new(mesh)))
}

/// What the light of a block shall be.
pub(crate) struct Intent {
    /// The picture, to be seen in the light that there is.
    pub(crate) wanted: TargetIrradiance,
    /// The light to be drawn if light were perfect: `wanted` made up for the spread.
    pub(crate) target: TargetIrradiance,
    /// What the solver is given: `target`, and with a mesh what lies beside it too.
    pub(crate) aim: TargetIrradiance,
    pub(crate) mesh: Option<Arc<CausticMesh>>,
    /// The spread of the light, if it is not perfect.
    pub(crate) psf: Option<Psf>,
    /// How far the spread can be made up for, unless that was not asked for.
    pub(crate) deconvolved: Option<Deconvolved>,
}

impl Intent {
    /// What settings make of a picture on a bench.
    pub(crate) fn of(picture: TargetIrradiance, bench: &Bench, settings: &Settings) -> Result<Self, Failure> {
        let light = imperfect_light(settings)?;
        let mesh = caustic_mesh(settings, bench)?;
        let cells = (picture.cells().nx(), picture.cells().ny());
        let psf = if light.is_perfect() { None } else { Some(light.psf(bench, cells).map_err(Failure::refused)?) };
        let border = match settings.deconvolution.unwrap_or_default() {
            DeconvolutionName::Window => Some(Border::Dark),
            DeconvolutionName::Paper => Some(Border::Continued),
            DeconvolutionName::Off => None,
        };
        if psf.is_none() && (settings.deconvolution.is_some() || settings.deconvolution_rounds.is_some()) {
            return Err(Failure::Usage(
                "there is no spread of light to make up for: add --source-size, --roughness or --psf to --deconvolution".into(),
            ));
        }
        let usual = Deconvolution::default();
        let deconvolved = match (&psf, border) {
            (Some(psf), Some(border)) => {
                let rounds = settings.deconvolution_rounds.unwrap_or(usual.rounds);
                let progress = TerminalProgress::new();
                progress.begin("making up for the spread of the light", rounds);
                let options = Deconvolution { rounds, border, ..usual };
                let done = options.of_watched(&picture, psf, |done| progress.advance(done));
                progress.finish();
                Some(done.map_err(Failure::refused)?)
            }
            _ => None,
        };
        let aim = deconvolved.as_ref().map_or(&picture, |done| &done.target).clone();
        let covered = |light: &TargetIrradiance| match &mesh {
            Some(mesh) => mesh.covered(light, bench).map_err(Failure::refused),
            None => Ok(light.clone()),
        };
        Ok(Self { wanted: covered(&picture)?, target: covered(&aim)?, aim, psf, deconvolved, mesh })
    }

    /// The same for a block that has been made, by its side file, and the bench that it was made for.
    pub(crate) fn of_side(picture: TargetIrradiance, side: &SideFile) -> Result<(Self, Bench), Failure> {
        let aspect = picture.cells().ny() as f64 / picture.cells().nx() as f64;
        let bench = bench_of(&side.design, aspect, -side.bench.entry_z_mm)?;
        Ok((Self::of(picture, &bench, &side.design)?, bench))
    }

    /// Lines for people, on the spread and what is made up for.
    pub(crate) fn print(&self) {
        if let Some(psf) = &self.psf {
            let by = psf.deviation_mm();
            say!(
                "  spread         {:.3} mm along x, {:.3} mm along y (standard deviation on the receiver)",
                by.x,
                by.y
            );
        }
        if let Some(done) = &self.deconvolved {
            let ending = match done.ending {
                Ending::Agreed => "the picture is reached",
                Ending::Stalled => "more gain nothing",
                Ending::Rounds => "all that were asked for",
            };
            say!(
                "  deconvolution  {} rounds ({ending}): relative RMS {:.4} instead of {:.4} expected, {:.1} % of the light beside the window",
                done.rounds,
                done.error_after,
                done.error_before,
                100.0 * done.lost
            );
            say!(
                "                 contrast of the light to draw {:.0}, of the picture {:.0}",
                done.contrast_after,
                done.contrast_before
            );
        }
        if let Some(mesh) = &self.mesh {
            let ((nx, ny), (front, back)) = (mesh.size(), mesh.sides());
            say!(
                "  caustic mesh   {} x {} quads, {front} with their front to the block, {back} turned over",
                nx - 1,
                ny - 1
            );
        }
    }
}

/// Pixels across at which a picture in spread light is looked at, at most: finer ones are noise.
const PIXELS: usize = 256;

/// A block in the light that there is.
pub(crate) struct Seen {
    pub(crate) image: Image,
    pub(crate) wanted: Image,
    pub(crate) metrics: Metrics,
    /// Without the noise of the photons; none if there are none.
    error: Option<UnbiasedError>,
    /// Of the image, in means.
    noise: f64,
    photons: u64,
}

impl Seen {
    /// Looks at a subject in spread light: by photons, from a source with a size and through a rough face. A measured speck cannot
    /// be traced; the light is spread by it afterwards.
    ///
    /// `scene` is the bench in perfect light.
    pub(crate) fn of(
        subject: &Subject,
        scene: &Scene,
        wanted: &Wanted,
        settings: &Settings,
        plan: &PhotonPlan,
    ) -> Result<Option<Self>, Failure> {
        if !has_spread(settings) {
            return Ok(None);
        }
        let perfect = Examiner::new(scene.clone(), Some(&wanted.picture), PIXELS);
        let Some(wanted) = perfect.wanted().cloned() else { return Ok(None) };
        let (image, error, noise, count) = if settings.source_size.is_some() || settings.roughness.is_some() {
            let scene = spread(perfect.scene_for(subject), settings);
            let tally = photons(&subject.tracer(&scene)?, plan).map_err(Failure::refused)?;
            let error = tally.error_against(&wanted).map_err(Failure::refused)?;
            (tally.image(), Some(error), tally.noise(), tally.photons())
        } else {
            let surface = perfect.scene_for(subject).surface;
            (perfect.look(subject, surface, Geometry::Displaced)?.image, None, 0.0, 0)
        };
        let (image, error) = match &settings.psf {
            Some(speck) => (spread_by(&image, speck, scene)?, None),
            None => (image, error),
        };
        let metrics = metrics::compare(&image, &wanted).map_err(Failure::refused)?;
        Ok(Some(Self { image, wanted, metrics, error, noise, photons: count }))
    }

    /// The relative RMS error, without the noise of photons where that is known.
    pub(crate) fn rel_rms(&self) -> f64 {
        self.error.map_or(self.metrics.rel_rms, |error| error.rel_rms())
    }

    /// The same for programs.
    pub(crate) fn to_json(&self) -> json::Imperfect {
        json::Imperfect {
            rel_rms: json::finite(self.rel_rms()),
            rel_rms_error: self.error.and_then(|error| json::finite(error.rel_rms_error())),
            ssim: json::finite(self.metrics.ssim),
            photons: self.photons,
        }
    }

    /// Prints what is seen.
    pub(crate) fn print(&self, settings: &Settings) {
        let parts = [
            settings.source_size.map(|source| format!("source of {source}")),
            settings.roughness.map(|roughness| format!("roughness of {}", roughness.0)),
            settings.psf.as_ref().map(|speck| format!("spread as {}", speck.path.display())),
        ];
        let light = parts.into_iter().flatten().collect::<Vec<_>>().join(", ");
        say!("\nIn the light that there is ({light}; {} x {} pixels)", self.image.nx, self.image.ny);
        match self.error {
            Some(error) => say!("  relative RMS   {:.4} +- {:.4}", error.rel_rms(), error.rel_rms_error()),
            None => say!("  relative RMS   {:.4}", self.metrics.rel_rms),
        }
        say!("  SSIM           {:.4}", self.metrics.ssim);
        if self.photons > 0 {
            say!(
                "  photons        {:.1} million; their noise is {:.3} of the mean, which the SSIM suffers from",
                self.photons as f64 / 1e6,
                self.noise
            );
        }
    }

    /// Fails if the error exceeds a limit that the user set.
    pub(crate) fn demand(&self, limit: Option<f64>) -> Result<(), Failure> {
        Failure::unless_within(limit, self.rel_rms(), "the caustic's", " in the light that there is")
    }
}

/// Whether the light is spread by its source, by the face or by what a speck shows.
fn has_spread(settings: &Settings) -> bool {
    settings.source_size.is_some() || settings.roughness.is_some() || settings.psf.is_some()
}

/// A bench with the light and the face that there are, as photons see them.
pub(crate) fn spread(scene: Scene, settings: &Settings) -> Scene {
    Scene {
        spread: settings.source_size.map_or(SourceExtent::None, SourceExtent::from),
        roughness: settings.roughness.map_or(0.0, Roughness::slope),
        ..scene
    }
}

/// An image spread by a measured speck.
fn spread_by(image: &Image, speck: &SpeckFile, scene: &Scene) -> Result<Image, Failure> {
    let field = judge::field_of(image);
    let window = Extent::new(scene.window.size_mm.x, scene.window.size_mm.y);
    let psf = Psf::of_picture(speck.open()?, window, (field.nx(), field.ny())).map_err(Failure::refused)?;
    Ok(judge::image_of(&psf.blurred(&to_picture_order(&field))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_of_sources_are_read_as_they_are_written() {
        for (text, expected) in [
            ("sun", "0.53deg"),
            ("0.5deg", "0.5deg"),
            ("5mm", "5mm"),
            ("0.5cm", "5mm"),
            ("5x3mm", "5x3mm"),
            ("0.5x0.3cm", "5x3mm"),
            ("5mmx0.3cm", "5x3mm"),
        ] {
            let source: SourceName = text.parse().unwrap();
            assert_eq!(source.to_string(), expected);
            assert_eq!(source.to_string().parse::<SourceName>().unwrap(), source);
        }
        for text in ["", "5", "moon", "5x", "x3mm", "5furlongs", "5x3deg", "nan mm"] {
            assert!(text.parse::<SourceName>().is_err(), "{text} was taken");
        }
    }

    #[test]
    fn specks_need_the_size_of_their_pixels() {
        let speck: SpeckFile = "a,b.png,0.05mm".parse().unwrap();
        assert_eq!((speck.path, speck.pixel.mm), (PathBuf::from("a,b.png"), 0.05));
        assert!("speck.png".parse::<SpeckFile>().is_err());
        assert!("speck.png,wide".parse::<SpeckFile>().is_err());
    }
}
