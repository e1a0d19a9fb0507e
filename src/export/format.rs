//! The formats, and what their files say.

use crate::{
    bench::ExitFace,
    solid::{Origin, Solid},
};
#[cfg(feature = "files")]
use glasswarp_files::WriteError;
use std::{fmt, path::Path};

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
    pub(super) fn summary(&self, solid: &Solid) -> String {
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

    /// What the block is made of, where the receiver stands, and what coordinates mean, as a line
    /// for people.
    pub(super) fn description(&self, solid: &Solid) -> String {
        let material = match self.exit_face {
            ExitFace::Refracts { ior } => format!("refractive index {ior}"),
            ExitFace::Reflects => "mirror".to_owned(),
        };
        format!("{material}, receiver {} mm from the mean exit plane; {}", self.distance_mm, solid.frame_line())
    }

    /// The name for formats of 7-bit text, on one line.
    pub(super) fn ascii_name(&self) -> String {
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
#[non_exhaustive]
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
        "{vertices} vertices are more than a GLB holds for viewers (at most {most}): write the full block as .stl, or make one of fewer nodes for viewing"
    )]
    TooManyForGlb {
        /// Vertices that it would have.
        vertices: usize,
        /// Most that are written.
        most: usize,
    },
    /// The file could not be written.
    #[cfg(feature = "files")]
    #[error(transparent)]
    Write(#[from] WriteError),
}

pub(super) fn found(extension: &Option<String>) -> String {
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
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.extension())
    }
}
