use super::*;
use crate::{
    bench::ExitFace,
    grid::{Extent, Field},
    solid::{Face, Shape, Solid, Stock},
    surface::HeightField,
};
use std::{
    io::{self, Cursor, Write},
    path::Path,
};

fn design() -> Design {
    Design { name: "Portrait é\nof 1865".to_owned(), exit_face: ExitFace::Refracts { ior: 1.49 }, distance_mm: 250.0 }
}

fn block() -> Solid {
    Solid::new(&face(|x, y| (0.09 * x + 0.3).sin() * (0.06 * y).cos() + 1e-7 * x), Stock::default()).unwrap()
}

fn face(height: impl Fn(f64, f64) -> f64) -> HeightField {
    let (extent, nx, ny) = (Extent::new(100.0, 70.0), 57, 41);
    HeightField::new(
        extent,
        Field::from_fn(nx, ny, |i, j| {
            let at = extent.node(i, j, nx, ny);
            height(at.x, at.y)
        }),
    )
}

/// A block between two reliefs.
fn lens() -> Solid {
    let entry = face(|x, y| 0.001 * (x * x + 0.7 * y * y) + 0.03 * (0.2 * x).sin());
    Solid::between(block().surface(), &entry, Stock::of_thickness(15.0), Shape::default()).unwrap()
}

/// The normal that a file shall have at a vertex of a face.
fn normal(solid: &Solid, face: Face, v: u32) -> [f32; 3] {
    if face == Face::Exit { solid.exit_normals()[v as usize] } else { solid.normal_at(face, v) }
}

fn written(format: Format, solid: &Solid) -> Vec<u8> {
    let mut bytes = Vec::new();
    format.write(&mut bytes, solid, &design()).unwrap();
    bytes
}

#[test]
fn stl_gives_back_every_triangle_bit_by_bit() {
    let solid = block();
    let bytes = written(Format::Stl, &solid);
    let header = std::str::from_utf8(&bytes[..80]).unwrap();
    assert!(
        header.starts_with("glasswarp unit=mm n=1.49 distance=250 size=100x70 design=Portrait ??of 1865 "),
        "{header}"
    );
    assert_eq!(bytes.len(), 84 + 50 * solid.triangle_count());
    let mut cursor = Cursor::new(bytes);
    let triangles = stl_io::create_stl_reader(&mut cursor).unwrap();
    for (t, triangle) in triangles.map(Result::unwrap).enumerate() {
        let vertices = solid.triangle(t).map(|v| solid.vertex(v as usize));
        assert_eq!(triangle.vertices.map(|v| v.0), vertices);
        let (face, _) = solid.faces().into_iter().find(|(_, range)| range.contains(&t)).unwrap();
        let along: f32 = triangle.normal.0.iter().zip(face.normal()).map(|(a, b)| a * b).sum();
        if face == Face::Exit {
            assert!(along > 0.9);
        } else {
            assert_eq!(triangle.normal.0, face.normal());
        }
    }
}

#[test]
fn obj_gives_back_every_vertex_normal_and_triangle_bit_by_bit() {
    for (solid, below) in [(block(), 5), (lens(), 4 + 57 * 41)] {
        obj_gives_back(&solid, below);
    }
}

/// `below` normals are not those of the exit face.
fn obj_gives_back(solid: &Solid, below: usize) {
    let bytes = written(Format::Obj, solid);
    let (models, _) =
        tobj::load_obj_buf(&mut &bytes[..], &tobj::LoadOptions::default(), |_| Ok(Default::default())).unwrap();
    assert_eq!(models.len(), 1);
    assert_eq!(models[0].name, "Portrait_??of_1865");
    let mesh = &models[0].mesh;
    // The reader numbers vertices in the order of their first use, so that they are compared corner
    // by corner.
    let (positions, _) = mesh.positions.as_chunks::<3>();
    let (normals, _) = mesh.normals.as_chunks::<3>();
    assert_eq!(positions.len(), solid.vertex_count());
    assert_eq!(normals.len(), solid.exit_normals().len() + below);
    let mut corner = 0;
    for (face, range) in solid.faces() {
        for v in range.flat_map(|t| solid.triangle(t)) {
            let normal = normal(solid, face, v);
            assert_eq!(positions[mesh.indices[corner] as usize], solid.vertex(v as usize));
            assert_eq!(normals[mesh.normal_indices[corner] as usize], normal);
            corner += 1;
        }
    }
    assert_eq!(corner, mesh.indices.len());
}

#[test]
fn obj_numbers_are_plain_decimals() {
    let text = String::from_utf8(written(Format::Obj, &block())).unwrap();
    for line in text.lines().filter(|line| line.starts_with('v')) {
        assert!(!line.contains('e') && !line.contains("-0 ") && !line.ends_with("-0"), "{line}");
    }
}

