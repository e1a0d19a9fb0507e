//! STEP (ISO 10303-21): one solid of B-spline faces, planes and upright walls, cut into triangles.
//!
//! Edges are sampled once and shared by their two faces, so that the mesh is closed where the solid
//! is. A B-spline face is sampled so that the not-a-knot cubic through the samples, which the
//! verifier traces, is the face itself; of one that its edges trim, the samples beyond them are
//! kept beside the mesh. A solid that does not stand upright is read as if it did, and its mesh is
//! turned back.

mod bspline;
mod builder;
mod conic;
mod fault;
mod net;
mod part21;
mod trimmed;
mod unit;
mod upright;
mod values;
mod wall;

use super::{assemble::Allowance, error::LoadError};
use crate::mesh::{Mesh, TrimmedFace};
use builder::SolidBuilder;
use fault::malformed;
use glam::DMat3;
use part21::Entities;
use std::collections::HashMap;
use values::{reference, references};

/// Parses the one solid of a STEP file.
pub(super) fn parse(bytes: &[u8]) -> Result<Mesh, LoadError> {
    // Names may be of any encoding, and are not needed.
    let text = part21::without_comments(String::from_utf8_lossy(bytes));
    let entities = Entities::parse(&text)?;
    let [brep] = entities.of_kind("MANIFOLD_SOLID_BREP")[..] else {
        return Err(malformed("it does not hold exactly one MANIFOLD_SOLID_BREP"));
    };
    let mut part = SolidBuilder {
        scale: unit::of_solid(&entities, brep)?,
        turn: DMat3::IDENTITY,
        entities,
        allowance: Allowance::of(bytes),
        vertices: Vec::new(),
        triangles: Vec::new(),
        corners: HashMap::new(),
        edges: HashMap::new(),
        trimmed: Vec::new(),
        levels: Vec::new(),
    };
    let shell = reference(&part.entities.expect(brep, "MANIFOLD_SOLID_BREP")?, 1, brep)?;
    let faces = references(&part.entities.expect(shell, "CLOSED_SHELL")?, 1, shell)?;
    let turn = part.upright(&faces).unwrap_or(DMat3::IDENTITY);
    part.turn = turn;
    for face in faces {
        part.face(face)?;
    }
    if part.triangles.is_empty() {
        return Err(LoadError::Empty);
    }
    let rim_z_mm = if let [z] = part.levels[..] { Some(z) } else { None };
    let trimmed = match part.trimmed.pop() {
        Some(face) if part.trimmed.is_empty() => Some(Box::new(TrimmedFace { rim_z_mm, ..face })),
        _ => None,
    };
    if turn != DMat3::IDENTITY {
        part.vertices.iter_mut().for_each(|vertex| *vertex = turn.transpose() * *vertex);
    }
    Ok(Mesh { vertices: part.vertices, triangles: part.triangles, normals: None, trimmed })
}

#[cfg(test)]
mod tests;
