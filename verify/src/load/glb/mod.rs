//! glTF, binary or as JSON with its buffers: metres and +Y up, turned into the frame of the block.

mod accessor;
mod buffers;
mod fault;

use super::{
    assemble::{Allowance, Assembler, Normals, Points},
    error::LoadError,
};
use crate::mesh::Mesh;
use accessor::values;
use buffers::Buffers;
use fault::malformed;
use glam::{DMat3, DMat4, DQuat, DVec3};
use gltf::{
    Accessor, Document, Node, Primitive, Semantic,
    accessor::DataType,
    binary::Glb,
    json::{Root, validation::Checked},
    mesh::Mode,
    scene::Transform,
};
use std::path::Path;

/// From glTF's axes to ours: x stays, z is up, y goes away from glTF's viewer.
fn to_frame(v: DVec3) -> DVec3 {
    DVec3::new(v.x, -v.z, v.y)
}

/// Parses all triangles of the default scene (the first one, if none is named) with the
/// transformations of their nodes. Buffers of their own files are looked for in `folder`.
pub(super) fn parse(bytes: &[u8], folder: Option<&Path>, normals: Normals) -> Result<Mesh, LoadError> {
    let is_binary = bytes.starts_with(b"glTF");
    let glb = is_binary.then(|| Glb::from_slice(bytes)).transpose().map_err(|error| malformed(error.to_string()))?;
    let (json, bin) = glb.as_ref().map_or((bytes, None), |glb| (&*glb.json, glb.bin.as_deref()));
    let document = document(json)?;
    let buffers = Buffers::open(&document, bin, folder)?;
    let Some(scene) = document.default_scene().or_else(|| document.scenes().next()) else {
        return Err(malformed("it has no scene"));
    };
    let (mut assembler, mut allowance) = (Assembler::new(0), Allowance::bytes(json.len() + buffers.length()));
    let mut directions = Vec::new();
    let mut waiting: Vec<(Node<'_>, DMat4)> = scene.nodes().map(|node| (node, DMat4::IDENTITY)).collect();
    let mut visits = 0;
    while let Some((node, parent)) = waiting.pop() {
        // A node belongs to one parent at most: more visits than nodes mean a cycle.
        visits += 1;
        if visits > document.nodes().len() {
            return Err(malformed("its nodes are no tree"));
        }
        let placed = parent * local(&node);
        for primitive in node.mesh().into_iter().flat_map(|mesh| mesh.primitives().collect::<Vec<_>>()) {
            allowance.take(points(&primitive), "glTF")?;
            add(&primitive, &buffers, (placed, normals), &mut assembler, &mut directions)?;
        }
        waiting.extend(node.children().map(|child| (child, placed)));
    }
    assembler.finish(directions)
}

/// The transformation of a node, in double precision.
fn local(node: &Node<'_>) -> DMat4 {
    match node.transform() {
        Transform::Matrix { matrix } => DMat4::from_cols_array_2d(&matrix.map(|column| column.map(f64::from))),
        Transform::Decomposed { translation, rotation, scale } => {
            let turned = DQuat::from_array(rotation.map(f64::from));
            // Written in single precision, it is of unit length to seven digits only.
            let turned = if turned.length_squared() > 0.0 { turned.normalize() } else { DQuat::IDENTITY };
            let [scale, translation] = [scale, translation].map(|v| DVec3::from_array(v.map(f64::from)));
            DMat4::from_scale_rotation_translation(scale, turned, translation)
        }
    }
}

/// The JSON of the file, validated.
fn document(json: &[u8]) -> Result<Document, LoadError> {
    let mut root = Root::from_slice(json).map_err(|error| malformed(error.to_string()))?;
    let used = |root: &Root, name: &str| root.extensions_used.iter().any(|used| used == name);
    for required in &root.extensions_required {
        match required.as_str() {
            "KHR_draco_mesh_compression" => return Err(compressed("Draco", required)),
            "EXT_meshopt_compression" | "KHR_meshopt_compression" => return Err(compressed("meshopt", required)),
            "KHR_mesh_quantization" | "KHR_animation_pointer" => {}
            // What things look like.
            name if ["KHR_materials", "KHR_texture", "EXT_texture", "MSFT_texture", "KHR_lights", "EXT_lights"]
                .iter()
                .any(|looks| name.starts_with(looks)) => {}
            name => return Err(malformed(format!("it requires the extension {name}, which is not understood"))),
        }
    }
    root.extensions_required.clear();
    let draco = used(&root, "KHR_draco_mesh_compression");
    for primitive in root.meshes.iter().flat_map(|mesh| &mesh.primitives) {
        // The validation below takes these for granted.
        let indices = primitive.attributes.values().chain(&primitive.indices);
        if let Some(index) = indices.clone().find(|index| index.value() >= root.accessors.len()) {
            return Err(malformed(format!("there is no accessor {}", index.value())));
        }
        let is_bare = |index: &gltf::json::Index<_>| {
            let accessor: &gltf::json::Accessor = &root.accessors[index.value()];
            accessor.buffer_view.is_none() && accessor.sparse.is_none()
        };
        if draco && indices.clone().any(is_bare) {
            return Err(compressed("Draco", "KHR_draco_mesh_compression"));
        }
    }
    // The bounds of positions are asked for by the validation, and not needed.
    for mesh in &root.meshes {
        for primitive in &mesh.primitives {
            if let Some(index) = primitive.attributes.get(&Checked::Valid(Semantic::Positions)) {
                let accessor = &mut root.accessors[index.value()];
                accessor.min = Some(vec![0.0; 3].into());
                accessor.max = Some(vec![0.0; 3].into());
            }
        }
    }
    Document::from_json(root).map_err(|error| malformed(error.to_string()))
}

fn compressed(by: &str, extension: &str) -> LoadError {
    malformed(format!(
        "its mesh is compressed by {by} ({extension}), which is not understood: save it without compression"
    ))
}

/// Points that a primitive makes: its positions and its corners.
fn points(primitive: &Primitive<'_>) -> usize {
    let count = |accessor: Option<Accessor<'_>>| accessor.map_or(0, |accessor| accessor.count());
    let most = count(primitive.get(&Semantic::Positions)).max(count(primitive.get(&Semantic::Normals)));
    most.saturating_add(count(primitive.indices()))
}

/// Numbers of positions, or of normals: whole ones are of quantised meshes.
const VECTORS: [DataType; 5] = [DataType::F32, DataType::I8, DataType::U8, DataType::I16, DataType::U16];

fn add(
    primitive: &Primitive<'_>,
    buffers: &Buffers<'_>,
    (placed, reading): (DMat4, Normals),
    assembler: &mut Assembler,
    directions: &mut Vec<DVec3>,
) -> Result<(), LoadError> {
    let mode = primitive.mode();
    if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
        return Ok(()); // Points and lines bound no solid.
    }
    let positions = primitive.get(&Semantic::Positions).ok_or_else(|| malformed("a primitive has no positions"))?;
    let positions: Vec<DVec3> = values(&positions, buffers, &VECTORS)?
        .into_iter()
        .map(|v| 1000.0 * to_frame(placed.transform_point3(v.into())))
        .collect();
    let count = positions.len();
    let mut points = Points::new(positions);
    let indices: Vec<usize> = match primitive.indices() {
        Some(indices) => values(&indices, buffers, &[DataType::U8, DataType::U16, DataType::U32])?
            .into_iter()
            .map(|[index]| index as usize)
            .collect(),
        None => (0..count).collect(),
    };
    let first_normal = u32::try_from(directions.len()).map_err(|_| LoadError::TooLarge)?;
    let normals = primitive.get(&Semantic::Normals).filter(|_| reading == Normals::Read);
    if let Some(normals) = &normals {
        if normals.count() != count {
            return Err(malformed("a primitive has another number of normals than of positions"));
        }
        let turned = DMat3::from_mat4(placed).inverse().transpose();
        let read = values(normals, buffers, &VECTORS)?;
        directions.extend(read.into_iter().map(|v| to_frame(turned * DVec3::from(v)).normalize_or_zero()));
    }
    // A mirroring transformation turns triangles inside out.
    let mirrored = placed.determinant() < 0.0;
    each_triangle(mode, &indices, |[a, b, c]| {
        let corners = if mirrored { [a, c, b] } else { [a, b, c] };
        assembler.numbered(&mut points, corners, |k| malformed(format!("index {k} points at nothing")))?;
        if normals.is_some() {
            assembler.normal_corners.push(corners.map(|k| first_normal + k as u32));
        }
        Ok(())
    })
}

