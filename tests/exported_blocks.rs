//! Exported files before independent judges: admesh, trimesh, the glTF validator of Khronos.

mod common;

use common::measured::at_worst;
use glasswarp::{
    bench::ExitFace,
    export::{Design, Format, export},
    grid::{Extent, Field, Outline},
    solid::{Solid, Stock},
    surface::HeightField,
};
use serde_json::Value;
use std::{fs, path::PathBuf};
use tempfile::TempDir;

struct Block {
    name: String,
    solid: Solid,
    folder: TempDir,
}

impl Block {
    fn exported(&self, format: Format) -> PathBuf {
        let path = self.folder.path().join(format!("{}.{format}", self.name));
        let exit_face = if self.name == "mirror" { ExitFace::Reflects } else { ExitFace::Refracts { ior: 1.49 } };
        let design = Design { name: self.name.clone(), exit_face, distance_mm: 250.0 };
        export(&path, &self.solid, &design).unwrap();
        path
    }
}

/// Blocks of several aspects, sizes and triangulations.
fn blocks() -> Vec<Block> {
    let block = |name: &str, size: (f64, f64), nodes: (usize, usize), stock: Stock, relief_mm: f64| {
        let (extent, (nx, ny)) = (Extent::new(size.0, size.1), nodes);
        let heights = Field::from_fn(nx, ny, |i, j| {
            let at = extent.node(i, j, nx, ny) / extent.width_mm;
            0.5 * relief_mm * (17.0 * at.x + 0.3).sin() * (11.0 * at.y - 0.2).cos() + 0.05 * relief_mm * at.x * at.y
        });
        let solid = Solid::new(&HeightField::new(extent, heights), stock).unwrap();
        Block { name: name.to_owned(), solid, folder: tempfile::tempdir().unwrap() }
    };
    let outlined = |name: &str, outline: Outline, block: Block| {
        let face = block.solid.surface();
        let face = HeightField::outlined(face.extent(), outline, face.heights_mm().clone());
        Block { name: name.to_owned(), solid: Solid::new(&face, Stock::default()).unwrap(), ..block }
    };
    let plain = |size, nodes| block("plain", size, nodes, Stock::default(), 2.0);
    vec![
        outlined("disc", Outline::Circle, plain((100.0, 100.0), (161, 161))),
        outlined("ellipse", Outline::Circle, plain((120.0, 60.0), (33, 17))),
        outlined("rounded", Outline::Rounded { radius_mm: 10.0 }, plain((100.0, 70.0), (201, 141))),
        block("square", (100.0, 100.0), (257, 257), Stock::default(), 2.0),
        block("landscape", (140.0, 100.0), (181, 129), Stock::of_thickness(10.0), 4.0),
        block("portrait", (60.0, 90.0), (41, 97), Stock::default(), 1.0),
        block("strip", (500.0, 12.0), (801, 9), Stock::default(), 3.0),
        block("coarse", (100.0, 75.0), (4, 5), Stock::default(), 1.0),
        block("tiny", (1.0, 1.0), (33, 33), Stock::of_thickness(0.5).leaving_at_least(0.2), 0.1),
        block("huge", (4000.0, 3000.0), (65, 49), Stock::of_thickness(100.0), 50.0),
        block("mirror", (100.0, 100.0), (65, 65), Stock::default(), 2.0),
    ]
}

/// The number after the colon that follows `label`.
fn figure(report: &str, label: &str) -> f64 {
    report
        .split_once(label)
        .and_then(|(_, rest)| rest.trim_start().strip_prefix(':')?.split_whitespace().next()?.parse().ok())
        .unwrap_or_else(|| panic!("no {label:?} in\n{report}"))
}

#[test]
fn admesh_finds_nothing_to_repair() {
    let Some(_) = common::program("admesh", "Debian package admesh") else { return };
    let report = |path: &PathBuf| {
        let mut admesh = common::program("admesh", "Debian package admesh").unwrap();
        // A failing exit is not what admesh tells faults by.
        common::output(admesh.arg(path))
    };
    for block in blocks() {
        let path = block.exported(Format::Stl);
        let text = report(&path);
        assert_eq!(figure(&text, "Number of facets"), block.solid.triangle_count() as f64, "{}:\n{text}", block.name);
        assert_eq!(figure(&text, "Number of parts"), 1.0, "{}:\n{text}", block.name);
        for fault in FAULTS {
            assert_eq!(figure(&text, fault), 0.0, "{}: {fault}\n{text}", block.name);
        }
        let volume = figure(&text, "Volume");
        // admesh sums in f32.
        let ours = block.solid.volume_mm3();
        let off = (volume - ours).abs() / ours;
        common::measured::at_worst(2.74e-5, off, format_args!("{}: {volume} mm³ for {ours} mm³", block.name));

        // The judge must be able to say no.
        let bytes = fs::read(&path).unwrap();
        fs::write(&path, open(&bytes)).unwrap();
        assert!(figure(&report(&path), "Total disconnected facets") > 0.0);
        fs::write(&path, turned(&bytes)).unwrap();
        assert!(figure(&report(&path), "Facets reversed") > 0.0);
    }
}

