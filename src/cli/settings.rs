use super::{
    angle::Inclination,
    conflicts, console,
    error::Failure,
    finish::FinishPlan,
    imperfect::{DeconvolutionName, Roughness, SourceName, SpeckFile},
    lamp::{Emission, LightName},
    length::Length,
    memory,
    presets::PresetName,
    quantity::read_as_text,
    toml_file,
    white::Wavelength,
};
use clap::{Args, ValueEnum};
use glasswarp::{
    grid::Outline,
    irradiance::{Background, Crop, Edits, Flip, Framing, Levels, PictureOptions, Rotation, Transfer, Vignette},
    solid::Origin,
};
use serde::Deserialize;
use std::{
    path::{Path, PathBuf},
    str::FromStr,
};

/// Everything that shapes a block. One declaration serves the command line and the `[design]` table of a TOML file; a flag
/// goes before the file, the file before the default.
#[derive(Args, Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub(crate) struct Settings {
    /// The picture, in a design file only (relative to that file).
    #[arg(skip)]
    pub(crate) picture: Option<PathBuf>,

    /// A common set-up to start from: its settings hold where neither a flag nor the design file says otherwise ('glasswarp presets'
    /// lists them)
    #[arg(long, value_name = "NAME", help_heading = "Bench")]
    pub(crate) preset: Option<PresetName>,

    /// Width of the block; its height follows the picture's aspect [default: 100mm]
    #[arg(long, value_name = "LENGTH", help_heading = "Bench")]
    pub(crate) size: Option<Length>,

    /// From the mean plane of the exit face to the receiver [default: 250mm]
    #[arg(long, value_name = "LENGTH", help_heading = "Bench", allow_hyphen_values = true)]
    pub(crate) distance: Option<Length>,

    /// Width of the picture on the receiver, centred where the light of a flat block falls; its height follows the picture's aspect
    /// [default: as that light: for parallel light as the block]
    #[arg(long, value_name = "LENGTH", help_heading = "Bench", allow_hyphen_values = true)]
    pub(crate) window: Option<Length>,

    /// Move the picture on the receiver to the right and up, as seen from the block: 25mm,10mm
    #[arg(long, value_name = "RIGHT,UP", help_heading = "Bench", allow_hyphen_values = true)]
    pub(crate) shift: Option<Shift>,

    /// Let the receiver lean: 20deg takes the picture's top further away, 20deg,90deg its right side (180 bottom, 270 left). The
    /// picture is undistorted on it; the distance is that along the axis
    #[arg(long, value_name = "ANGLE[,SIDE]", help_heading = "Bench", allow_hyphen_values = true)]
    pub(crate) receiver_tilt: Option<Inclination>,

    /// The exit face is a mirror, lit from the receiver's side
    #[arg(long, value_name = "BOOL", help_heading = "Bench", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    pub(crate) mirror: Option<bool>,

    /// What light there is [default: parallel; point, if a distance or emission of a source is given]
    #[arg(long, value_name = "KIND", help_heading = "Light")]
    pub(crate) light: Option<LightName>,

    /// Let the light come from the side, at this angle to the axis of the block: 30deg from the picture's top, 30deg,90deg from its
    /// right (180 bottom, 270 left) [default: straight]
    #[arg(long, value_name = "ANGLE[,SIDE]", help_heading = "Light", allow_hyphen_values = true)]
    pub(crate) tilt: Option<Inclination>,

    /// From a point source to the middle of the entry face, or of the mirror [default: 500mm]
    #[arg(long, value_name = "LENGTH", help_heading = "Light", allow_hyphen_values = true)]
    pub(crate) source_distance: Option<Length>,

    /// How a point source shines, aimed at the middle of the block: isotropic, lambertian, gaussian:12deg (half as bright there), or
    /// an IES file (.ies) [default: isotropic]
    #[arg(long, value_name = "HOW", help_heading = "Light")]
    pub(crate) emission: Option<Emission>,

    /// A linear picture of the light on the entry face, or on the mirror, from edge to edge of the block and the same way round as
    /// the picture on the receiver: its unevenness is made up for
    #[arg(long, value_name = "PICTURE", help_heading = "Light")]
    pub(crate) beam: Option<PathBuf>,

    /// Refractive index of the block [default: 1.5]
    #[arg(long, value_name = "N", help_heading = "Bench")]
    pub(crate) ior: Option<f64>,

    /// Wavelength that the block is designed for, 400nm to 700nm: that of a laser or a coloured LED; needs --material [default: 587.6nm,
    /// for which catalogues give the index]
    #[arg(long, value_name = "WAVELENGTH", help_heading = "Bench")]
    pub(crate) wavelength: Option<Wavelength>,

    /// Material of the block instead of its index: pmma, polycarbonate, bk7, ... ('glasswarp materials' lists them)
    #[arg(long, value_name = "NAME", help_heading = "Bench")]
    pub(crate) material: Option<String>,

    /// Stock: from the entry face to the highest point of the exit face [default: the thinnest standard sheet that holds the
    /// relief]
    #[arg(long, value_name = "LENGTH", help_heading = "Block", allow_hyphen_values = true)]
    pub(crate) thickness: Option<Length>,

    /// Least thickness that the block may have anywhere [default: 3mm]
    #[arg(long, value_name = "LENGTH", help_heading = "Block", allow_hyphen_values = true)]
    pub(crate) min_thickness: Option<Length>,

    /// Size of the source, whose spread is made up for: sun or 0.53deg for parallel light; 5mm (a disc) or 5x3mm for a point source
    #[arg(long, value_name = "SIZE", help_heading = "Imperfect light", allow_hyphen_values = true)]
    pub(crate) source_size: Option<SourceName>,

    /// Roughness of the exit face, made up for: the standard deviation of its slope along any direction, as an angle: 0.1deg
    #[arg(long, value_name = "ANGLE", help_heading = "Imperfect light", allow_hyphen_values = true)]
    pub(crate) roughness: Option<Roughness>,

    /// What else spreads the light, made up for: a linear picture of the speck that a laser through the block makes on the receiver,
    /// seen as the picture is, and the size of its pixels there: speck.png,0.05mm
    #[arg(long, value_name = "PICTURE,LENGTH", help_heading = "Imperfect light")]
    pub(crate) psf: Option<SpeckFile>,

    /// How spread light is made up for [default: window]
    #[arg(long, value_name = "HOW", help_heading = "Imperfect light")]
    pub(crate) deconvolution: Option<DeconvolutionName>,

    /// Rounds of the deconvolution, at most: fewer leave more blur and less ringing [default: 60]
    #[arg(long, value_name = "N", help_heading = "Imperfect light")]
    pub(crate) deconvolution_rounds: Option<usize>,

    /// Draw the picture where this mesh of m x n quads lies on the receiver, folds and all: an .obj in mm, whose first face begins
    /// with the vertex for the block's corner of least x and y, and goes on along +x (warping solvers)
    #[arg(long, value_name = "FILE", help_heading = "Bench")]
    pub(crate) caustic_mesh: Option<PathBuf>,

    /// Let the exit face go on beyond the picture's light by this much, so that light from the side enters through the entry face
    /// [default: as much as the light needs]
    #[arg(long, value_name = "LENGTH", help_heading = "Block", allow_hyphen_values = true)]
    pub(crate) skirt: Option<Length>,

    /// Outline of the block: rectangle, circle (the ellipse within its size), or rounded:10mm (radius of the corners); the picture
    /// stays whole [default: rectangle]
    #[arg(long, value_name = "OUTLINE", help_heading = "Block")]
    pub(crate) outline: Option<OutlineName>,

    /// Height nodes across the width of a rectangle; a face of another outline has as many in all [default: two per pixel, 257 to
    /// 1025]
    #[arg(long, value_name = "N", help_heading = "Block")]
    pub(crate) nodes: Option<usize>,

    /// A planar rim around the exit face: WIDTH,HEIGHT, its plane HEIGHT above the highest point of the face; negative: a
    /// flange below the face, to clamp the block by [default: none]
    #[arg(long, value_name = "WIDTH,HEIGHT", help_heading = "Block", allow_hyphen_values = true)]
    pub(crate) rim: Option<RimSize>,

    /// Registration mark: cut this length off the rim's corner at the picture's top left (+x, +y)
    #[arg(long, value_name = "LENGTH", help_heading = "Block", allow_hyphen_values = true)]
    pub(crate) mark: Option<Length>,

    /// Where the coordinates of the files are counted from [default: exit]
    #[arg(long, value_name = "PLACE", help_heading = "Block")]
    pub(crate) origin: Option<OriginName>,

    /// Greatest distance of a STEP file's B-spline face from the height field, in um [default: as near as the picture needs]
    #[arg(long, value_name = "UM", help_heading = "Block", allow_hyphen_values = true)]
    pub(crate) step_tolerance: Option<f64>,

    /// Constant added to the light of the picture (0..1): it trades contrast for gentler slopes [default: 0.1]
    #[arg(long, value_name = "LIGHT", help_heading = "Picture", allow_hyphen_values = true)]
    pub(crate) offset: Option<f64>,

    /// Part of the window that stays dark on every side of the picture, 0 to 0.45 [default: 0]
    #[arg(long, value_name = "SHARE", help_heading = "Picture", allow_hyphen_values = true)]
    pub(crate) margin: Option<f64>,

    /// Darken the picture towards its border: none, circle (dark outside of the ellipse within it), or circle:0.2 (fading over
    /// this share of the radius) [default: none]
    #[arg(long, value_name = "SHAPE", help_heading = "Picture")]
    pub(crate) vignette: Option<VignetteName>,

    /// How numbers in the picture become light, whatever its file says [default: as its profile or chunks say, else srgb; floats and
    /// OpenEXR linear]
    #[arg(long, value_name = "CURVE", help_heading = "Picture")]
    pub(crate) transfer: Option<TransferName>,

    /// Light behind the transparent parts of the picture: black, white or #rrggbb [default: black; white for SVG]
    #[arg(long, value_name = "COLOUR", help_heading = "Picture")]
    pub(crate) background: Option<Background>,

    /// The layer of an OpenEXR picture, or a single channel of it [default: the only one with colours]
    #[arg(long, value_name = "NAME", help_heading = "Picture")]
    pub(crate) layer: Option<String>,

    /// Use this part of the upright picture alone, counted from its top left corner, in pixels or per cent: 100,50,640,480 or
    /// 10%,0%,80%,100%
    #[arg(long, value_name = "X,Y,WIDTH,HEIGHT", help_heading = "Picture", allow_hyphen_values = true)]
    pub(crate) crop: Option<Crop>,

    /// Turn the picture clockwise: 90deg, 180deg or 270deg
    #[arg(long, value_name = "ANGLE", help_heading = "Picture", allow_hyphen_values = true)]
    pub(crate) rotate: Option<Rotation>,

    /// Mirror the picture: horizontal (left and right change places) or vertical
    #[arg(long, value_name = "HOW", help_heading = "Picture")]
    pub(crate) flip: Option<Flip>,

    /// What becomes black and what white, 0 to 1 as image editors count, and the gamma in between: 0.1,0.9 or 0.05,0.8,1.2
    #[arg(long, value_name = "BLACK,WHITE[,GAMMA]", help_heading = "Picture", allow_hyphen_values = true)]
    pub(crate) levels: Option<Levels>,

    /// Let dark and light change places
    #[arg(long, value_name = "BOOL", help_heading = "Picture", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    pub(crate) invert: Option<bool>,

    /// How the surface is found [default: transport]
    #[arg(long, value_name = "NAME", help_heading = "Solver")]
    pub(crate) solver: Option<SolverName>,

    /// How much work the transport solver puts in [default: normal]
    #[arg(long, value_name = "NAME", help_heading = "Solver")]
    pub(crate) quality: Option<QualityName>,

    /// Bound the curvature of the face for a cutter of this radius, at some cost in accuracy (transport solver)
    #[arg(long, value_name = "LENGTH", help_heading = "Solver", allow_hyphen_values = true)]
    pub(crate) min_radius: Option<Length>,

    /// Make the face such that the light is right after it has been finished: polish=0.1mm is a polish that blurs heights with
    /// this standard deviation; also polish=0.1mm,cutter=ball:3mm,step-over=0.1mm, and gain=6 limits how much any wave is
    /// amplified for it (transport solver)
    #[arg(long, value_name = "FINISH", help_heading = "Solver")]
    pub(crate) finish: Option<FinishPlan>,
}

