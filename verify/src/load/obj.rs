//! Wavefront OBJ.

use super::{Assembler, LoadError};
use crate::mesh::Mesh;
use glam::DVec3;

/// Parses the geometry of an OBJ file, all objects together; polygons are cut into fans, materials are passed over.
pub(super) fn parse(mut bytes: &[u8]) -> Result<Mesh, LoadError> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..tobj::LoadOptions::default()
    };
    let no_materials = |_: &std::path::Path| Ok(Default::default());
    let (models, _) = tobj::load_obj_buf(&mut bytes, &options, no_materials)
        .map_err(|error| LoadError::Malformed { format: "OBJ", reason: error.to_string() })?;
    let count = models.iter().map(|m| m.mesh.indices.len() / 3).sum();
    let mut assembler = Assembler::new(count);
    let mut directions = Vec::new();
    for model in &models {
        let mesh = &model.mesh;
        let vector = |of: &[f32], k: u32| {
            of.get(3 * k as usize..3 * k as usize + 3)
                .map(|v| DVec3::new(v[0].into(), v[1].into(), v[2].into()))
                .ok_or_else(|| LoadError::Malformed { format: "OBJ", reason: format!("index {k} points at nothing") })
        };
        let first_normal = directions.len() as u32;
        for k in 0..mesh.normals.len() / 3 {
            directions.push(vector(&mesh.normals, k as u32)?);
        }
        for corners in mesh.indices.chunks_exact(3) {
            let [a, b, c] = [corners[0], corners[1], corners[2]].map(|k| vector(&mesh.positions, k));
            assembler.triangle([a?, b?, c?])?;
        }
        for corners in mesh.normal_indices.chunks_exact(3) {
            let corners = [corners[0], corners[1], corners[2]];
            for k in corners {
                vector(&mesh.normals, k)?;
            }
            assembler.normal_corners.push(corners.map(|k| first_normal + k));
        }
    }
    assembler.finish(directions)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quads_objects_and_normals_are_read() {
        let mesh = parse(
            b"mtllib none.mtl\no a\nv 0 0 0\nv 1 0 0\nv 1 1 0.25\nv 0 1 0\nvn 0 0 1\nvn 0 0 -1\nf 1//1 2//1 3//1 4//1\no b\nf 3//2 2//2 1//2\n",
        )
        .unwrap();
        assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (4, 3));
        assert_eq!(mesh.vertices[2], DVec3::new(1.0, 1.0, 0.25));
        let normals = mesh.normals.unwrap();
        assert_eq!(normals.directions[normals.corners[0][1] as usize], DVec3::Z);
        assert_eq!(normals.directions[normals.corners[2][0] as usize], DVec3::NEG_Z);
    }

    #[test]
    fn broken_files_are_named() {
        for broken in
            [&b"v 0 0 0\nf 1 2 3\n"[..], b"v a b c\n", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -9\n", b"\xff\xfe\n"]
        {
            assert!(matches!(parse(broken), Err(LoadError::Malformed { .. })), "{:?}", parse(broken));
        }
        assert!(matches!(parse(b"# nothing\n"), Err(LoadError::Empty)));
        assert!(matches!(parse(b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), Err(LoadError::NotFinite { .. })));
    }
}
