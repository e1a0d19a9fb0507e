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
/// bicubic spline through heights on a rectangle, cut out by a closed curve. In a mesh that stands
/// otherwise all of it is told in coordinates that are turned against those of the mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct TrimmedFace {
    /// Turns the coordinates of the mesh to those in which the face is a height field.
    pub turn: DMat3,
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
                let by = face.turn * by;
                face.lower_mm += by.truncate();
                face.upper_mm += by.truncate();
                face.heights_mm.iter_mut().for_each(|z| *z += by.z);
                face.outline_mm.iter_mut().for_each(|v| *v += by);
                face.rim_z_mm = face.rim_z_mm.map(|z| z + by.z);
            }
        }
        self
    }

    /// The same mesh turned about the origin.
    #[must_use]
    pub(crate) fn turned(mut self, turn: &DMat3) -> Self {
        self.vertices.iter_mut().for_each(|v| *v = *turn * *v);
        if let Some(normals) = &mut self.normals {
            normals.directions.iter_mut().for_each(|n| *n = *turn * *n);
        }
        self.trimmed = self.trimmed.map(|face| Box::new(face.turned(turn)));
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

impl TrimmedFace {
    /// The face of a mesh that is turned about the origin; told in the coordinates of the mesh if
    /// it is a height field in them.
    fn turned(mut self, turn: &DMat3) -> Self {
        self.turn = whole(self.turn * turn.transpose());
        for _ in 0..4 {
            if self.turn == DMat3::IDENTITY || self.turn.z_axis != DVec3::Z {
                break;
            }
            self = self.turned_by_a_quarter();
        }
        self
    }

    /// The same face, told in coordinates that are a quarter further about z.
    fn turned_by_a_quarter(self) -> Self {
        let (nx, ny) = self.nodes;
        Self {
            turn: whole(QUARTER * self.turn),
            lower_mm: DVec2::new(-self.upper_mm.y, self.lower_mm.x),
            upper_mm: DVec2::new(-self.lower_mm.y, self.upper_mm.x),
            nodes: (ny, nx),
            heights_mm: (0..nx * ny).map(|k| self.heights_mm[(ny - 1 - k % ny) * nx + k / ny]).collect(),
            outline_mm: self.outline_mm.into_iter().map(|at| QUARTER * at).collect(),
            rim_z_mm: self.rim_z_mm,
        }
    }
}

/// A quarter turn about z, counter-clockwise.
pub(crate) const QUARTER: DMat3 = DMat3::from_cols(DVec3::Y, DVec3::NEG_X, DVec3::Z);

/// How near to a whole number of quarter turns a turn is taken for one: coordinates then only
/// change places and signs.
const WHOLE: f64 = 1e-6;

/// The turn by whole quarters that is so near to this one, else this one.
pub(crate) fn whole(turn: DMat3) -> DMat3 {
    let rounded = DMat3::from_cols_array(&turn.to_cols_array().map(|part| part.round() + 0.0));
    if (turn - rounded).to_cols_array().iter().all(|part| part.abs() < WHOLE) { rounded } else { turn }
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

    #[test]
    fn a_trimmed_face_is_told_in_the_coordinates_of_its_mesh_where_it_is_a_height_field() {
        let (lower_mm, upper_mm) = (DVec2::new(-1.0, -2.0), DVec2::new(3.0, 4.0));
        let heights_mm = vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
        let outline_mm = vec![DVec3::new(2.0, 1.0, 5.0)];
        let face = TrimmedFace {
            turn: DMat3::IDENTITY,
            lower_mm,
            upper_mm,
            nodes: (3, 2),
            heights_mm,
            outline_mm,
            rim_z_mm: None,
        };
        let quarter = face.clone().turned(&QUARTER);
        assert_eq!((quarter.turn, quarter.nodes), (DMat3::IDENTITY, (2, 3)));
        // The node at (3, -2) comes to (2, 3).
        assert_eq!((quarter.lower_mm, quarter.upper_mm), (DVec2::new(-4.0, -1.0), DVec2::new(2.0, 3.0)));
        assert_eq!(quarter.heights_mm, [3.0, 0.0, 4.0, 1.0, 5.0, 2.0]);
        assert_eq!(quarter.outline_mm, [DVec3::new(-1.0, 2.0, 5.0)]);
        assert_eq!((0..4).fold(face.clone(), |face, _| face.turned(&QUARTER)), face);
        // On its side it is none, and is told as before.
        let side = DMat3::from_axis_angle(DVec3::X, std::f64::consts::FRAC_PI_2);
        let turned = face.clone().turned(&side);
        assert_eq!((&turned.heights_mm, turned.turn), (&face.heights_mm, whole(side.transpose())));
        assert_eq!(turned.turned(&side.transpose()), face);
    }
}