#[test]
fn glb_gives_back_every_triangle_in_metres_and_y_up() {
    [block(), lens()].iter().for_each(glb_gives_back);
}

fn glb_gives_back(solid: &Solid) {
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&written(Format::Glb, solid)).unwrap();
    let blob = blob.unwrap();
    let mesh = document.meshes().next().unwrap();
    let primitive = mesh.primitives().next().unwrap();
    let reader = primitive.reader(|_| Some(&blob));
    let positions: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
    let normals: Vec<[f32; 3]> = reader.read_normals().unwrap().collect();
    let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
    assert_eq!(indices.len(), 3 * solid.triangle_count());
    assert_eq!(positions.len(), glb_vertices(solid));
    for (face, range) in solid.faces() {
        for t in range {
            for (k, v) in solid.triangle(t).into_iter().enumerate() {
                let at = indices[3 * t + k] as usize;
                let [x, y, z] = solid.vertex(v as usize).map(|c| (f64::from(c) / 1000.0) as f32);
                assert_eq!(positions[at], [x, z, -y]);
                let [x, y, z] = normal(solid, face, v);
                assert_eq!(normals[at], [x, z, -y]);
            }
        }
    }
    let bounds = primitive.bounding_box();
    for (k, (low, high)) in bounds.min.into_iter().zip(bounds.max).enumerate() {
        assert_eq!(low, positions.iter().map(|p| p[k]).fold(f32::INFINITY, f32::min));
        assert_eq!(high, positions.iter().map(|p| p[k]).fold(f32::NEG_INFINITY, f32::max));
    }
}

fn glb_vertices(solid: &Solid) -> usize {
    let ((nx, ny), (ex, ey)) = (solid.exit_nodes(), solid.entry_nodes());
    nx * ny + ex * ey + 2 * (nx + ny + ex + ey)
}

#[test]
fn glb_names_the_material_and_the_design() {
    let bytes = written(Format::Glb, &block());
    let glb = gltf::binary::Glb::from_slice(&bytes).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&glb.json).unwrap();
    let material = &json["materials"][0]["extensions"];
    assert!((material["KHR_materials_ior"]["ior"].as_f64().unwrap() - 1.49).abs() < 1e-6);
    assert_eq!(material["KHR_materials_transmission"]["transmissionFactor"], 1.0);
    let thickness = material["KHR_materials_volume"]["thicknessFactor"].as_f64().unwrap();
    assert!((thickness + block().entry_z_mm() / 1000.0).abs() < 1e-9);
    assert!(material["KHR_materials_volume"]["attenuationDistance"].as_f64().unwrap() > 0.0);
    assert_eq!(json["asset"]["extras"]["distance_mm"], 250.0);
    assert_eq!(json["asset"]["extras"]["size_mm"][1], 70.0);
    assert_eq!(json["meshes"][0]["name"], "Portrait é\nof 1865");
}

/// Takes so many bytes and then has a full disk.
struct FullAfter(usize);

impl Write for FullAfter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.0 == 0 {
            return Err(io::ErrorKind::StorageFull.into());
        }
        let taken = bytes.len().min(self.0);
        self.0 -= taken;
        Ok(taken)
    }
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_disk_that_is_full_at_any_byte_is_an_error_in_every_format() {
    let solid = block();
    for format in Format::ALL {
        let size = written(format, &solid).len();
        for room in [0, 1, 11, 79, 80, 81, 84, size / 2, size - 1] {
            let error = format.write(&mut FullAfter(room), &solid, &design()).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::StorageFull, "{format} after {room} bytes");
        }
        format.write(&mut FullAfter(size), &solid, &design()).unwrap();
    }
}

#[test]
fn the_extension_chooses_the_format() {
    for format in Format::ALL {
        let lower = format!("some.dir/block.{format}");
        assert_eq!(Format::from_path(Path::new(&lower)).unwrap(), format);
        assert_eq!(Format::from_path(Path::new(&lower.to_uppercase())).unwrap(), format);
    }
    for (path, part) in [("block.xyz", ".xyz"), ("block", "no extension"), (".stl", "no extension")] {
        let error = Format::from_path(Path::new(path)).unwrap_err().to_string();
        assert!(error.contains(part) && error.contains(".stl, .obj, .glb"), "{error}");
    }
}

#[test]
fn a_block_too_large_for_a_viewer_is_refused_before_anything_is_written() {
    let large = HeightField::new(Extent::new(500.0, 500.0), Field::filled(4500, 4500, 0.0));
    let solid = Solid::new(&large, Stock::default()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let error = export(&folder.path().join("block.glb"), &solid, &design()).unwrap_err();
    assert!(matches!(error, ExportError::TooManyForGlb { .. }), "{error}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn files_do_not_depend_on_the_number_of_threads() {
    let solid = block();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Format::ALL.map(|format| written(format, &solid)))
    };
    assert_eq!(with(1), with(3));
}
