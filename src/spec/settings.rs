//! Every setting of a design, declared once: the flags, the keys of design files and side files,
//! and what is merged of them follow from here.

use super::{
    angle::Inclination,
    choices::{OriginName, QualityName, SolverName, TransferName},
    finish::FinishPlan,
    forms::{OutlineName, RimSize, Shift, VignetteName},
    lamp::{Emission, LightName},
    length::{Length, SmallLength},
    presets::PresetName,
    source::{BeforeFile, DeconvolutionName, Roughness, SourceName, SpeckFile},
    wavelength::Wavelength,
};
use crate::{
    failure::Failure,
    irradiance::{Background, Crop, Edits, Flip, Framing, Levels, PictureOptions, Rotation, SourceSize, Transfer},
};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Declares the settings: every one may be given or not.
macro_rules! settings {
    ($(#[$of_all:meta])* $name:ident { $($(#[$of_one:meta])* $setting:ident: $kind:ty,)* }) => {
        $(#[$of_all])*
        pub struct $name { $($(#[$of_one])* pub $setting: Option<$kind>,)* }

        impl $name {
            /// The names of all settings, with underscores.
            pub(crate) const NAMES: &[&str] = &[$(stringify!($setting)),*];

            /// These settings, and those of another where these are silent.
            pub(crate) fn over(self, under: Self) -> Self {
                Self { $($setting: self.$setting.or(under.$setting),)* }
            }
        }
    };
}

settings! {
    /// Everything that shapes a block. One declaration serves the command line and the `[design]`
    /// table of a TOML file; a flag goes before the file, the file before the default.
    #[derive(clap::Args, Clone, Debug, Default, Deserialize, Serialize)]
    #[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
    Settings {
    /// The picture, in a design file only (relative to that file).
    #[arg(skip)]
    picture: PathBuf,

    /// A common set-up to start from ('glasswarp presets')
    ///
    /// Its settings hold where neither a flag nor the design file says otherwise.
    #[arg(long, value_name = "NAME", help_heading = "Bench")]
    preset: PresetName,

    /// Width of the block [default: 100mm]
    ///
    /// Its height follows the picture's aspect.
    #[arg(long, value_name = "LENGTH", help_heading = "Bench", allow_hyphen_values = true)]
    size: Length,

    /// From the curved face to the receiver [default: 250mm]
    ///
    /// Counted from the mean plane of the exit face, along the axis.
    #[arg(long, value_name = "LENGTH", help_heading = "Bench", allow_hyphen_values = true)]
    distance: Length,

    /// Width of the picture on the receiver, centred where the light of a flat block falls; its
    /// height follows the picture's aspect [default: as that light: for parallel light as the
    /// block]
    #[arg(long, value_name = "LENGTH", help_heading = "Bench", allow_hyphen_values = true, hide_short_help = true)]
    window: Length,

    /// Move the picture on the receiver to the right and up, as seen from the block: 25mm,10mm
    #[arg(long, value_name = "RIGHT,UP", help_heading = "Bench", allow_hyphen_values = true, hide_short_help = true)]
    shift: Shift,

    /// Let the receiver lean: 20deg takes the picture's top further away, 20deg,90deg its right
    /// side (180 bottom, 270 left). The picture is undistorted on it; the distance is that along
    /// the axis
    #[arg(long, value_name = "ANGLE[,SIDE]", help_heading = "Bench", allow_hyphen_values = true, hide_short_help = true)]
    receiver_tilt: Inclination,

    /// The face is a mirror, lit from the receiver's side
    #[arg(long, value_name = "BOOL", help_heading = "Bench", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    mirror: bool,

    /// What light there is: parallel (from far away: the sun, a collimated lamp), or point (a torch,
    /// an LED, a candle) [default: parallel; point, if a distance or emission of a source is given]
    #[arg(long, value_name = "KIND", help_heading = "Light", value_parser = LightName::of_flag, hide_short_help = true)]
    light: LightName,

    /// Let the light come from above: 30deg, or a side: 30deg,90deg
    ///
    /// The angle to the axis of the block, and from where: without a side from the picture's top, 90deg
    /// from its right, 180deg from its bottom, 270deg from its left [default: straight]
    #[arg(long, value_name = "ANGLE[,SIDE]", help_heading = "Light", allow_hyphen_values = true)]
    tilt: Inclination,

    /// From a point source to the middle of the entry face, or of the mirror [default: 500mm]
    #[arg(long, value_name = "LENGTH", help_heading = "Light", allow_hyphen_values = true, hide_short_help = true)]
    source_distance: Length,

    /// How a point source shines, aimed at the middle of the block: isotropic, lambertian,
    /// gaussian:12deg (half as bright there), or an IES file (.ies) [default: isotropic]
    #[arg(long, value_name = "HOW", help_heading = "Light", hide_short_help = true)]
    emission: Emission,

    /// A linear picture of the light on the entry face, or on the mirror, from edge to edge of the
    /// block and the same way round as the picture on the receiver: its unevenness is corrected for
    #[arg(long, value_name = "PICTURE", help_heading = "Light", hide_short_help = true)]
    beam: PathBuf,

    /// Let the block stand behind another one, in the light that comes through it: its file, its side
    /// file beside it, and the air from its mean exit plane to the entry face: plate.stl,30mm
    #[arg(long, value_name = "FILE,LENGTH", help_heading = "Light", hide_short_help = true)]
    behind: BeforeFile,

    /// Refractive index of the block [default: that of its material]
    #[arg(long, value_name = "N", help_heading = "Bench", hide_short_help = true)]
    ior: f64,

    /// Wavelength that the block is designed for, 400nm to 700nm: that of a laser or a coloured
    /// LED [default: 587.6nm, for which catalogues give the index]
    #[arg(long, value_name = "WAVELENGTH", help_heading = "Bench", hide_short_help = true)]
    wavelength: Wavelength,

    /// Material: pmma, bk7, ... ('glasswarp materials') [default: pmma]
    ///
    /// Cast acrylic unless something else is said; the index may be told by --ior instead.
    #[arg(long, value_name = "NAME", help_heading = "Bench")]
    material: String,

    /// Thickness of the block [default: by the sheet]
    ///
    /// From the entry face to the highest point of the exit face; by default that of the thinnest
    /// standard sheet that holds the relief, less --facing.
    #[arg(long, value_name = "LENGTH", help_heading = "Block", allow_hyphen_values = true)]
    thickness: Length,

    /// What is faced off the top of the sheet before the face is cut, because no sheet is as thick
    /// as its name: the sheet to order is that much thicker than the block [default: 0.5mm]
    #[arg(long, value_name = "LENGTH", help_heading = "Block", allow_hyphen_values = true, hide_short_help = true)]
    facing: Length,

    /// Least thickness that the block may have anywhere [default: 3mm]
    #[arg(long, value_name = "LENGTH", help_heading = "Block", allow_hyphen_values = true, hide_short_help = true)]
    min_thickness: Length,

    /// Size of the light: sun, 0.5deg, 5mm, or none for a laser
    ///
    /// Its spread is corrected for: sun or 0.53deg for parallel light; 5mm (a disc) or 5x3mm for a point
    /// source; none for a laser, and for what else spreads nothing.
    #[arg(long, value_name = "SIZE", help_heading = "Imperfect light", allow_hyphen_values = true)]
    source_size: SourceName,

    /// Roughness of the exit face, corrected for: the standard deviation of its slope along any
    /// direction, as an angle: 0.1deg
    #[arg(long, value_name = "ANGLE", help_heading = "Imperfect light", allow_hyphen_values = true, hide_short_help = true)]
    roughness: Roughness,

    /// What else spreads the light, corrected for: a linear picture of the speck that a laser through
    /// the block makes on the receiver, seen as the picture is, and the size of its pixels there:
    /// speck.png,0.05mm
    #[arg(long, value_name = "PICTURE,LENGTH", help_heading = "Imperfect light", hide_short_help = true)]
    psf: SpeckFile,

    /// How spread light is corrected for [default: window]
    #[arg(long, value_name = "HOW", help_heading = "Imperfect light", hide_short_help = true)]
    deconvolution: DeconvolutionName,

    /// Rounds of the deconvolution, at most: fewer leave more blur and less ringing [default: 60]
    #[arg(long, value_name = "N", help_heading = "Imperfect light", hide_short_help = true)]
    deconvolution_rounds: usize,

    /// Draw the picture where this mesh of m x n quads lies on the receiver, folds and all: an .obj
    /// in mm, whose first face begins with the vertex for the block's corner of least x and y, and
    /// goes on along +x (warping solvers)
    #[arg(long, value_name = "FILE", help_heading = "Bench", hide_short_help = true)]
    caustic_mesh: PathBuf,

    /// Let the exit face go on beyond the picture's light by this much, so that light from the side
    /// enters through the entry face [default: as much as the light needs]
    #[arg(long, value_name = "LENGTH", help_heading = "Block", allow_hyphen_values = true, hide_short_help = true)]
    skirt: Length,

    /// Outline of the block: rectangle, circle (the ellipse within its size), or rounded:10mm
    /// (radius of the corners); the picture stays whole [default: rectangle]
    #[arg(long, value_name = "OUTLINE", help_heading = "Block", hide_short_help = true)]
    outline: OutlineName,

    /// Height nodes across the width of a rectangle; a face of another outline has as many in all
    /// [default: two per pixel, 257 to 1025]
    #[arg(long, value_name = "N", help_heading = "Block", hide_short_help = true)]
    nodes: usize,

    /// A rim or flange around the face: 10mm,2mm or 10mm,-4mm
    ///
    /// WIDTH,HEIGHT: its plane lies HEIGHT above the highest point of the face; negative: a flange below
    /// the face, to clamp the block by [default: none]
    #[arg(long, value_name = "WIDTH,HEIGHT", help_heading = "Block", allow_hyphen_values = true)]
    rim: RimSize,

    /// Registration mark: cut this length off the rim's corner at the picture's top left (+x, +y)
    #[arg(long, value_name = "LENGTH", help_heading = "Block", allow_hyphen_values = true, hide_short_help = true)]
    mark: Length,

    /// Where the coordinates of the files are counted from [default: exit]
    #[arg(long, value_name = "PLACE", help_heading = "Block", hide_short_help = true)]
    origin: OriginName,

    /// Greatest distance of a STEP file's B-spline face from the height field, such as 0.05um
    /// [default: as near as the picture needs]
    #[arg(long, value_name = "LENGTH", help_heading = "Block", allow_hyphen_values = true, hide_short_help = true)]
    step_tolerance: SmallLength,

    /// Constant added to the light of the picture (0..1): it trades contrast for gentler slopes
    /// [default: 0.1]
    #[arg(long, value_name = "LIGHT", help_heading = "Picture", allow_hyphen_values = true, hide_short_help = true)]
    offset: f64,

    /// Part of the window that stays dark on every side of the picture, 0 to 0.45 [default: 0]
    #[arg(long, value_name = "SHARE", help_heading = "Picture", allow_hyphen_values = true, hide_short_help = true)]
    margin: f64,

    /// Darken the picture towards its border: none, circle (dark outside of the ellipse within it),
    /// or circle:0.2 (fading over this share of the radius) [default: none]
    #[arg(long, value_name = "SHAPE", help_heading = "Picture", hide_short_help = true)]
    vignette: VignetteName,

    /// How numbers in the picture become light, whatever its file says [default: as its profile or
    /// chunks say, else srgb; floats and OpenEXR linear]
    #[arg(long, value_name = "CURVE", help_heading = "Picture", hide_short_help = true)]
    transfer: TransferName,

    /// Light behind the transparent parts of the picture: black, white or #rrggbb [default: black;
    /// white for SVG]
    #[arg(long, value_name = "COLOUR", help_heading = "Picture", hide_short_help = true)]
    background: Background,

    /// The layer of an OpenEXR picture, or a single channel of it [default: the only one with
    /// colours]
    #[arg(long, value_name = "NAME", help_heading = "Picture", hide_short_help = true)]
    layer: String,

    /// Use a part of the picture: 100,50,640,480 or 10%,0%,80%,100%
    ///
    /// Of the upright picture, counted from its top left corner, in pixels or per cent.
    #[arg(long, value_name = "X,Y,WIDTH,HEIGHT", help_heading = "Picture", allow_hyphen_values = true)]
    crop: Crop,

    /// Turn the picture clockwise: 90deg, 180deg or 270deg
    #[arg(long, value_name = "ANGLE", help_heading = "Picture", allow_hyphen_values = true, hide_short_help = true)]
    rotate: Rotation,

    /// Mirror the picture: horizontal (left and right change places) or vertical
    #[arg(long, value_name = "HOW", help_heading = "Picture", hide_short_help = true)]
    flip: Flip,

    /// What becomes black and what white, 0 to 1 as image editors count, and the gamma in between:
    /// 0.1,0.9 or 0.05,0.8,1.2
    #[arg(long, value_name = "BLACK,WHITE[,GAMMA]", help_heading = "Picture", allow_hyphen_values = true, hide_short_help = true)]
    levels: Levels,

    /// Let dark and light change places
    #[arg(long, value_name = "BOOL", help_heading = "Picture", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    invert: bool,

    /// How the surface is found [default: transport]
    #[arg(long, value_name = "NAME", help_heading = "Solver", hide_short_help = true)]
    solver: SolverName,

    /// How much work the transport solver puts in [default: normal]
    #[arg(long, value_name = "NAME", help_heading = "Solver", hide_short_help = true)]
    quality: QualityName,

    /// Bound the curvature of the face for a cutter of this radius, at some cost in accuracy
    /// (transport solver)
    #[arg(long, value_name = "LENGTH", help_heading = "Solver", allow_hyphen_values = true, hide_short_help = true)]
    min_radius: Length,

    /// Make a face that is right after its polish: polish=0.1mm
    ///
    /// A polish that blurs heights with this standard deviation; also
    /// polish=0.1mm,cutter=ball:d6mm,step-over=0.1mm, and gain=6 limits how much any wave is
    /// amplified for it (transport solver).
    #[arg(long, value_name = "FINISH", help_heading = "Solver")]
    finish: FinishPlan,
}
}

/// Light that is added to that of the picture where nothing is said of it.
pub const OFFSET: f64 = 0.1;

/// Nodes across that a drawing is rasterised for where none are asked for.
pub const DRAWING_NODES: usize = 1025;

/// A design file: its `[design]` table holds [`Settings`]; side files carry more tables, which do
/// not shape the block.
#[derive(Deserialize)]
pub struct DesignFile {
    /// The settings.
    pub design: Settings,
}

impl Settings {
    /// What is done to the picture before it becomes light.
    ///
    /// # Errors
    /// A margin or vignette out of range.
    pub fn framing(&self) -> Result<Framing, Failure> {
        let vignette = self.vignette.map(|VignetteName(vignette)| vignette).unwrap_or_default();
        Framing::new(self.margin.unwrap_or(0.0), vignette).map_err(Failure::refused)
    }

    /// How the picture is read, in at most so many bytes of memory, and what is done to it.
    pub fn picture_options(&self, memory: u64) -> PictureOptions {
        let Self { crop, rotate, flip, levels, .. } = *self;
        PictureOptions::default()
            .with_transfer(self.transfer.map(Transfer::from))
            .with_background(self.background)
            .with_layer(self.layer.clone())
            .with_edits(Edits { crop, rotate, flip, levels, invert: self.invert.unwrap_or(false) })
            // Two nodes a pixel are what a face can draw.
            .with_drawing_width(self.nodes.unwrap_or(DRAWING_NODES) / 2)
            .with_memory(memory)
    }

    /// The picture that a design file names.
    ///
    /// # Errors
    /// It names none.
    pub fn named_picture(&self, file: &Path) -> Result<PathBuf, Failure> {
        self.picture.clone().ok_or_else(|| {
            Failure::Usage(format!("{} names no picture: add picture = \"...\" to its [design]", file.display()))
        })
    }

    /// The files that these settings name.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        let lamp = match &self.emission {
            Some(Emission::Ies(path)) => Some(path),
            _ => None,
        };
        let speck = self.psf.as_ref().map(|speck| &speck.path);
        let before = self.behind.as_ref().map(|before| &before.path);
        let files = [self.picture.as_ref(), self.beam.as_ref(), lamp, speck, self.caustic_mesh.as_ref(), before];
        files.into_iter().flatten().map(PathBuf::as_path)
    }

    /// Gives every file that these settings name another path.
    pub fn rename_files(&mut self, renamed: impl Fn(&Path) -> PathBuf) {
        let lamp = match &mut self.emission {
            Some(Emission::Ies(path)) => Some(path),
            _ => None,
        };
        let speck = self.psf.as_mut().map(|speck| &mut speck.path);
        let before = self.behind.as_mut().map(|before| &mut before.path);
        let files = [self.picture.as_mut(), self.beam.as_mut(), lamp, speck, self.caustic_mesh.as_mut(), before];
        for path in files.into_iter().flatten() {
            *path = renamed(path);
        }
    }

    /// Takes the paths of files, so far relative to the file that names them, relative to the
    /// working folder.
    pub fn resolve_paths(&mut self, file: &Path) {
        let folder = file.parent().unwrap_or(Path::new(""));
        self.rename_files(|path| folder.join(path));
    }

    /// Whether the exit face reflects.
    pub fn is_mirror(&self) -> bool {
        self.mirror.unwrap_or(false)
    }

    /// The kind of light: what is asked for, or what else is said of it means.
    pub fn light(&self) -> LightName {
        let of_a_source = self.source_distance.is_some() || self.emission.is_some();
        self.light.unwrap_or(if of_a_source { LightName::Point } else { LightName::Parallel })
    }

    /// The size of the source, if it has one that spreads light.
    pub fn spread_source(&self) -> Option<SourceSize> {
        self.source_size.and_then(SourceName::size)
    }

    /// Whether light is spread: by its source, by the face, or as a measured speck shows.
    pub fn has_spread(&self) -> bool {
        self.spread_source().is_some() || self.roughness.is_some() || self.psf.is_some()
    }
}