/// The triangles that indices make in this mode.
fn each_triangle(
    mode: Mode,
    indices: &[usize],
    mut take: impl FnMut([usize; 3]) -> Result<(), LoadError>,
) -> Result<(), LoadError> {
    match mode {
        Mode::TriangleStrip => {
            for (k, corners) in indices.windows(3).enumerate() {
                let &[a, b, c] = corners else { continue };
                // Strips are joined by triangles of no area.
                if a != b && b != c && c != a {
                    take(if k % 2 == 0 { [a, b, c] } else { [a, c, b] })?;
                }
            }
            Ok(())
        }
        Mode::TriangleFan => indices.windows(2).skip(1).try_for_each(|pair| take([pair[0], pair[1], indices[0]])),
        _ if !indices.len().is_multiple_of(3) => Err(malformed(format!("{} indices are not triples", indices.len()))),
        _ => indices.chunks_exact(3).try_for_each(|corners| take([corners[0], corners[1], corners[2]])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::at_worst;

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
        let mesh = parse(&triangle(JSON), None, Normals::Read).unwrap();
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
        let mesh = parse(&triangle(&json), None, Normals::Read).unwrap();
        at_worst(2.5e-7, (mesh.vertices[2] - DVec3::new(0.0, 4.0, 18.0)).length(), "vertex");
    }

    #[test]
    fn broken_files_are_named() {
        for (from, to) in [
            (r#""count":3,"type":"SCALAR""#, r#""count":4000000000,"type":"SCALAR""#),
            (r#""componentType":5126,"count":3,"type":"VEC3"}"#, r#""componentType":5125,"count":3,"type":"VEC3"}"#),
            (r#""byteOffset":36,"byteLength":36"#, r#""byteOffset":360,"byteLength":36"#),
            (r#""nodes":[{"mesh":0}]"#, r#""nodes":[{"mesh":0,"children":[0]}]"#),
            (r#""byteLength":36},"#, r#""byteLength":36,"byteStride":4},"#),
            (r#""asset""#, r#""extensionsRequired":["EXT_mesh_gpu_instancing"],"asset""#),
        ] {
            assert!(JSON.contains(from), "{from}");
            let broken = triangle(&JSON.replacen(from, to, 1));
            assert!(matches!(parse(&broken, None, Normals::Read), Err(LoadError::Malformed { .. })), "{to}");
        }
        let good = triangle(JSON);
        for length in 0..good.len() {
            assert!(parse(&good[..length], None, Normals::Read).is_err(), "cut to {length} bytes");
        }
    }
}
