//! The block as files.
//!
//! Every mesh format holds the same `f32` vertices: in millimetres in STL, OBJ, 3MF and PLY, in metres and turned to `+y` up
//! in GLB. What the encoding costs on the wall is the resolution of `f32` near 0, about a micrometre of spot displacement.
//! STEP holds the exit face as a B-spline surface, in decimals of a millimetre. Height maps hold the exit face alone.

mod glb;
mod height_map;
mod obj;
mod ply;
mod step;
mod stl;
mod text;
mod three_mf;

pub use glasswarp_files::{Held, WriteError, probe, remove_unfinished, write_atomically};
pub use glb::write_glb;
pub use height_map::{HeightMap, HeightMapError, HeightMapFormat};
pub use obj::write_obj;
pub use ply::write_ply;
pub use step::{NetFit, StepError, StepTolerance, choose_net, write_step};
pub use stl::write_stl;
pub use three_mf::write_3mf;

use crate::{
    bench::ExitFace,
    solid::{Origin, Solid},
};
use std::{fmt, io, path::Path};

/// What a file says about the block beside its geometry.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// A name for people.
    pub name: String,
    /// What the exit face does to the light.
    pub exit_face: ExitFace,
    /// From the mean exit plane to the receiver, mm.
    pub distance_mm: f64,
}

impl Design {
    /// One line of plain ASCII: units first, the name last because a header may cut it off.
    fn summary(&self, solid: &Solid) -> String {
        let extent = solid.extent();
        let face = match self.exit_face {
            ExitFace::Refracts { ior } => format!("n={ior}"),
            ExitFace::Reflects => "mirror".to_owned(),
        };
        // In the library's own frame, unless it says otherwise.
        let origin = match solid.shape().origin {
            Origin::Exit => String::new(),
            other => format!(" origin={other}"),
        };
        format!(
            "unit=mm{origin} {face} distance={} size={}x{} design={}",
            self.distance_mm,
            extent.width_mm,
            extent.height_mm,
            self.ascii_name()
        )
    }

    /// What the block is made of, where the receiver stands, and what coordinates mean, as a line for people.
    fn description(&self, solid: &Solid) -> String {
        let material = match self.exit_face {
            ExitFace::Refracts { ior } => format!("refractive index {ior}"),
            ExitFace::Reflects => "mirror".to_owned(),
        };
        format!("{material}, receiver {} mm from the mean exit plane; {}", self.distance_mm, solid.frame_line())
    }

    /// The name for formats of 7-bit text, on one line.
    fn ascii_name(&self) -> String {
        self.name.chars().map(|c| if c == ' ' || c.is_ascii_graphic() { c } else { '?' }).collect()
    }
}

/// A file format for the block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Binary STL, millimetres.
    Stl,
    /// Wavefront OBJ with vertex normals, millimetres, z up.
    Obj,
    /// Binary glTF 2.0, metres, y up, with the material.
    Glb,
    /// STEP AP214, millimetres: a B-spline exit face, planes and cylinders.
    Step,
    /// 3MF, millimetres.
    ThreeMf,
    /// Binary PLY, millimetres, z up.
    Ply,
}

/// Why a block could not be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The extension names no format.
    #[error("{path:?} has {}; a block is written as {}", found(extension), Format::known())]
    Extension {
        /// The file that was asked for.
        path: String,
        /// Its extension.
        extension: Option<String>,
    },
    /// More than a GLB holds.
    #[error(
        "{vertices} vertices are more than a GLB holds for viewers (at most {most}): write the full block as .stl, or make a coarser one for viewing (--nodes)"
    )]
    TooManyForGlb {
        /// Vertices that it would have.
        vertices: usize,
        /// Most that are written.
        most: usize,
    },
    /// The file could not be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

fn found(extension: &Option<String>) -> String {
    extension.as_ref().map_or_else(|| "no extension".to_owned(), |found| format!("the unknown extension .{found}"))
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 6] = [Self::Stl, Self::Obj, Self::Glb, Self::Step, Self::ThreeMf, Self::Ply];

    /// The usual extension.
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Stl => "stl",
            Self::Obj => "obj",
            Self::Glb => "glb",
            Self::Step => "step",
            Self::ThreeMf => "3mf",
            Self::Ply => "ply",
        }
    }

    /// The format that a file's extension names, in capitals or not.
    ///
    /// # Errors
    /// No extension, or an unknown one.
    pub fn from_path(path: &Path) -> Result<Self, ExportError> {
        let extension = path.extension().map(|e| e.to_string_lossy().into_owned());
        Self::ALL
            .into_iter()
            .find(|format| {
                // STEP files end in .stp too.
                let named = |e: &String| e.eq_ignore_ascii_case(format.extension());
                let short = |e: &String| *format == Self::Step && e.eq_ignore_ascii_case("stp");
                extension.as_ref().is_some_and(|e| named(e) || short(e))
            })
            .ok_or_else(|| ExportError::Extension { path: path.display().to_string(), extension })
    }

    fn known() -> String {
        Self::ALL.map(|format| format!(".{}", format.extension())).join(", ")
    }

    /// Refuses what the format cannot hold, before anything is written.
    ///
    /// # Errors
    /// [`ExportError::TooManyForGlb`].
    pub fn check(self, solid: &Solid) -> Result<(), ExportError> {
        match self {
            Self::Glb => glb::check(solid),
            Self::Stl | Self::Obj | Self::Step | Self::ThreeMf | Self::Ply => Ok(()),
        }
    }

    /// Writes the block to anything that takes bytes.
    ///
    /// # Errors
    /// Those of the writer, and [`io::ErrorKind::InvalidInput`] for what [`check`](Self::check) refuses.
    pub fn write(self, writer: &mut impl io::Write, solid: &Solid, design: &Design) -> io::Result<()> {
        match self {
            Self::Stl => write_stl(writer, solid, design),
            Self::Obj => write_obj(writer, solid, design),
            Self::Glb => write_glb(writer, solid, design),
            Self::Step => {
                let fit = choose_net(solid.surface(), StepTolerance::Picture, design)
                    .map_err(|error| io::Error::new(io::ErrorKind::InvalidInput, error))?;
                write_step(writer, solid, &fit.net, design)
            }
            Self::ThreeMf => write_3mf(writer, solid, design),
            Self::Ply => write_ply(writer, solid, design),
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.extension())
    }
}

/// Writes the block in the format that the extension names. The file appears whole or not at all.
///
/// # Errors
/// An unknown extension, a block too large for the format, or a file that cannot be written. A STEP file gets the net that
/// the picture needs; [`choose_net`] and [`write_step`] give the choice.
pub fn export(path: &Path, solid: &Solid, design: &Design) -> Result<(), ExportError> {
    let format = Format::from_path(path)?;
    format.check(solid)?;
    let _span = tracing::info_span!("write", file = %path.display()).entered();
    write_atomically(path, |writer| format.write(writer, solid, design))?;
    Ok(())
}

#[cfg(test)]
pub(crate) mod tests;