read_as_text!(VignetteName, OutlineName, RimSize, Shift);

#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum TransferName {
    /// Encoded for a screen: the wall looks like the picture on that screen
    Srgb,
    /// Light already
    Linear,
}

impl From<TransferName> for Transfer {
    fn from(name: TransferName) -> Self {
        match name {
            TransferName::Srgb => Self::Srgb,
            TransferName::Linear => Self::Linear,
        }
    }
}

/// A vignette as a person writes it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct VignetteName(pub(crate) Vignette);

impl FromStr for VignetteName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let soft = match text.trim().split_once(':') {
            None if text.trim() == "none" => return Ok(Self(Vignette::None)),
            None if text.trim() == "circle" => Some(0.0),
            Some(("circle", soft)) => soft.parse().ok(),
            _ => None,
        };
        soft.map(|soft| Self(Vignette::Circle { soft }))
            .ok_or_else(|| format!("'{text}' is no vignette; write none, circle or circle:SHARE, as circle:0.2"))
    }
}

impl std::fmt::Display for VignetteName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0 {
            Vignette::None => f.write_str("none"),
            Vignette::Circle { soft } => write!(f, "circle:{soft}"),
        }
    }
}

/// An outline as a person writes it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct OutlineName(pub(crate) Outline);

impl FromStr for OutlineName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim().split_once(':') {
            None if text.trim() == "rectangle" => Ok(Self(Outline::Rectangle)),
            None if text.trim() == "circle" => Ok(Self(Outline::Circle)),
            Some(("rounded", radius)) => Ok(Self(Outline::Rounded { radius_mm: radius.parse::<Length>()?.mm })),
            _ => Err(format!("'{text}' is no outline; write rectangle, circle or rounded:RADIUS, as rounded:10mm")),
        }
    }
}

