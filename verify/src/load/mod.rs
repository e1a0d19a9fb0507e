//! Reading solids from files of other programs, none of which is trusted.
//!
//! Every format ends as a [`Mesh`] in the frame of the block: millimetres, light along `+z`, vertices unique by position.

mod glb;
mod height_map;
mod obj;
mod ply;
mod step;
mod stl;
mod three_mf;

use crate::mesh::{CornerNormals, Mesh, Welder};
use glam::DVec3;
use std::path::{Path, PathBuf};

/// Why a file cannot be read.
#[derive(Debug, thiserror::Error)]
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
    #[error("{} is not of a known kind; known are .stl, .obj, .glb, .ply, .step, .3mf, and the height maps .png and .exr", path.display())]
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
    /// Nothing to trace.
    #[error("the file holds no triangles")]
    Empty,
    /// More vertices than indices can tell apart.
    #[error("the file holds more than 4 294 967 294 vertices")]
    TooLarge,
}

/// Reads a solid; the format is told by the extension: `.stl` (binary or text; taken as millimetres), `.obj` (millimetres, z
/// up, read in single precision), `.glb` (metres, +Y up, as glTF has it), `.ply` (text or binary; taken as millimetres, z
/// up), `.step` or `.stp` (one solid of planes and B-spline faces, sampled so that the spline through the samples is the
/// face; its own unit), `.3mf` (one object, its own unit), and height maps in `.png` and `.exr` with their numbers in their
/// metadata (a block is put under them).
///
/// Memory is bounded by a small multiple of the size of the file, whatever it claims.
///
/// # Errors
/// See [`LoadError`].
pub fn read(path: &Path) -> Result<Mesh, LoadError> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let parse: fn(&[u8]) -> Result<Mesh, LoadError> = match extension.as_str() {
        "stl" => stl::parse,
        "obj" => obj::parse,
        "glb" => glb::parse,
        "ply" => ply::parse,
        "step" | "stp" => step::parse,
        "3mf" => three_mf::parse,
        "png" => height_map::parse_png,
        "exr" => height_map::parse_exr,
        _ => return Err(LoadError::UnknownExtension { path: path.into() }),
    };
    let bytes = std::fs::read(path).map_err(|source| LoadError::Read { path: path.into(), source })?;
    parse(&bytes)
}

/// Puts a mesh together from triangles, checking every coordinate.
struct Assembler {
    welder: Welder,
    triangles: Vec<[u32; 3]>,
    normal_corners: Vec<[u32; 3]>,
}

impl Assembler {
    /// `triangles` is a guess that the size of the file supports.
    fn new(triangles: usize) -> Self {
        // A closed mesh has about half as many vertices as triangles.
        Self {
            welder: Welder::with_expected(triangles / 2),
            triangles: Vec::with_capacity(triangles),
            normal_corners: Vec::new(),
        }
    }

    fn triangle(&mut self, corners: [DVec3; 3]) -> Result<(), LoadError> {
        let mut indices = [0; 3];
        for (vertex, (index, position)) in indices.iter_mut().zip(corners).enumerate() {
            if !position.is_finite() {
                return Err(LoadError::NotFinite { triangle: self.triangles.len(), vertex });
            }
            *index = self.welder.index(position).ok_or(LoadError::TooLarge)?;
        }
        self.triangles.push(indices);
        Ok(())
    }

    /// The mesh, with normals if every triangle has got some.
    fn finish(self, directions: Vec<DVec3>) -> Result<Mesh, LoadError> {
        if self.triangles.is_empty() {
            return Err(LoadError::Empty);
        }
        let complete = self.normal_corners.len() == self.triangles.len() && directions.iter().all(|n| n.is_finite());
        let normals = complete.then_some(CornerNormals { directions, corners: self.normal_corners });
        Ok(Mesh { vertices: self.welder.into_vertices(), triangles: self.triangles, normals })
    }
}
