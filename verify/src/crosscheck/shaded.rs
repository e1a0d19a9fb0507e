//! The file's own triangles with the normals that renderers shall interpolate.

use crate::{block::Block, mesh::Mesh, shading::node_normals};
use glam::{DVec3, Vec3};

/// A mesh with one normal per vertex, in the single precision of renderers. Where the exit face meets a wall the
/// vertices stand twice, or more often.
#[derive(Clone, Debug)]
pub(super) struct ShadedMesh {
    pub(super) positions: Vec<Vec3>,
    pub(super) normals: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl ShadedMesh {
    /// The triangles of `mesh`, in which `block` was recognised: nodes of the exit face have the normals that the verifier
    /// interpolates, everything else is flat.
    pub(super) fn new(mesh: &Mesh, block: &Block) -> Self {
        let (lower, size) = (block.lower, block.size_mm());
        let of_nodes = node_normals(block);
        // As in the recognition of blocks, where everything above the entry plane was found to be a node.
        let entry = block.entry_z + 1e-5 * size.max_element().max(block.entry_z.abs());
        let node = |v: DVec3| {
            let i = ((v.x - lower.x) / size.x * (block.nx - 1) as f64).round() as usize;
            let j = ((v.y - lower.y) / size.y * (block.ny - 1) as f64).round() as usize;
            j * block.nx + i
        };
        let mut shared = vec![u32::MAX; mesh.vertices.len()];
        let mut made = Self { positions: Vec::new(), normals: Vec::new(), triangles: Vec::new() };
        for (k, triangle) in mesh.triangles.iter().enumerate() {
            let corners = mesh.corners(k);
            let of_exit = corners.iter().all(|c| c.z > entry);
            let flat = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
            let mut indices = [0; 3];
            for (index, (&v, &corner)) in indices.iter_mut().zip(triangle.iter().zip(&corners)) {
                *index = if !of_exit {
                    made.push(corner, flat)
                } else {
                    let place = &mut shared[v as usize];
                    if *place == u32::MAX {
                        *place = made.push(corner, of_nodes[node(corner)]);
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
