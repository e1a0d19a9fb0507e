//! Binary glTF: metres and +Y up, turned into the frame of the block.

use super::{Allowance, Assembler, LoadError, Normals, Points};
use crate::mesh::Mesh;
use glam::{DMat3, DMat4, DVec3};
use gltf::{
    Accessor, Document, Node, Primitive,
    accessor::{DataType, Dimensions},
    binary::Glb,
    mesh::Mode,
};

fn malformed(reason: impl Into<String>) -> LoadError {
    LoadError::Malformed { format: "GLB", reason: reason.into() }
}

/// From glTF's axes to ours: x stays, z is up, y goes away from glTF's viewer.
fn to_frame(v: DVec3) -> DVec3 {
    DVec3::new(v.x, -v.z, v.y)
}

/// Parses all triangles of the default scene (the first one, if none is named) with the transformations of their nodes.
pub(super) fn parse(bytes: &[u8], normals: Normals) -> Result<Mesh, LoadError> {
    let Glb { json, bin, .. } = Glb::from_slice(bytes).map_err(|error| malformed(error.to_string()))?;
    let document = document(&json)?;
    let blob = bin.ok_or_else(|| malformed("it has no binary chunk"))?;
    let Some(scene) = document.default_scene().or_else(|| document.scenes().next()) else {
        return Err(malformed("it has no scene"));
    };
    let (mut assembler, mut allowance) = (Assembler::new(0), Allowance::of(bytes));
    let mut directions = Vec::new();
    let mut waiting: Vec<(Node<'_>, DMat4)> = scene.nodes().map(|node| (node, DMat4::IDENTITY)).collect();
    let mut visits = 0;
    while let Some((node, parent)) = waiting.pop() {
        // A node belongs to one parent at most: more visits than nodes mean a cycle.
        visits += 1;
        if visits > document.nodes().len() {
            return Err(malformed("its nodes are no tree"));
        }
        let local = DMat4::from_cols_array_2d(&node.transform().matrix().map(|column| column.map(f64::from)));
        let placed = parent * local;
        for primitive in node.mesh().into_iter().flat_map(|mesh| mesh.primitives().collect::<Vec<_>>()) {
            allowance.take(points(&primitive), "GLB")?;
            add(&primitive, &blob, (placed, normals), &mut assembler, &mut directions)?;
        }
        waiting.extend(node.children().map(|child| (child, placed)));
    }
    assembler.finish(directions)
}

/// The JSON of the file, validated.
fn document(json: &[u8]) -> Result<Document, LoadError> {
    let root = gltf::json::Root::from_slice(json).map_err(|error| malformed(error.to_string()))?;
    // The validation below takes these for granted.
    for primitive in root.meshes.iter().flat_map(|mesh| &mesh.primitives) {
        if let Some(index) = primitive.attributes.values().find(|index| index.value() >= root.accessors.len()) {
            return Err(malformed(format!("there is no accessor {}", index.value())));
        }
    }
    Document::from_json(root).map_err(|error| malformed(error.to_string()))
}

/// Points that a primitive makes: its positions and its corners.
fn points(primitive: &Primitive<'_>) -> usize {
    let count = |accessor: Option<Accessor<'_>>| accessor.map_or(0, |accessor| accessor.count());
    count(primitive.get(&gltf::Semantic::Positions)).saturating_add(count(primitive.indices()))
}

fn add(
    primitive: &Primitive<'_>,
    blob: &[u8],
    (placed, wanted): (DMat4, Normals),
    assembler: &mut Assembler,
    directions: &mut Vec<DVec3>,
) -> Result<(), LoadError> {
    if primitive.mode() != Mode::Triangles {
        return Err(malformed(format!("primitives of kind {:?} are not triangles", primitive.mode())));
    }
    let positions =
        primitive.get(&gltf::Semantic::Positions).ok_or_else(|| malformed("a primitive has no positions"))?;
    check(&positions, blob, Dimensions::Vec3, &[DataType::F32])?;
    let normals = primitive.get(&gltf::Semantic::Normals);
    if let Some(normals) = &normals {
        check(normals, blob, Dimensions::Vec3, &[DataType::F32])?;
        if normals.count() != positions.count() {
            return Err(malformed("a primitive has another number of normals than of positions"));
        }
    }
    if let Some(indices) = primitive.indices() {
        check(&indices, blob, Dimensions::Scalar, &[DataType::U8, DataType::U16, DataType::U32])?;
    }
    let reader = primitive.reader(|buffer| (buffer.index() == 0).then_some(blob));
    let vector = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    let positions: Vec<DVec3> = reader
        .read_positions()
        .ok_or_else(|| malformed("positions cannot be read"))?
        .map(|v| 1000.0 * to_frame(placed.transform_point3(vector(v))))
        .collect();
    let count = positions.len();
    let mut points = Points::new(positions);
    let indices: Vec<u32> = match reader.read_indices() {
        Some(indices) => indices.into_u32().collect(),
        None => (0..count as u32).collect(),
    };
    if !indices.len().is_multiple_of(3) {
        return Err(malformed(format!("{} indices are not triples", indices.len())));
    }
    let first_normal = u32::try_from(directions.len()).map_err(|_| LoadError::TooLarge)?;
    let normals = reader.read_normals().filter(|_| wanted == Normals::Read);
    let with_normals = normals.is_some();
    if let Some(normals) = normals {
        let turned = DMat3::from_mat4(placed).inverse().transpose();
        directions.extend(normals.map(|v| to_frame(turned * vector(v)).normalize_or_zero()));
    }
    // A mirroring transformation turns triangles inside out.
    let mirrored = placed.determinant() < 0.0;
    for corners in indices.chunks_exact(3) {
        let corners =
            if mirrored { [corners[0], corners[2], corners[1]] } else { [corners[0], corners[1], corners[2]] };
        let nothing = |k| malformed(format!("index {k} points at nothing"));
        assembler.numbered(&mut points, corners.map(|k| k as usize), nothing)?;
        if with_normals {
            assembler.normal_corners.push(corners.map(|k| first_normal + k));
        }
    }
    Ok(())
}

/// Everything that the reader takes for granted.
fn check(accessor: &Accessor<'_>, blob: &[u8], dimensions: Dimensions, types: &[DataType]) -> Result<(), LoadError> {
    let (kind, shape) = (accessor.data_type(), accessor.dimensions());
    if shape != dimensions || !types.contains(&kind) {
        return Err(malformed(format!(
            "accessor {} holds {shape:?} of {kind:?}, which is not supported",
            accessor.index()
        )));
    }
    if accessor.sparse().is_some() {
        return Err(malformed(format!("accessor {} is sparse, which is not supported", accessor.index())));
    }
    let fits = accessor.view().is_some_and(|view| {
        let stride = view.stride().unwrap_or(accessor.size());
        let last = accessor.count().checked_sub(1).and_then(|n| n.checked_mul(stride));
        let needed = last.and_then(|n| n.checked_add(accessor.size())).and_then(|n| n.checked_add(accessor.offset()));
        let end = view.offset().checked_add(view.length());
        let in_blob = matches!(view.buffer().source(), gltf::buffer::Source::Bin);
        in_blob
            && stride >= accessor.size()
            && needed.is_some_and(|n| n <= view.length())
            && end.is_some_and(|n| n <= blob.len())
    });
    if fits { Ok(()) } else { Err(malformed(format!("accessor {} does not fit into the file", accessor.index()))) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One triangle with normals: 3 positions, 3 normals, 3 indices of 16 bits.
    fn triangle(json: &str) -> Vec<u8> {
        let mut bin: Vec<u8> = Vec::new();
        // Frame (X, Y, Z) mm is stored as (X, Z, -Y) / 1000.
        for v in [[0.0f32, 0.004, 0.0], [0.001, 0.004, 0.0], [0.0, 0.004, -0.002]] {
            v.iter().for_each(|c| bin.extend(c.to_le_bytes()));
        }
        for _ in 0..3 {
            [0.0f32, 1.0, 0.0].iter().for_each(|c| bin.extend(c.to_le_bytes()));
        }
        [0u16, 1, 2, 0].iter().for_each(|k| bin.extend(k.to_le_bytes()));
        let mut json = json.to_owned().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut glb = b"glTF".to_vec();
        glb.extend(2u32.to_le_bytes());
        glb.extend(((12 + 8 + json.len() + 8 + bin.len()) as u32).to_le_bytes());
        glb.extend((json.len() as u32).to_le_bytes());
        glb.extend(b"JSON");
        glb.extend(json);
        glb.extend((bin.len() as u32).to_le_bytes());
        glb.extend(b"BIN\0");
        glb.extend(bin);
        glb
    }

    const JSON: &str = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1},"indices":2}]}],
        "buffers":[{"byteLength":80}],
        "bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":36},{"buffer":0,"byteOffset":72,"byteLength":6}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0.004,-0.002],"max":[0.001,0.004,0]},
        {"bufferView":1,"componentType":5126,"count":3,"type":"VEC3"},{"bufferView":2,"componentType":5123,"count":3,"type":"SCALAR"}]}"#;

    #[test]
    fn metres_with_y_up_become_millimetres_with_z_up() {
        let mesh = parse(&triangle(JSON), Normals::Read).unwrap();
        let expected = [DVec3::new(0.0, 0.0, 4.0), DVec3::new(1.0, 0.0, 4.0), DVec3::new(0.0, 2.0, 4.0)];
        for (ours, theirs) in mesh.vertices.iter().zip(expected) {
            assert!((*ours - theirs).length() < 1e-6);
        }
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
        assert_eq!(mesh.normals.unwrap().directions, [DVec3::Z; 3]);
    }

    #[test]
    fn node_transformations_apply() {
        let json = JSON.replace(r#"{"mesh":0}"#, r#"{"mesh":0,"scale":[2,2,2],"translation":[0,0.01,0]}"#);
        let mesh = parse(&triangle(&json), Normals::Read).unwrap();
        assert!((mesh.vertices[2] - DVec3::new(0.0, 4.0, 18.0)).length() < 1e-5);
    }

    #[test]
    fn broken_files_are_named() {
        for (from, to) in [
            (r#""count":3,"type":"SCALAR""#, r#""count":4000000000,"type":"SCALAR""#),
            (r#""componentType":5126,"count":3,"type":"VEC3"}"#, r#""componentType":5121,"count":3,"type":"VEC3"}"#),
            (r#""byteOffset":36,"byteLength":36"#, r#""byteOffset":360,"byteLength":36"#),
            (r#""nodes":[{"mesh":0}]"#, r#""nodes":[{"mesh":0,"children":[0]}]"#),
            (r#""byteLength":36},"#, r#""byteLength":36,"byteStride":4},"#),
            (r#""indices":2"#, r#""indices":2,"mode":1"#),
        ] {
            assert!(JSON.contains(from), "{from}");
            let broken = triangle(&JSON.replacen(from, to, 1));
            assert!(matches!(parse(&broken, Normals::Read), Err(LoadError::Malformed { .. })), "{to}");
        }
        let good = triangle(JSON);
        for length in 0..good.len() {
            assert!(parse(&good[..length], Normals::Read).is_err(), "cut to {length} bytes");
        }
    }
}
