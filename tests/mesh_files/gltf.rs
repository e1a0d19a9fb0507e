//! glTF of every nesting, encoding and mode.

use super::{Case, EXACT, Original, Outcome, case};
use base64::Engine;
use glam::DVec3;
use glasswarp_verify::load::{Format::Gltf, read};
use serde_json::{Value, json};

/// A file in the making: its buffer, and what points into it.
struct Scene {
    json: Value,
    bin: Vec<u8>,
}

fn list(value: &mut Value) -> &mut Vec<Value> {
    value.as_array_mut().unwrap()
}

impl Scene {
    fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": []}], "bufferViews": [], "accessors": []
        });
        Self { json, bin: Vec::new() }
    }

    /// Adds bytes to the buffer; their view.
    fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let view = json!({"buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len()});
        self.bin.extend(bytes);
        list(&mut self.json["bufferViews"]).push(view);
        list(&mut self.json["bufferViews"]).len() - 1
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        list(&mut self.json["accessors"]).push(accessor);
        list(&mut self.json["accessors"]).len() - 1
    }

    fn positions(&mut self, positions: &[DVec3]) -> usize {
        let bytes: Vec<u8> =
            positions.iter().flat_map(glam::DVec3::to_array).flat_map(|c| (c as f32).to_le_bytes()).collect();
        let view = self.view(&bytes);
        self.accessor(json!({"bufferView": view, "componentType": 5126, "count": positions.len(), "type": "VEC3"}))
    }

    fn indices(&mut self, indices: &[u32]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|k| k.to_le_bytes()).collect();
        let view = self.view(&bytes);
        self.accessor(json!({"bufferView": view, "componentType": 5125, "count": indices.len(), "type": "SCALAR"}))
    }

    fn primitive(&mut self, primitive: Value) {
        list(&mut self.json["meshes"][0]["primitives"]).push(primitive);
    }

    fn node(mut self, node: Value) -> Self {
        self.json["nodes"][0] = node;
        self
    }

    fn with(mut self, name: &str, value: Value) -> Self {
        self.json[name] = value;
        self
    }

    fn glb(mut self) -> Vec<u8> {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        self.json["buffers"] = json!([{"byteLength": self.bin.len()}]);
        let mut text = self.json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut glb = b"glTF\x02\0\0\0".to_vec();
        glb.extend(((12 + 8 + text.len() + 8 + self.bin.len()) as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &self.bin)] {
            glb.extend((chunk.len() as u32).to_le_bytes());
            glb.extend(kind);
            glb.extend(chunk);
        }
        glb
    }

    /// As JSON with its buffer under this name.
    fn gltf(mut self, uri: &str) -> Vec<u8> {
        self.json["buffers"] = json!([{"byteLength": self.bin.len(), "uri": uri}]);
        self.json.to_string().into_bytes()
    }
}

/// Metres with y up.
fn metres(v: DVec3) -> DVec3 {
    DVec3::new(v.x, v.z, -v.y) / 1000.0
}

/// The block, its vertices sent through `place`.
fn scene(original: &Original, place: impl Fn(DVec3) -> DVec3) -> Scene {
    let mut scene = Scene::new();
    let positions: Vec<DVec3> = original.mesh.vertices.iter().map(|&v| place(v)).collect();
    let (positions, indices) = (scene.positions(&positions), scene.indices(original.mesh.triangles.as_flattened()));
    scene.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices}));
    scene
}

/// The block with whole numbers of this type for coordinates.
fn quantised(original: &Original, bytes: Vec<u8>, kind: u32, normalised: bool, node: Value) -> Vec<u8> {
    let mut scene = Scene::new();
    let view = scene.view(&bytes);
    scene.json["bufferViews"][view]["byteStride"] = json!(8);
    let count = original.mesh.vertices.len();
    let positions = scene.accessor(
        json!({"bufferView": view, "componentType": kind, "normalized": normalised, "count": count, "type": "VEC3"}),
    );
    let indices = scene.indices(original.mesh.triangles.as_flattened());
    scene.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices}));
    let extension = json!(["KHR_mesh_quantization"]);
    scene.with("extensionsUsed", extension.clone()).with("extensionsRequired", extension).node(node).glb()
}

