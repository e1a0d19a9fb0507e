//! What parsers share: what they are asked for, how many points they may make, and how triangles
//! become a mesh.

use super::{error::LoadError, weld::Welder};
use crate::mesh::{CornerNormals, Mesh};
use glam::DVec3;
use std::{io, num::NonZeroU32};

/// What is done with the normals of a file.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Normals {
    Read,
    PassOver,
}

/// What it means that reading fails.
pub(super) type Failed<'a> = &'a dyn Fn(io::Error) -> LoadError;

/// How many points a file may make. Some formats let a few bytes stand for any number of them: one
/// mesh in many places, a spline with one short span.
pub(super) struct Allowance {
    left: usize,
}

impl Allowance {
    /// A point for every byte: files that mean what they say need ten bytes and more for one.
    pub(super) fn of(bytes: &[u8]) -> Self {
        Self::bytes(bytes.len())
    }

    /// The same for so many bytes.
    pub(super) fn bytes(count: usize) -> Self {
        Self { left: count + (1 << 16) }
    }

    /// For more bytes.
    pub(super) fn grow(&mut self, count: usize) {
        self.left = self.left.saturating_add(count);
    }

    pub(super) fn take(&mut self, points: usize, format: &'static str) -> Result<(), LoadError> {
        self.left = self.left.checked_sub(points).ok_or_else(|| LoadError::Malformed {
            format,
            reason: "it asks for more points than it has bytes".into(),
        })?;
        Ok(())
    }
}

/// Points that triangles name by number: each is looked for among the others when it is first met,
/// and only then.
pub(super) struct Points {
    pub(super) positions: Vec<DVec3>,
    /// One more than its index in the mesh.
    indices: Vec<Option<NonZeroU32>>,
}

impl Points {
    pub(super) fn new(positions: Vec<DVec3>) -> Self {
        Self { indices: vec![None; positions.len()], positions }
    }

    pub(super) fn len(&self) -> usize {
        self.positions.len()
    }

    pub(super) fn extend(&mut self, positions: impl Iterator<Item = DVec3>) {
        self.positions.extend(positions);
        self.indices.resize(self.positions.len(), None);
    }
}

/// Puts a mesh together from triangles, checking every coordinate.
pub(super) struct Assembler {
    welder: Welder,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) normal_corners: Vec<[u32; 3]>,
}

impl Assembler {
    /// `triangles` is a guess that the size of the file supports.
    pub(super) fn new(triangles: usize) -> Self {
        // A closed mesh has about half as many vertices as triangles.
        Self {
            welder: Welder::with_expected(triangles / 2),
            triangles: Vec::with_capacity(triangles),
            normal_corners: Vec::new(),
        }
    }

    pub(super) fn triangle(&mut self, corners: [DVec3; 3]) -> Result<(), LoadError> {
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

    /// A triangle of points that are told by their numbers; the error for a number that is no
    /// point's is the caller's.
    pub(super) fn numbered(
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
    pub(super) fn finish(mut self, directions: Vec<DVec3>) -> Result<Mesh, LoadError> {
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
