//! Reading solids from files of other programs, none of which is trusted.
//!
//! Every format ends as a [`Mesh`] in the frame of the block: millimetres, light along `+z`,
//! vertices unique by position.

mod assemble;
mod error;
mod format;
mod glb;
mod height_map;
mod obj;
mod off;
mod outlined;
mod plane;
mod ply;
mod polygon;
mod step;
mod stl;
mod three_mf;
mod weld;

pub use error::LoadError;
pub use format::Format;

use crate::mesh::Mesh;
use assemble::Normals;
use error::MOST_MM;
use glam::DVec3;
use std::{fs::File, path::Path};

/// Reads a solid; the [`Format`] is told by the extension.
///
/// # Errors
/// See [`LoadError`].
pub fn read(path: &Path) -> Result<Mesh, LoadError> {
    read_with(path, Normals::Read)
}

/// The same without normals, which take as much time as all the rest: whether there are any, and
/// sound ones, is not found out.
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

/// Reads a solid from memory.
///
/// Memory is bounded by a multiple of the size of the file, whatever it claims; packed formats have
/// the ratio of their packing besides.
///
/// # Errors
/// See [`LoadError`].
pub fn parse(format: Format, bytes: &[u8]) -> Result<Mesh, LoadError> {
    parse_with(format, bytes, None, Normals::Read)
}

/// Reads an STL from memory. Who calls this and not [`parse`] carries no other reader, which in a
/// page is a fifth of all.
///
/// # Errors
/// See [`LoadError`].
pub fn parse_stl(bytes: &[u8]) -> Result<Mesh, LoadError> {
    within_reach(stl::parse(bytes)?)
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
