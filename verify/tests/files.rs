//! Files of blocks, sound and broken, as a stranger finds them.

mod common;
#[path = "../../tests/common/measured.rs"]
mod measured;

use common::{block, lens, relief, stl};
use glam::{DMat3, DVec2, DVec3};
use glasswarp_verify::{Block, BlockError, ExpectedPose, Mesh, PlacedBlock, Placement, load, solid};
use measured::at_worst;
use proptest::prelude::*;

const SIZE: DVec2 = DVec2::new(40.0, 30.0);

fn sound() -> Mesh {
    block(41, 31, SIZE, -12.0, relief)
}

#[test]
fn an_exported_block_is_recognised_with_its_heights() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("block.STL");
    std::fs::write(&path, stl(&sound())).unwrap();
    let mesh = load::read(&path).unwrap();
    let report = solid::check(&mesh);
    assert!(report.is_sound() && report.vertices == mesh.vertices.len(), "{report}");
    at_worst(3.02e-7, (report.volume_mm3 - sound().volume_mm3()).abs(), "volume, mm3");
    let block = Block::from_mesh(&mesh).unwrap();
    assert_eq!((block.nodes(), block.size_mm(), block.entry_z_mm()), ((41, 31), SIZE, -12.0));
    for (k, &z) in block.heights_mm().iter().enumerate() {
        assert_eq!(z, f64::from(sound().vertices[k].z as f32));
    }
}

/// A block with a relief on both sides.
fn two_reliefs() -> Mesh {
    lens((41, 31), SIZE, |x, y| relief(y, -x) - 12.0, relief)
}

fn obj(mesh: &Mesh) -> String {
    let vertices = mesh.vertices.iter().map(|v| format!("v {} {} {}\n", v.x, v.y, v.z));
    let faces = mesh.triangles.iter().map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1));
    vertices.chain(faces).collect()
}

fn off(mesh: &Mesh) -> String {
    let vertices = mesh.vertices.iter().map(|v| format!("{} {} {}\n", v.x, v.y, v.z));
    let faces = mesh.triangles.iter().map(|[a, b, c]| format!("3 {a} {b} {c}\n"));
    let head = format!("OFF\n{} {} 0\n", mesh.vertices.len(), mesh.triangles.len());
    [head].into_iter().chain(vertices).chain(faces).collect()
}

#[test]
fn reliefs_on_both_sides_are_recognised_with_their_heights() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = two_reliefs();
    for (name, bytes) in [("a.stl", stl(&mesh)), ("a.obj", obj(&mesh).into()), ("a.off", off(&mesh).into())] {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let block = Block::from_mesh(&load::read(&path).unwrap()).unwrap();
        let (nodes, heights) = block.entry_heights_mm().unwrap();
        assert_eq!((block.nodes(), nodes, block.size_mm()), ((41, 31), (41, 31), SIZE));
        let wanted = |z: f64| if name == "a.off" { z } else { f64::from(z as f32) };
        let nodes = heights.iter().chain(block.heights_mm()).zip(&mesh.vertices);
        assert!(nodes.into_iter().all(|(z, at)| *z == wanted(at.z)), "{name}");
        let mean = heights.iter().sum::<f64>() / heights.len() as f64;
        assert!((block.entry_z_mm() - mean).abs() < 1e-12 && block.lowest_mm() < mean);
        assert!(block.min_thickness_mm() > 9.0 && block.min_thickness_mm() < 12.0);
    }
}

#[test]
fn a_block_with_two_reliefs_is_found_as_it_stands_or_a_quarter_further() {
    let mesh = two_reliefs();
    let there = PlacedBlock::find(mesh.clone(), None).unwrap();
    assert_eq!(there.placement, Placement::NONE);
    let (exit, entry) = (there.block.heights_mm().to_vec(), there.block.entry_z_mm());
    let away = PlacedBlock::find(mesh.clone().moved(DVec3::new(70.0, -20.0, 55.0)), None).unwrap();
    let moved = away.placement.shift_mm + DVec3::new(70.0, -20.0, 55.0);
    assert!((moved - DVec3::new(0.0, 0.0, -there.block.mean_exit_z_mm())).length() < 1e-9, "{moved}");
    let stand = ExpectedPose { face_mm: SIZE, entry_z_mm: entry };
    let mut turned = mesh;
    turned.vertices.iter_mut().for_each(|v| *v = DMat3::from_rotation_z(std::f64::consts::FRAC_PI_2) * *v);
    let found = PlacedBlock::find(turned, Some(&stand)).unwrap().turned_by_quarters(2, Some(&stand)).unwrap();
    let off = found.block.heights_mm().iter().zip(&exit).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off < 1e-9 && (found.block.entry_z_mm() - entry).abs() < 1e-9, "{off}");
}