const FAULTS: [&str; 9] = [
    "Facets with 1 disconnected edge",
    "Facets with 2 disconnected edges",
    "Facets with 3 disconnected edges",
    "Total disconnected facets",
    "Edges fixed",
    "Facets removed",
    "Facets added",
    "Facets reversed",
    "Normals fixed",
];

/// The STL without its last triangle.
fn open(stl: &[u8]) -> Vec<u8> {
    let mut stl = stl[..stl.len() - 50].to_vec();
    let count = u32::from_le_bytes(stl[80..84].try_into().unwrap()) - 1;
    stl[80..84].copy_from_slice(&count.to_le_bytes());
    stl
}

/// The STL with its second triangle turned over.
fn turned(stl: &[u8]) -> Vec<u8> {
    let mut stl = stl.to_vec();
    let vertex = 84 + 50 + 12;
    for byte in vertex..vertex + 12 {
        stl.swap(byte, byte + 12);
    }
    stl
}

#[test]
fn trimesh_reads_a_closed_oriented_solid_of_the_same_volume_from_every_format() {
    const SCRIPT: &str = r"
import json, sys, trimesh
for path in sys.argv[1:]:
    mesh = trimesh.load(path)
    mesh = mesh.to_geometry() if isinstance(mesh, trimesh.Scene) else mesh
    mesh.merge_vertices(merge_norm=True, merge_tex=True)
    print(json.dumps(dict(closed=bool(mesh.is_watertight), oriented=bool(mesh.is_winding_consistent),
        volume=float(mesh.volume), euler=int(mesh.euler_number), faces=len(mesh.faces), vertices=len(mesh.vertices),
        left=float(mesh.bounds[0][0]))))
";
    let Some(mut trimesh) = common::python(&["trimesh"], SCRIPT) else { return };
    let blocks = blocks();
    const MESHES: [Format; 4] = [Format::Stl, Format::Obj, Format::Glb, Format::Ply];
    let cases: Vec<_> = blocks.iter().flat_map(|block| MESHES.map(|format| (block, format))).collect();
    let paths = cases.iter().map(|(block, format)| block.exported(*format));
    // The judge must be able to say no: the last file lacks a triangle.
    let folder = tempfile::tempdir().unwrap();
    let opened = folder.path().join("open.stl");
    fs::write(&opened, open(&fs::read(blocks[0].exported(Format::Stl)).unwrap())).unwrap();
    let said = common::output(trimesh.args(paths).arg(&opened));
    let mut said = said.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    for (block, format) in cases {
        let (extent, said) = (block.solid.extent(), said.next().unwrap());
        let context = format!("{}.{format}: {said}", block.name);
        assert_eq!(said["closed"], true, "{context}");
        assert_eq!(said["oriented"], true, "{context}");
        assert_eq!(said["euler"], 2, "{context}");
        assert_eq!(said["faces"], block.solid.triangle_count(), "{context}");
        assert_eq!(said["vertices"], block.solid.vertex_count(), "{context}");
        let unit = if format == Format::Glb { 1e-3 } else { 1.0 };
        let (volume, ours) = (said["volume"].as_f64().unwrap(), block.solid.volume_mm3() * f64::powi(unit, 3));
        // f32 coordinates, in metres rounded once more.
        at_worst(1.09e-7, (volume / ours - 1.0).abs(), format_args!("{context}, not {ours}"));
        assert_eq!(said["left"].as_f64().unwrap() as f32, (-0.5 * extent.width_mm * unit) as f32, "{context}");
    }
    assert_eq!(said.next().unwrap()["closed"], false);
}

#[test]
fn the_gltf_validator_has_nothing_to_say() {
    const SCRIPT: &str = r"
const { readFileSync } = require('fs'), { validateBytes } = require('gltf-validator');
(async () => {
    for (const path of process.argv.slice(1))
        console.log(JSON.stringify(await validateBytes(new Uint8Array(readFileSync(path)))));
})();
";
    let Some(mut validator) = common::node(&["gltf-validator"], SCRIPT) else { return };
    let blocks = blocks();
    let paths = blocks.iter().map(|block| block.exported(Format::Glb));
    // The judge must be able to say no: the last file has a normal of the wrong length.
    let mut bytes = fs::read(blocks[0].exported(Format::Glb)).unwrap();
    let json = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let last_normal = bytes.len() - 12 * blocks[0].solid.triangle_count() - 12;
    assert!(last_normal > 28 + json);
    bytes[last_normal..last_normal + 4].copy_from_slice(&3.0_f32.to_le_bytes());
    let folder = tempfile::tempdir().unwrap();
    let wrong = folder.path().join("wrong.glb");
    fs::write(&wrong, bytes).unwrap();
    let said = common::output(validator.args(paths).arg(&wrong));
    let mut said = said.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    for block in &blocks {
        let said = said.next().unwrap();
        for kind in ["numErrors", "numWarnings", "numInfos", "numHints"] {
            assert_eq!(said["issues"][kind], 0, "{}: {said:#}", block.name);
        }
        assert_eq!(said["info"]["totalTriangleCount"], block.solid.triangle_count());
    }
    assert_eq!(said.next().unwrap()["issues"]["numErrors"], 1);
}
