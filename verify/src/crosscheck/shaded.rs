//! The file's own triangles with the normals that renderers shall interpolate.

use crate::{
    block::{Block, node_normals},
    mesh::Mesh,
};
use glam::{DVec2, DVec3, Vec3};

/// A mesh with one normal per vertex, in the single precision of renderers. Where the exit face
/// meets a wall the vertices stand twice, or more often.
#[derive(Clone, Debug)]
pub(super) struct ShadedMesh {
    pub(super) positions: Vec<Vec3>,
    pub(super) normals: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl ShadedMesh {
    /// The triangles of `mesh`, in which `block` was recognised: nodes of the exit face have the
    /// normals that the verifier interpolates, everything else is flat. Of a face that is no
    /// rectangle, the vertices on its outline have the spline's.
    pub(super) fn new(mesh: &Mesh, block: &Block) -> Self {
        let (lower, size) = (block.exit.lower, block.size_mm());
        let of_nodes = node_normals(block);
        let cell = size / DVec2::new((block.exit.nx - 1) as f64, (block.exit.ny - 1) as f64);
        let outlined = block.outline().map(|_| block.exit.spline());
        // Half a cell, seen from above: walls have no plan, and a rim has another place.
        let of_exit_face = |[a, b, c]: [DVec3; 3]| {
            if outlined.is_some() {
                // Less of one between the last nodes and the outline.
                let faces_up = (b - a).truncate().perp_dot((c - a).truncate()) > 0.0;
                return faces_up && block.covers((a + b + c).truncate() / 3.0);
            }
            let at_home = |p: DVec3| {
                let from = p.truncate() - lower;
                (from + 0.25 * cell).min_element() >= 0.0 && (from - size).cmple(0.25 * cell).all()
            };
            let plan = (b - a).truncate().perp_dot((c - a).truncate());
            plan > 0.5 * cell.x * cell.y && at_home(a) && at_home(b) && at_home(c)
        };
        let normal = |v: DVec3| {
            if let Some(spline) = &outlined {
                let jet = spline.jet(v.x, v.y);
                return DVec3::new(-jet.zx, -jet.zy, 1.0).normalize();
            }
            let i = ((v.x - lower.x) / size.x * (block.exit.nx - 1) as f64).round() as usize;
            let j = ((v.y - lower.y) / size.y * (block.exit.ny - 1) as f64).round() as usize;
            of_nodes[j * block.exit.nx + i]
        };
        let mut shared = vec![u32::MAX; mesh.vertices.len()];
        let mut made = Self { positions: Vec::new(), normals: Vec::new(), triangles: Vec::new() };
        for (k, triangle) in mesh.triangles.iter().enumerate() {
            let corners = mesh.corners(k);
            let of_exit = of_exit_face(corners);
            let flat = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
            let mut indices = [0; 3];
            for (index, (&v, &corner)) in indices.iter_mut().zip(triangle.iter().zip(&corners)) {
                *index = if !of_exit {
                    made.push(corner, flat)
                } else {
                    let place = &mut shared[v as usize];
                    if *place == u32::MAX {
                        *place = made.push(corner, normal(corner));
                    }
                    *place
                };
            }
            made.triangles.push(indices);
        }
        made
    }

    fn push(&mut self, position: DVec3, normal: DVec3) -> u32 {
        self.positions.push(position.as_vec3());
        self.normals.push(normal.as_vec3());
        (self.positions.len() - 1) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_have_the_faces_normals_and_a_rim_stays_flat() {
        let (n, cells) = (5usize, 4.0);
        let at = |i: usize, j: usize| DVec3::new(i as f64 - 2.0, j as f64 - 2.0, 0.1 * i as f64);
        let vertices: Vec<DVec3> = (0..n * n).map(|k| at(k % n, k / n)).collect();
        let mut triangles = Vec::new();
        for k in (0..n * (n - 1)).filter(|k| k % n + 1 < n) {
            let [a, b, c, d] = [k, k + 1, k + n + 1, k + n].map(|v| v as u32);
            triangles.extend([[a, b, c], [a, c, d]]);
        }
        let of_exit = triangles.len();
        let mut mesh = Mesh { vertices, triangles, ..Mesh::default() };
        // A piece of a rim beside the face and a wall down to it, all above the entry face.
        let edge = mesh.vertices.len() as u32;
        let v = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        mesh.vertices.extend([v(2.0, -2.0, -1.0), v(9.0, -2.0, -1.0), v(9.0, 2.0, -1.0), v(2.0, 2.0, -1.0)]);
        mesh.triangles.extend([[edge, edge + 1, edge + 2], [edge, edge + 2, edge + 3], [4, edge, 24]]);
        let heights = (0..n * n).map(|k| at(k % n, k / n).z).collect();
        let block = Block::from_heights(DVec2::splat(cells), -5.0, (n, n), heights).unwrap();
        let shaded = ShadedMesh::new(&mesh, &block);
        let leaning = DVec3::new(-0.1, 0.0, 1.0).normalize().as_vec3();
        for (k, corners) in shaded.triangles.iter().enumerate() {
            let wanted = if k < of_exit {
                leaning
            } else if k < of_exit + 2 {
                Vec3::Z
            } else {
                Vec3::X
            };
            for &corner in corners {
                assert!((shaded.normals[corner as usize] - wanted).length() < 1e-6, "triangle {k}");
            }
        }
    }
}