#[test]
fn a_solid_with_one_planar_side_stands_on_that() {
    // A relief below, and above it a plane whose vertices are a grid.
    let mesh = lens((41, 31), SIZE, |x, y| relief(y, -x) - 12.0, |_, _| 0.0);
    assert!(matches!(Block::from_mesh(&mesh), Err(BlockError::EntryFace { .. })));
    let found = PlacedBlock::find(mesh, None).unwrap();
    assert!(found.block.entry_heights_mm().is_none() && found.placement.axis_and_angle().is_some());
}

#[test]
fn what_is_no_pair_of_reliefs_is_refused_by_its_fault() {
    let fault = |change: &dyn Fn(&mut Mesh)| {
        let mut mesh = two_reliefs();
        change(&mut mesh);
        Block::from_mesh(&mesh).unwrap_err().to_string()
    };
    // The exit face is leant over, and so its border lies elsewhere.
    let first = 41 * 31;
    let leant = fault(&|m| m.vertices[first..].iter_mut().for_each(|v| v.x += 0.1));
    assert!(leant.contains("0.100 mm beside each other"), "{leant}");
    let bent = fault(&|m| m.vertices[first + 20 * 41 + 17].x += 0.3);
    assert!(bent.contains("no planar entry face") || bent.contains("no regular grid"), "{bent}");
    let cut = fault(&|m| m.vertices[20 * 41 + 17].z += 13.0);
    assert!(cut.contains("column 17, row 20") && cut.contains("not above the entry face"), "{cut}");
}

#[test]
fn every_fault_has_its_name() {
    let fault = |change: &dyn Fn(&mut Mesh)| {
        let mut mesh = sound();
        change(&mut mesh);
        Block::from_mesh(&mesh).unwrap_err().to_string()
    };
    type Change<'a> = &'a dyn Fn(&mut Mesh);
    let cases: [(&str, Change<'_>); 8] = [
        ("3 open edges", &|m| _ = m.triangles.remove(7)),
        ("3 edges between triangles of opposite orientation", &|m| m.triangles[7].swap(0, 1)),
        ("inside out", &|m| m.triangles.iter_mut().for_each(|t| t.swap(0, 1))),
        ("more than two triangles", &|m| m.triangles.push(m.triangles[7])),
        ("without area", &|m| {
            let [a, b, _] = m.triangles[7];
            m.triangles.push([a, b, b]);
        }),
        ("no triangles", &|m| m.triangles.clear()),
        ("no regular grid", &|m| m.vertices[20 * 41 + 17].x += 0.3),
        ("no planar entry face", &|m| m.vertices.iter_mut().for_each(|v| v.z += 0.1 * v.x)),
    ];
    for (name, change) in cases {
        let message = fault(change);
        assert!(message.contains(name), "{name}: {message}");
    }
}

#[test]
fn other_solids_are_sound_but_no_blocks() {
    let (o, x, y, z) = (glam::DVec3::ZERO, glam::DVec3::X, glam::DVec3::Y, glam::DVec3::Z);
    let mesh = Mesh {
        vertices: vec![o, x, y, z],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        ..Mesh::default()
    };
    assert!(solid::check(&mesh).is_sound());
    assert!(matches!(Block::from_mesh(&mesh), Err(BlockError::EntryFace { .. })));
}

#[test]
fn files_that_are_not_there_or_of_no_known_kind_are_named() {
    assert!(matches!(load::read("nowhere.stl".as_ref()), Err(load::LoadError::Read { .. })));
    assert!(matches!(load::read("block.iges".as_ref()), Err(load::LoadError::UnknownExtension { .. })));
}

#[test]
fn a_cut_file_never_passes_for_a_block() {
    let bytes = stl(&sound());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.stl");
    for length in (0..bytes.len()).step_by(9973) {
        std::fs::write(&path, &bytes[..length]).unwrap();
        assert!(load::read(&path).is_err(), "{length} bytes");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever is done to a file, it is read or refused, never a panic.
    #[test]
    fn damaged_files_are_read_or_refused(
        kind in 0..3usize,
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..20),
        keep in any::<prop::sample::Index>(),
    ) {
        let corners = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\nf 1 3 4\n";
        let text = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n";
        let (name, mut bytes) = match kind {
            0 => ("x.stl", stl(&block(4, 4, SIZE, -1.0, |_, _| 0.0))),
            1 => ("x.stl", text.into()),
            _ => ("x.obj", corners.into()),
        };
        for (at, value) in damage {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        bytes.truncate(keep.index(2 * bytes.len()) + 1);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, &bytes).unwrap();
        if let Ok(mesh) = load::read(&path) {
            prop_assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < mesh.vertices.len()));
            let _ = (solid::check(&mesh), Block::from_mesh(&mesh));
        }
    }
}