impl std::fmt::Display for OutlineName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0 {
            Outline::Rectangle => f.write_str("rectangle"),
            Outline::Circle => f.write_str("circle"),
            Outline::Rounded { radius_mm } => write!(f, "rounded:{radius_mm}mm"),
        }
    }
}

/// Width and height of a rim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RimSize {
    pub(crate) width: Length,
    pub(crate) rise: Length,
}

impl FromStr for RimSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (width, rise) = text
            .split_once(',')
            .ok_or_else(|| format!("'{text}' is no width and height; write them as 10mm,2mm or 10mm,-4mm"))?;
        Ok(Self { width: width.parse()?, rise: rise.parse()? })
    }
}

/// How far a picture is moved on the receiver, as seen from the block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Shift {
    pub(crate) right: Length,
    pub(crate) up: Length,
}

impl FromStr for Shift {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (right, up) = text.split_once(',').ok_or_else(|| {
            format!("'{text}' is no shift; write how far to the right and up, as 25mm,0mm or -10mm,5mm")
        })?;
        Ok(Self { right: right.parse()?, up: up.parse()? })
    }
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum OriginName {
    /// On the axis, in the mean plane of the exit face
    #[default]
    Exit,
    /// On the axis, in the entry face
    Entry,
    /// On the axis, at the highest point of the block
    StockTop,
    /// At the corner of least x and y, in the entry face
    Corner,
}

