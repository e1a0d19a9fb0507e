//! Why a file is no solid.

use std::path::PathBuf;

/// Why a file cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// The file system refused.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Not one of the formats.
    #[error("{} is not of a known kind; known are .stl, .obj, .glb, .gltf, .ply, .off, .step, .3mf, and the height maps .png and .exr", path.display())]
    UnknownExtension {
        /// Which file.
        path: PathBuf,
    },
    /// The file ends too early.
    #[error("the file is truncated: its header promises {promised} triangles, and it holds {held}")]
    Truncated {
        /// Triangles in the header.
        promised: u64,
        /// Triangles in the file.
        held: u64,
    },
    /// The file breaks the rules of its format.
    #[error("not a valid {format} file: {reason}")]
    Malformed {
        /// Name of the format.
        format: &'static str,
        /// What is wrong.
        reason: String,
    },
    /// A coordinate is not a number.
    #[error("vertex {vertex} of triangle {triangle} has a coordinate that is not finite")]
    NotFinite {
        /// Index of the triangle.
        triangle: usize,
        /// Which of its corners.
        vertex: usize,
    },
    /// A coordinate is no place of anything.
    #[error(
        "vertex {vertex} of triangle {triangle} has a coordinate of {value_mm:e} mm; up to {MOST_MM:e} mm are taken"
    )]
    TooFar {
        /// Index of the triangle.
        triangle: usize,
        /// Which of its corners.
        vertex: usize,
        /// The greatest of its coordinates, mm.
        value_mm: f64,
    },
    /// Nothing to trace.
    #[error("the file holds no triangles")]
    Empty,
    /// More vertices than indices can tell apart.
    #[error("the file holds more than 4 294 967 294 vertices")]
    TooLarge,
}

/// Greatest coordinate, mm: squares and cubes of it are numbers in single precision too.
pub(super) const MOST_MM: f64 = 1e9;

impl LoadError {
    /// A file that breaks the rules of its format.
    pub(super) fn malformed(format: &'static str, reason: impl Into<String>) -> Self {
        Self::Malformed { format, reason: reason.into() }
    }
}