/// As one strip of triangles, joined by triangles of no area.
fn strip(triangles: &[[u32; 3]]) -> Vec<u32> {
    let next = |k: usize| triangles[(k + 1) % triangles.len()][0];
    triangles.iter().enumerate().flat_map(|(k, &[a, b, c])| [a, b, c, c, next(k), next(k)]).collect()
}

pub(super) fn cases(original: &Original) -> Vec<Case> {
    let mesh = &original.mesh;
    let same = |kind: &str, from, bytes: Vec<u8>| case(kind, from, Gltf, bytes, Outcome::Block(EXACT));
    let refused = |kind: &str, from, bytes: Vec<u8>, words| case(kind, from, Gltf, bytes, Outcome::Refused(words));
    let plain = || scene(original, metres);
    let (lo, hi) = mesh
        .vertices
        .iter()
        .map(|&v| metres(v))
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
    let words = |place: &dyn Fn(DVec3) -> DVec3| -> Vec<u8> {
        let whole = |v: &DVec3| place(metres(*v)).to_array().map(|c| c.round() as i32 as u16);
        mesh.vertices.iter().flat_map(|v| [whole(v).to_vec(), vec![0]].concat()).flat_map(u16::to_le_bytes).collect()
    };
    let unindexed = {
        let mut scene = Scene::new();
        let corners: Vec<DVec3> = original.triangles().as_flattened().iter().map(|&v| metres(v)).collect();
        let positions = scene.positions(&corners);
        scene.primitive(json!({"attributes": {"POSITION": positions}}));
        scene.glb()
    };
    let sparse = {
        let mut scene = Scene::new();
        let count = mesh.vertices.len();
        let numbers: Vec<u8> = (0..count as u16).flat_map(u16::to_le_bytes).collect();
        let of = scene.view(&numbers);
        let values: Vec<DVec3> = mesh.vertices.iter().map(|&v| metres(v)).collect();
        let base = scene.positions(&values);
        let view = scene.json["accessors"][base]["bufferView"].clone();
        scene.json["accessors"][base] = json!({"componentType": 5126, "count": count, "type": "VEC3", "sparse": {
            "count": count, "indices": {"bufferView": of, "componentType": 5123}, "values": {"bufferView": view}}});
        let indices = scene.indices(mesh.triangles.as_flattened());
        scene.primitive(json!({"attributes": {"POSITION": base}, "indices": indices}));
        scene.glb()
    };
    let of_mode = |mode: u32, indices: &[u32], others: &[[u32; 3]]| {
        let mut scene = Scene::new();
        let positions = scene.positions(&mesh.vertices.iter().map(|&v| metres(v)).collect::<Vec<_>>());
        for (mode, indices) in [(mode, indices), (4, others.as_flattened())] {
            if !indices.is_empty() {
                let indices = scene.indices(indices);
                scene.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices, "mode": mode}));
            }
        }
        scene.glb()
    };
    let [a, b, c] = mesh.triangles[0];
    let bytes: Vec<u8> = mesh.triangles.as_flattened().iter().map(|&k| u8::try_from(k).unwrap()).collect();
    let small = {
        let mut scene = plain();
        let view = scene.view(&bytes);
        let indices = json!({"bufferView": view, "componentType": 5121, "count": bytes.len(), "type": "SCALAR"});
        scene.json["accessors"][1] = indices;
        scene.glb()
    };
    let mirrored = {
        let mut scene = scene(original, |v| metres(v) * DVec3::new(-1.0, 1.0, 1.0));
        let turned: Vec<u32> = mesh.triangles.iter().flat_map(|&[a, b, c]| [a, c, b]).collect();
        let indices = scene.indices(&turned);
        scene.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
        scene.node(json!({"mesh": 0, "scale": [-1, 1, 1]})).glb()
    };
    let embedded = {
        let scene = plain();
        let text = base64::engine::general_purpose::STANDARD.encode(&scene.bin);
        scene.gltf(&format!("data:application/octet-stream;base64,{text}"))
    };
    let nodes = json!([{"children": [1], "scale": [0.001, 0.001, 0.001]}, {"children": [2], "rotation": [-0.707_106_77, 0, 0, 0.707_106_77]}, {"mesh": 0}]);
    let requires =
        |name: &str| plain().with("extensionsUsed", json!([name])).with("extensionsRequired", json!([name])).glb();
    vec![
        same("as we write it", "glasswarp", original.exported("glb")),
        same("one mesh", "nearly all programs", plain().glb()),
        same(
            "nodes within nodes, z up and millimetres inside",
            "Blender, CAD converters",
            scene(original, |v| v).with("nodes", nodes).glb(),
        ),
        same(
            "a node with a matrix",
            "SketchUp",
            scene(original, |v| v)
                .node(json!({"mesh": 0, "matrix": [0.001, 0, 0, 0, 0, 0, -0.001, 0, 0, 0.001, 0, 0, 0, 0, 0, 1]}))
                .glb(),
        ),
        same("a node that mirrors a mirrored mesh", "Maya, 3ds Max", mirrored),
        case(
            "quantised to 16 bits, normalised",
            "gltfpack, gltf-transform",
            Gltf,
            quantised(
                original,
                words(&|v| (v - lo) / (hi - lo) * 65_535.0),
                5123,
                true,
                json!({"mesh": 0, "scale": (hi - lo).to_array(), "translation": lo.to_array()}),
            ),
            Outcome::Block(2e-4),
        ),
        case(
            "quantised to 16 bits, signed",
            "gltfpack -noq of old",
            Gltf,
            quantised(original, words(&|v| v * 1e6), 5122, false, json!({"mesh": 0, "scale": [1e-6, 1e-6, 1e-6]})),
            Outcome::Block(6e-4),
        ),
        same("sparse positions", "morphing tools", sparse),
        same("a strip of triangles", "NVIDIA's tools", of_mode(5, &strip(&mesh.triangles), &[])),
        same("a fan of triangles", "converters", of_mode(6, &[c, a, b], &mesh.triangles[1..])),
        same("lines beside the triangles", "CAD converters", of_mode(1, &[a, b], &mesh.triangles)),
        same("no indices", "three.js", unindexed),
        same("indices of 8 bits", "compact writers", small),
        same("JSON with its buffer inside", "Blender (embedded)", embedded),
        same("an extension of looks is required", "material editors", requires("KHR_materials_clearcoat")),
        refused(
            "JSON whose buffer is a file elsewhere",
            "downloads of one file of two",
            plain().gltf("../block.bin"),
            "not in the folder",
        ),
        refused("compressed by Draco", "Blender, Google's encoder", requires("KHR_draco_mesh_compression"), "Draco"),
        refused("compressed by meshopt", "gltfpack -c", requires("EXT_meshopt_compression"), "meshopt"),
        refused("instances", "scene exporters", requires("EXT_mesh_gpu_instancing"), "EXT_mesh_gpu_instancing"),
        refused("lines only", "CAD sketches", of_mode(1, &[a, b], &[]), "no triangles"),
        refused(
            "cut off",
            "broken downloads",
            {
                let mut glb = plain().glb();
                glb.truncate(glb.len() / 2);
                glb
            },
            "glTF",
        ),
    ]
}

#[test]
fn a_buffer_beside_the_file_is_read_and_a_missing_one_is_named() {
    let original = Original::new();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("block.gltf");
    let scene = scene(&original, metres);
    let bin = scene.bin.clone();
    std::fs::write(&path, scene.gltf("my%20block.bin")).unwrap();
    let said = read(&path).unwrap_err().to_string();
    assert!(said.contains("my block.bin"), "{said}");
    std::fs::write(folder.path().join("my block.bin"), bin).unwrap();
    assert_eq!(read(&path).unwrap().triangles.len(), original.mesh.triangles.len());
}
