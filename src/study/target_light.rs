//! The target irradiance as the verifier reads it, which must agree with the designer's reading.

use super::{
    before::Before,
    judge::{field_of, image_of},
    requirements::{Requirements, open_target},
};
use crate::{
    bench::Bench,
    failure::Failure,
    irradiance::{self, Background, Rotation, TargetIrradiance, Vignette, to_picture_order},
    record::SideFile,
    solver::Progress,
    spec::{Host, Settings, TransferName, VignetteName},
};
use glasswarp_verify::{
    Image, metrics,
    reference::{Crop, Flip, Frame, Levels, Measure, ReadOptions, Reference, Transfer, Turn, resampled},
};
use std::path::Path;

/// Pixels across at which both readings are compared, at most.
const PIXELS: usize = 1024;

/// What the light of a block is judged by.
pub struct TargetLight {
    /// The picture as the verifier reads it: what the eye shall see.
    pub picture: Image,
    /// In spread light: what is to be drawn in perfect light for it, which is the designer's own
    /// solver target.
    perfect: Option<Image>,
}

impl TargetLight {
    /// Reads the picture of these settings, and compares it with the designer's reading.
    pub fn of(
        path: &Path,
        settings: &Settings,
        requirements: &Requirements,
        bench: &Bench,
        host: &dyn Host,
    ) -> Result<Self, Failure> {
        let own = read(path, &options_of(settings), host)?;
        let picture = match &requirements.mesh {
            // A mesh shows a part of the picture: which, is the design's affair; what is on it, is
            // not.
            Some(mesh) => {
                let light = TargetIrradiance::new(to_picture_order(&field_of(&own.light))).map_err(Failure::refused)?;
                image_of(mesh.covered(&light, bench).map_err(Failure::refused)?.cells())
            }
            None => own.light,
        };
        agree(path, &picture, &requirements.perceived, own.tolerance)?;
        Ok(Self { picture, perfect: requirements.deconvolved.as_ref().map(|_| image_of(requirements.ideal.cells())) })
    }

    /// The same for a block from a file, whose picture these settings name, by its side file,
    /// with what stands before it.
    ///
    /// # Errors
    /// No picture, one that cannot be read, or that the two readers read otherwise.
    pub fn of_file(
        settings: &Settings,
        side: Option<(&SideFile, &Before)>,
        host: &dyn Host,
        progress: &dyn Progress,
    ) -> Result<Self, Failure> {
        let picture = settings.picture.as_deref().ok_or_else(|| {
            Failure::Usage("the side file names no picture, by which the block could be judged".into())
        })?;
        let designers = open_target(picture, settings, settings.offset.unwrap_or(0.0), host)?;
        match side {
            Some((side, before)) => {
                let (requirements, bench) = Requirements::of_side(designers, side, before, host, progress)?;
                Self::of(picture, settings, &requirements, &bench, host)
            }
            None => Self::plain(picture, settings, &designers, host),
        }
    }

    /// The same without a bench: the picture alone.
    pub fn plain(
        path: &Path,
        settings: &Settings,
        designers: &TargetIrradiance,
        host: &dyn Host,
    ) -> Result<Self, Failure> {
        let own = read(path, &options_of(settings), host)?;
        agree(path, &own.light, designers, own.tolerance)?;
        Ok(Self { picture: own.light, perfect: None })
    }

    /// What is to be drawn in perfect light.
    pub fn in_perfect_light(&self) -> &Image {
        self.perfect.as_ref().unwrap_or(&self.picture)
    }
}

/// What settings do to a picture, in the verifier's words. The only place where they are
/// translated.
pub fn options_of(settings: &Settings) -> ReadOptions {
    let vignette = match settings.vignette {
        Some(VignetteName(Vignette::Circle { soft })) => Some(soft),
        Some(VignetteName(Vignette::None)) | None => None,
    };
    let mut options = ReadOptions::default();
    options.transfer = settings.transfer.map(transfer_of);
    options.layer = settings.layer.clone();
    options.background = settings.background.map(Background::rgb);
    options.svg_width = settings.nodes.map_or(options.svg_width, |nodes| nodes / 2);
    options.crop = settings.crop.map(crop_of);
    options.turn = settings.rotate.map(|rotation| match rotation {
        Rotation::Right => Turn::Quarter,
        Rotation::Half => Turn::Half,
        Rotation::Left => Turn::ThreeQuarters,
    });
    options.flip = settings.flip.map(|flip| match flip {
        irradiance::Flip::Horizontal => Flip::Horizontal,
        irradiance::Flip::Vertical => Flip::Vertical,
    });
    options.levels =
        settings.levels.map(|levels| Levels { black: levels.black(), white: levels.white(), gamma: levels.gamma() });
    options.invert = settings.invert.unwrap_or(false);
    options.frame = Frame { margin: settings.margin.unwrap_or(0.0), vignette };
    options.offset = settings.offset.unwrap_or(0.0);
    options
}

