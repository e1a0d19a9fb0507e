//! Reading solids from files of other programs, none of which is trusted.
//!
//! Every format ends as a [`Mesh`] in the frame of the block: millimetres, light along `+z`, vertices unique by position.

mod glb;
mod height_map;
mod obj;
mod off;
mod outlined;
mod ply;
mod polygon;
mod step;
mod stl;
mod three_mf;

use crate::mesh::{CornerNormals, Mesh, Welder};
use glam::DVec3;
use std::{
    fs::File,
    io,
    num::NonZeroU32,
    path::{Path, PathBuf},
};

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
const MOST_MM: f64 = 1e9;

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
    /// One solid of planes and B-spline faces, sampled so that the spline through the samples is the face; its own unit.
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

    /// The format of a file, told by its extension: `.stl`, `.obj`, `.glb` or `.gltf`, `.ply`, `.off`, `.step` or
    /// `.stp`, `.3mf`, `.png`, `.exr`.
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

/// Reads a solid; the [`Format`] is told by the extension.
///
/// # Errors
/// See [`LoadError`].
pub fn read(path: &Path) -> Result<Mesh, LoadError> {
    read_with(path, Normals::Read)
}

/// The same without normals, which take as much time as all the rest: whether there are any, and sound ones, is not found out.
///
/// # Errors
/// See [`LoadError`].
pub fn read_bare(path: &Path) -> Result<Mesh, LoadError> {
    read_with(path, Normals::PassOver)
}

fn read_with(path: &Path, normals: Normals) -> Result<Mesh, LoadError> {
    let format = Format::from_path(path)?;
    let failed = |source| LoadError::Read { path: path.into(), source };
    let mut file = File::open(path).map_err(failed)?;
    let about = file.metadata().map_err(failed)?;
    // The large ones, piece by piece: memory that is new to a process takes more time than parsing.
    let mesh = match format {
        Format::Stl if about.is_file() => stl::stream(&mut file, about.len(), &failed)?,
        Format::Obj if about.is_file() => obj::stream(&mut file, normals, &failed)?,
        _ => None,
    };
    match mesh {
        Some(mesh) => within_reach(mesh),
        None => parse_with(format, &std::fs::read(path).map_err(failed)?, path.parent(), normals),
    }
}

/// What is done with the normals of a file.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Normals {
    Read,
    PassOver,
}

/// What it means that reading fails.
type Failed<'a> = &'a dyn Fn(io::Error) -> LoadError;

/// Reads a solid from memory.
///
/// Memory is bounded by a multiple of the size of the file, whatever it claims; packed formats have the ratio of their packing
/// besides.
///
/// # Errors
/// See [`LoadError`].
pub fn parse(format: Format, bytes: &[u8]) -> Result<Mesh, LoadError> {
    parse_with(format, bytes, None, Normals::Read)
}

/// `folder` is where files that this one names are looked for.
fn parse_with(format: Format, bytes: &[u8], folder: Option<&Path>, normals: Normals) -> Result<Mesh, LoadError> {
    let mesh = match format {
        Format::Stl => stl::parse(bytes),
        Format::Obj => obj::parse(bytes, normals),
        Format::Gltf => glb::parse(bytes, folder, normals),
        Format::Ply => ply::parse(bytes),
        Format::Off => off::parse(bytes, normals),
        Format::Step => step::parse(bytes),
        Format::ThreeMf => three_mf::parse(bytes),
        Format::HeightMapPng => height_map::parse_png(bytes),
        Format::HeightMapExr => height_map::parse_exr(bytes),
    }?;
    within_reach(if normals == Normals::Read { mesh } else { Mesh { normals: None, ..mesh } })
}

/// Demands that all coordinates are those of things.
fn within_reach(mesh: Mesh) -> Result<Mesh, LoadError> {
    let far = |v: DVec3| v.abs().max_element() > MOST_MM;
    if !mesh.vertices.iter().any(|&v| far(v)) {
        return Ok(mesh);
    }
    let found = (0..mesh.triangles.len()).find_map(|triangle| {
        let corners = mesh.corners(triangle);
        let vertex = corners.iter().position(|&v| far(v))?;
        Some(LoadError::TooFar { triangle, vertex, value_mm: corners[vertex].abs().max_element() })
    });
    // One that no triangle uses.
    found.map_or(Ok(mesh), Err)
}

/// How many points a file may make. Some formats let a few bytes stand for any number of them: one mesh in many places, a spline
/// with one short span.
struct Allowance {
    left: usize,
}

impl Allowance {
    /// A point for every byte: files that mean what they say need ten bytes and more for one.
    fn of(bytes: &[u8]) -> Self {
        Self::bytes(bytes.len())
    }

    /// The same for so many bytes.
    fn bytes(count: usize) -> Self {
        Self { left: count + (1 << 16) }
    }

    /// For more bytes.
    fn grow(&mut self, count: usize) {
        self.left = self.left.saturating_add(count);
    }

    fn take(&mut self, points: usize, format: &'static str) -> Result<(), LoadError> {
        self.left = self.left.checked_sub(points).ok_or_else(|| LoadError::Malformed {
            format,
            reason: "it asks for more points than it has bytes".into(),
        })?;
        Ok(())
    }
}

/// Points that triangles name by number: each is looked for among the others when it is first met, and only then.
struct Points {
    positions: Vec<DVec3>,
    /// One more than its index in the mesh.
    indices: Vec<Option<NonZeroU32>>,
}

impl Points {
    fn new(positions: Vec<DVec3>) -> Self {
        Self { indices: vec![None; positions.len()], positions }
    }

    fn len(&self) -> usize {
        self.positions.len()
    }

    fn extend(&mut self, positions: impl Iterator<Item = DVec3>) {
        self.positions.extend(positions);
        self.indices.resize(self.positions.len(), None);
    }
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

    /// A triangle of points that are told by their numbers; the error for a number that is no point's is the caller's.
    fn numbered(
        &mut self,
        points: &mut Points,
        corners: [usize; 3],
        nothing: impl Fn(usize) -> LoadError,
    ) -> Result<(), LoadError> {
        let mut indices = [0; 3];
        for (vertex, (index, k)) in indices.iter_mut().zip(corners).enumerate() {
            let (Some(known), Some(&position)) = (points.indices.get_mut(k), points.positions.get(k)) else {
                return Err(nothing(k));
            };
            *index = match known {
                Some(index) => index.get() - 1,
                None => {
                    if !position.is_finite() {
                        return Err(LoadError::NotFinite { triangle: self.triangles.len(), vertex });
                    }
                    let index = self.welder.index_of_few(position).ok_or(LoadError::TooLarge)?;
                    *known = NonZeroU32::new(index + 1);
                    index
                }
            };
        }
        self.triangles.push(indices);
        Ok(())
    }

    /// The mesh, with normals if every triangle has got some.
    fn finish(mut self, directions: Vec<DVec3>) -> Result<Mesh, LoadError> {
        if self.triangles.is_empty() {
            return Err(LoadError::Empty);
        }
        let complete = self.normal_corners.len() == self.triangles.len() && directions.iter().all(|n| n.is_finite());
        let normals = complete.then_some(CornerNormals { directions, corners: self.normal_corners });
        let (vertices, renumbered) = self.welder.finish();
        renumbered.apply(&mut self.triangles);
        Ok(Mesh { vertices, triangles: self.triangles, normals, trimmed: None })
    }
}
