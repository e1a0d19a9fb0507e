//! An indexed triangle mesh, as it was read from a file.

use glam::{DMat3, DVec2, DVec3};

/// A triangle mesh in the frame of the block: millimetres, light along `+z`.
///
/// Vertices are unique by position, so that neighbouring triangles share indices whatever the file
/// did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Positions, mm.
    pub vertices: Vec<DVec3>,
    /// Corners of every triangle, counter-clockwise as seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Normals of the corners, where the file has them.
    pub normals: Option<CornerNormals>,
    /// The face towards the receiver, where the file has it as a surface that a curve cuts out.
    pub trimmed: Option<Box<TrimmedFace>>,
}

/// A face that a file holds as one surface, known within its outline and beyond: the not-a-knot
/// bicubic spline through heights on a rectangle, cut out by a closed curve.
#[derive(Clone, Debug, PartialEq)]
pub struct TrimmedFace {
    /// Least x and y of the rectangle, mm.
    pub lower_mm: DVec2,
    /// Greatest x and y, mm.
    pub upper_mm: DVec2,
    /// Nodes along x and y, edge to edge.
    pub nodes: (usize, usize),
    /// Heights at the nodes, mm, row-major: rows along `+y`.
    pub heights_mm: Vec<f64>,
    /// Points of the curve, counter-clockwise, mm.
    pub outline_mm: Vec<DVec3>,
    /// The level plane around the face, mm, if there is one.
    pub rim_z_mm: Option<f64>,
}

/// Normals of the corners of every triangle: a vertex on an edge of the block has one for each
/// face.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CornerNormals {
    /// Directions, of about unit length.
    pub directions: Vec<DVec3>,
    /// For every triangle, the index of each corner's normal.
    pub corners: Vec<[u32; 3]>,
}

impl Mesh {
    /// Positions of the corners of triangle `k`, mm.
    #[inline]
    pub fn corners(&self, k: usize) -> [DVec3; 3] {
        self.triangles[k].map(|v| self.vertices[v as usize])
    }

    /// Least and greatest corner of the bounding box, mm. Inverted (infinite) without vertices.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        self.vertices.iter().fold(empty, |(lo, hi), &v| (lo.min(v), hi.max(v)))
    }

    /// The same mesh elsewhere.
    #[must_use]
    pub fn moved(mut self, by: DVec3) -> Self {
        if by != DVec3::ZERO {
            self.vertices.iter_mut().for_each(|v| *v += by);
            if let Some(face) = &mut self.trimmed {
                face.lower_mm += by.truncate();
                face.upper_mm += by.truncate();
                face.heights_mm.iter_mut().for_each(|z| *z += by.z);
                face.outline_mm.iter_mut().for_each(|v| *v += by);
                face.rim_z_mm = face.rim_z_mm.map(|z| z + by.z);
            }
        }
        self
    }

    /// The same mesh turned about the origin, without the surface of its face towards the receiver.
    #[must_use]
    pub(crate) fn turned(mut self, turn: &DMat3) -> Self {
        self.vertices.iter_mut().for_each(|v| *v = *turn * *v);
        if let Some(normals) = &mut self.normals {
            normals.directions.iter_mut().for_each(|n| *n = *turn * *n);
        }
        self.trimmed = None;
        self
    }

    /// Turns every triangle round.
    pub(crate) fn turn_inside_out(&mut self) {
        let corners = self.normals.iter_mut().flat_map(|normals| &mut normals.corners);
        self.triangles.iter_mut().chain(corners).for_each(|[_, b, c]| std::mem::swap(b, c));
    }

    /// Enclosed volume, mm³; negative where the triangles face inwards. Exact to rounding for any
    /// closed mesh.
    pub fn volume_mm3(&self) -> f64 {
        // About a point of the mesh, so that a block far from the origin loses no digits.
        let Some(&origin) = self.vertices.first() else { return 0.0 };
        let sum: f64 = (0..self.triangles.len())
            .map(|k| {
                let [a, b, c] = self.corners(k).map(|p| p - origin);
                a.dot(b.cross(c))
            })
            .sum();
        sum / 6.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_volume_of_a_tetrahedron_is_exact_wherever_it_stands() {
        for shift in [DVec3::ZERO, DVec3::new(300.0, -200.0, 500.0)] {
            let vertices = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|v| v + shift).to_vec();
            let triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
            let mesh = Mesh { vertices, triangles, ..Mesh::default() };
            assert!((mesh.volume_mm3() - 1.0 / 6.0).abs() < 1e-13);
        }
    }
}