impl From<OriginName> for Origin {
    fn from(name: OriginName) -> Self {
        match name {
            OriginName::Exit => Self::Exit,
            OriginName::Entry => Self::Entry,
            OriginName::StockTop => Self::StockTop,
            OriginName::Corner => Self::Corner,
        }
    }
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum SolverName {
    /// Optical-path transport: the most accurate, and the only one for true black (offset 0)
    #[default]
    Transport,
    /// Brightness warping, improved: height-aware, smooth, closed loop
    Warping,
    /// Brightness warping as the paper prints it
    WarpingPaper,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum QualityName {
    /// A look at what will come, in well under a second
    Draft,
    /// Seconds
    #[default]
    Normal,
    /// What the nodes can give, in a few times the time
    Fine,
}

/// The name of a choice, as on the command line.
pub(crate) fn name_of(choice: impl ValueEnum) -> String {
    choice.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
}

/// Nodes across that a drawing is rasterised for where none are asked for.
pub(crate) const DRAWING_NODES: usize = 1025;

/// A design file: its `[design]` table holds [`Settings`]; side files carry more tables, which do not shape the block.
#[derive(Deserialize)]
pub(crate) struct DesignFile {
    pub(crate) design: Settings,
}

impl Settings {
    /// What flags and a design file together ask for, and the picture; `named` is either.
    pub(crate) fn of(named: &Path, flags: &Self) -> Result<(Self, PathBuf), Failure> {
        conflicts::check_flags(flags)?;
        if !named.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
            return Ok((flags.clone().with_preset()?, named.to_path_buf()));
        }
        let file = Self::as_written(named)?;
        for (silenced, by) in conflicts::silence(flags, &mut file.clone()) {
            console::warn(format_args!("--{by} takes the place of {silenced} in {}", named.display()));
        }
        let settings = flags.clone().or(file).with_preset()?;
        let picture = settings.named_picture(named)?;
        Ok((settings, picture))
    }

    /// Reads the `[design]` table of a TOML file. The picture's path is taken relative to the file.
    pub(crate) fn read(path: &Path) -> Result<Self, Failure> {
        Self::as_written(path)?.with_preset()
    }

    /// The same with its preset yet to be looked up.
    fn as_written(path: &Path) -> Result<Self, Failure> {
        let mut settings = toml_file::read::<DesignFile>(path, "design file")?.design;
        conflicts::check_file(&settings).map_err(|refusal| toml_file::placed(refusal, path))?;
        settings.resolve_paths(path);
        Ok(settings)
    }

    /// With the settings of the preset where these are silent.
    pub(crate) fn with_preset(self) -> Result<Self, Failure> {
        match self.preset {
            Some(preset) => Ok(Self { preset: None, ..self.or(preset.settings()?) }),
            None => Ok(self),
        }
    }

    /// What is done to the picture before it becomes light.
    pub(crate) fn framing(&self) -> Result<Framing, Failure> {
        let vignette = self.vignette.map(|VignetteName(vignette)| vignette).unwrap_or_default();
        Framing::new(self.margin.unwrap_or(0.0), vignette).map_err(Failure::refused)
    }

    /// How the picture is read, and what is done to it.
    pub(crate) fn picture_options(&self) -> PictureOptions {
        let Self { crop, rotate, flip, levels, .. } = *self;
        PictureOptions::default()
            .with_transfer(self.transfer.map(Transfer::from))
            .with_background(self.background)
            .with_layer(self.layer.clone())
            .with_edits(Edits { crop, rotate, flip, levels, invert: self.invert.unwrap_or(false) })
            // Two nodes a pixel are what a face can draw.
            .with_drawing_width(self.nodes.unwrap_or(DRAWING_NODES) / 2)
            .with_memory(memory::for_a_picture())
    }

    /// The picture that a design file names.
    pub(crate) fn named_picture(&self, file: &Path) -> Result<PathBuf, Failure> {
        self.picture.clone().ok_or_else(|| {
            Failure::Usage(format!("{} names no picture: add picture = \"...\" to its [design]", file.display()))
        })
    }

    /// The files that these settings name.
    pub(crate) fn files(&self) -> impl Iterator<Item = &Path> {
        let lamp = match &self.emission {
            Some(Emission::Ies(path)) => Some(path),
            _ => None,
        };
        let speck = self.psf.as_ref().map(|speck| &speck.path);
        let files = [self.picture.as_ref(), self.beam.as_ref(), lamp, speck, self.caustic_mesh.as_ref()];
        files.into_iter().flatten().map(PathBuf::as_path)
    }

    /// Takes the paths of files, so far relative to the file that names them, relative to the working folder.
    pub(crate) fn resolve_paths(&mut self, file: &Path) {
        let lamp = match &mut self.emission {
            Some(Emission::Ies(path)) => Some(path),
            _ => None,
        };
        let speck = self.psf.as_mut().map(|speck| &mut speck.path);
        let files = [self.picture.as_mut(), self.beam.as_mut(), lamp, speck, self.caustic_mesh.as_mut()];
        for path in files.into_iter().flatten() {
            *path = file.parent().unwrap_or(Path::new("")).join(&path);
        }
    }

    pub(crate) fn is_mirror(&self) -> bool {
        self.mirror.unwrap_or(false)
    }

    /// The kind of light: what is asked for, or what else is said of it means.
    pub(crate) fn light(&self) -> LightName {
        let of_a_source = self.source_distance.is_some() || self.emission.is_some();
        self.light.unwrap_or(if of_a_source { LightName::Point } else { LightName::Parallel })
    }

    /// These settings, and where they are silent, `other`'s as far as these do not exclude them.
    pub(crate) fn or(self, mut other: Self) -> Self {
        conflicts::silence(&self, &mut other);
        Self {
            picture: self.picture.or(other.picture),
            preset: self.preset.or(other.preset),
            size: self.size.or(other.size),
            distance: self.distance.or(other.distance),
            window: self.window.or(other.window),
            shift: self.shift.or(other.shift),
            receiver_tilt: self.receiver_tilt.or(other.receiver_tilt),
            mirror: self.mirror.or(other.mirror),
            light: self.light.or(other.light),
            tilt: self.tilt.or(other.tilt),
            source_distance: self.source_distance.or(other.source_distance),
            emission: self.emission.or(other.emission),
            beam: self.beam.or(other.beam),
            source_size: self.source_size.or(other.source_size),
            roughness: self.roughness.or(other.roughness),
            psf: self.psf.or(other.psf),
            deconvolution: self.deconvolution.or(other.deconvolution),
            deconvolution_rounds: self.deconvolution_rounds.or(other.deconvolution_rounds),
            caustic_mesh: self.caustic_mesh.or(other.caustic_mesh),
            skirt: self.skirt.or(other.skirt),
            ior: self.ior.or(other.ior),
            material: self.material.or(other.material),
            wavelength: self.wavelength.or(other.wavelength),
            thickness: self.thickness.or(other.thickness),
            min_thickness: self.min_thickness.or(other.min_thickness),
            margin: self.margin.or(other.margin),
            vignette: self.vignette.or(other.vignette),
            outline: self.outline.or(other.outline),
            nodes: self.nodes.or(other.nodes),
            rim: self.rim.or(other.rim),
            mark: self.mark.or(other.mark),
            origin: self.origin.or(other.origin),
            step_tolerance: self.step_tolerance.or(other.step_tolerance),
            offset: self.offset.or(other.offset),
            transfer: self.transfer.or(other.transfer),
            background: self.background.or(other.background),
            layer: self.layer.or(other.layer),
            crop: self.crop.or(other.crop),
            rotate: self.rotate.or(other.rotate),
            flip: self.flip.or(other.flip),
            levels: self.levels.or(other.levels),
            invert: self.invert.or(other.invert),
            solver: self.solver.or(other.solver),
            quality: self.quality.or(other.quality),
            min_radius: self.min_radius.or(other.min_radius),
            finish: self.finish.or(other.finish),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_go_before_the_file() {
        let file: DesignFile =
            toml::from_str("[design]\nsize = \"20cm\"\nior = 1.6\noffset = 0.2\nsolver = \"warping-paper\"").unwrap();
        let flags = Settings { material: Some("pmma".into()), offset: Some(0.3), ..Settings::default() };
        let merged = flags.or(file.design);
        assert_eq!(merged.size, Some(Length { mm: 200.0 }));
        assert_eq!((merged.ior, merged.material.as_deref()), (None, Some("pmma")));
        assert_eq!(merged.offset, Some(0.3));
        assert_eq!(merged.solver, Some(SolverName::WarpingPaper));
    }

    #[test]
    fn a_file_goes_before_its_preset() {
        let file = "[design]\npreset = \"desk-demo\"\nsize = \"70mm\"\nior = 1.6";
        let settings = toml::from_str::<DesignFile>(file).unwrap().design.with_preset().unwrap();
        assert_eq!(settings.size, Some(Length { mm: 70.0 }));
        assert_eq!(settings.distance, Some(Length { mm: 200.0 }));
        assert_eq!((settings.ior, settings.material), (Some(1.6), None));
    }
}