fn crop_of(crop: irradiance::Crop) -> Crop {
    let [x, y, width, height] = [crop.x, crop.y, crop.width, crop.height].map(|measure| match measure {
        irradiance::Measure::Pixels(pixels) => Measure::Pixels(pixels as f64),
        irradiance::Measure::Percent(percent) => Measure::Share(percent / 100.0),
    });
    Crop { x, y, width, height }
}

fn transfer_of(name: TransferName) -> Transfer {
    match name {
        TransferName::Srgb => Transfer::Srgb,
        TransferName::Linear => Transfer::Linear,
    }
}

/// The verifier's reading of a picture.
pub fn read(path: &Path, options: &ReadOptions, host: &dyn Host) -> Result<Reference, Failure> {
    let _span = tracing::info_span!("read picture", file = %path.display()).entered();
    Reference::parse(&host.bytes(path)?, options).map_err(|error| {
        if error.is_unreadable() {
            let what = format!("{} is not a picture that the verifier can read", path.display());
            Failure::Io { what, source: error.into() }
        } else {
            Failure::refused(error)
        }
    })
}

/// Fails if the designer reads another picture than the verifier: then no judgement can be trusted.
fn agree(path: &Path, own: &Image, designers: &TargetIrradiance, tolerance: f64) -> Result<(), Failure> {
    let cells = designers.cells();
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
    let remedy = "save the picture as an sRGB PNG, and report this as a fault of glasswarp";
    if (own.nx, own.ny) != (cells.nx(), cells.ny()) {
        return Err(Failure::BelowThreshold(format!(
            "THE TWO READERS DISAGREE about {name}: the designer reads {} x {} pixels, the verifier {} x {}; {remedy}",
            cells.nx(),
            cells.ny(),
            own.nx,
            own.ny
        )));
    }
    // As few as can be compared, or as many as are judged.
    let nx = own.nx.clamp(8, PIXELS);
    let ny = (own.ny * nx).div_ceil(own.nx).max(8);
    let theirs = image_of(designers.resampled(nx, ny).cells());
    let apart = metrics::rel_rms(&resampled(own, nx, ny), &theirs).map_err(Failure::refused)?;
    if apart <= tolerance {
        return Ok(());
    }
    Err(Failure::BelowThreshold(format!(
        "THE TWO READERS DISAGREE about {name}: the designer's light and the verifier's differ by {apart:.4} (relative RMS), \
         at most {tolerance:.4} is left to rounding; {remedy}"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Field;

    fn light(nx: usize, ny: usize, value: impl Fn(usize, usize) -> f64) -> Image {
        let values: Vec<f64> = (0..nx * ny).map(|k| value(k % nx, k / nx)).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        Image::new(nx, ny, values.iter().map(|v| v / mean).collect())
    }

    fn as_the_designer_holds_it(image: &Image) -> TargetIrradiance {
        let field = Field::from_vec(image.nx, image.ny, image.values.clone());
        TargetIrradiance::new(to_picture_order(&field)).unwrap()
    }

    #[test]
    fn readings_agree_or_end_the_command() {
        let upright = light(30, 20, |x, y| 1.0 + x as f64 + (3 * y) as f64);
        let path = Path::new("folder/photo.jpg");
        agree(path, &upright, &as_the_designer_holds_it(&upright), 1e-3).unwrap();
        let others = [
            ("mirrored", light(30, 20, |x, y| 30.0 - x as f64 + (3 * y) as f64)),
            ("sideways", light(20, 30, |x, y| 1.0 + y as f64 + (3 * x) as f64)),
            ("too dark", light(30, 20, |x, y| (1.0 + x as f64 + (3 * y) as f64).powf(1.1))),
        ];
        for (what, other) in others {
            let failure = agree(path, &upright, &as_the_designer_holds_it(&other), 1e-3).unwrap_err();
            assert!(matches!(failure, Failure::BelowThreshold(_)), "{what}");
            assert!(failure.to_string().contains("THE TWO READERS DISAGREE about photo.jpg"), "{failure}");
        }
    }

    #[test]
    fn settings_reach_the_verifier() {
        let settings: Settings =
            toml::from_str("transfer = \"linear\"\nmargin = 0.1\nvignette = \"circle:0.2\"\noffset = 0.3\nnodes = 201")
                .unwrap();
        let mut expected = ReadOptions::default();
        expected.transfer = Some(Transfer::Linear);
        expected.frame = Frame { margin: 0.1, vignette: Some(0.2) };
        expected.offset = 0.3;
        expected.svg_width = 100;
        assert_eq!(options_of(&settings), expected);
        assert_eq!(options_of(&Settings::default()), ReadOptions::default());
    }
}
