//! The formats that are read, and how they are told.

use super::error::LoadError;
use std::path::Path;

/// The formats that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Format {
    /// Binary or text; taken as millimetres.
    Stl,
    /// Millimetres, z up, read in single precision.
    Obj,
    /// glTF, binary or as JSON: metres, +Y up.
    Gltf,
    /// Text or binary; taken as millimetres, z up.
    Ply,
    /// Text; taken as millimetres, z up.
    Off,
    /// One solid of planes and B-spline faces, sampled so that the spline through the samples is
    /// the face; its own unit.
    Step,
    /// All that is built, its own unit.
    ThreeMf,
    /// A height map with its numbers in its text; a block is put under it.
    HeightMapPng,
    /// The same as OpenEXR, with its numbers in its attributes.
    HeightMapExr,
}

impl Format {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Stl,
        Self::Obj,
        Self::Gltf,
        Self::Ply,
        Self::Off,
        Self::Step,
        Self::ThreeMf,
        Self::HeightMapPng,
        Self::HeightMapExr,
    ];

    /// The format of a file, told by its extension: `.stl`, `.obj`, `.glb` or `.gltf`, `.ply`,
    /// `.off`, `.step` or `.stp`, `.3mf`, `.png`, `.exr`.
    ///
    /// # Errors
    /// [`LoadError::UnknownExtension`].
    pub fn from_path(path: &Path) -> Result<Self, LoadError> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        Ok(match extension.as_str() {
            "stl" => Self::Stl,
            "obj" => Self::Obj,
            "glb" | "gltf" => Self::Gltf,
            "ply" => Self::Ply,
            "off" => Self::Off,
            "step" | "stp" => Self::Step,
            "3mf" => Self::ThreeMf,
            "png" => Self::HeightMapPng,
            "exr" => Self::HeightMapExr,
            _ => return Err(LoadError::UnknownExtension { path: path.into() }),
        })
    }
}
