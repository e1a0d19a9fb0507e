//! OBJ, PLY and OFF: meshes of triangles, quads and polygons.

use super::{Case, EXACT, Original, Outcome, case};
use glasswarp_verify::{
    Mesh,
    load::Format::{Obj, Off, Ply},
};
use std::{collections::BTreeMap, fmt::Write as _};

/// The faces with pairs of triangles joined, and the entry face as one polygon.
fn polygons(mesh: &Mesh) -> Vec<Vec<u32>> {
    let floor = mesh.bounds().0.z;
    let is_floor = |t: &[u32; 3]| t.iter().all(|&v| mesh.vertices[v as usize].z == floor);
    let edges = |t: [u32; 3]| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
    let (entry, others): (Vec<[u32; 3]>, Vec<[u32; 3]>) = mesh.triangles.iter().partition(|t| is_floor(t));
    let all: Vec<(u32, u32)> = entry.iter().flat_map(|&t| edges(t)).collect();
    let next: BTreeMap<u32, u32> = all.iter().copied().filter(|&(a, b)| !all.contains(&(b, a))).collect();
    let first = *next.keys().next().unwrap();
    let mut around = vec![first];
    while next[around.last().unwrap()] != first {
        around.push(next[around.last().unwrap()]);
    }
    assert_eq!(around.len(), next.len());
    let mut faces = vec![around];
    let mut k = 0;
    while k < others.len() {
        let joined = others.get(k + 1).and_then(|&second| {
            let (u, v) = edges(others[k]).into_iter().find(|&(u, v)| edges(second).contains(&(v, u)))?;
            let apart = |t: [u32; 3]| t.into_iter().find(|&c| c != u && c != v);
            Some(vec![u, apart(second)?, v, apart(others[k])?])
        });
        k += if joined.is_some() { 2 } else { 1 };
        faces.push(joined.unwrap_or_else(|| others[k - 1].to_vec()));
    }
    assert!(faces.iter().filter(|face| face.len() == 4).count() > 80);
    faces
}

fn triangles(mesh: &Mesh) -> Vec<Vec<u32>> {
    mesh.triangles.iter().map(|t| t.to_vec()).collect()
}

/// OBJ with so much behind every vertex, and corners written by `corner`.
fn obj(mesh: &Mesh, faces: &[Vec<u32>], behind: &str, corner: &dyn Fn(u32) -> String) -> String {
    let mut text = String::from("# a block\no block\n");
    mesh.vertices.iter().for_each(|v| writeln!(text, "v {:?} {:?} {:?}{behind}", v.x, v.y, v.z).unwrap());
    for face in faces {
        writeln!(text, "f {}", face.iter().map(|&v| corner(v)).collect::<Vec<_>>().join(" ")).unwrap();
    }
    text
}

/// OBJ whose vertices stand just before the first face that uses them, by absolute or negative
/// numbers.
fn interleaved(mesh: &Mesh, negative: bool) -> String {
    let (mut text, mut numbers) = (String::new(), vec![0; mesh.vertices.len()]);
    let mut count = 0;
    for triangle in &mesh.triangles {
        for &v in triangle {
            if numbers[v as usize] == 0 {
                let at = mesh.vertices[v as usize];
                writeln!(text, "v {:?} {:?} {:?}", at.x, at.y, at.z).unwrap();
                count += 1;
                numbers[v as usize] = count;
            }
        }
        let index = |v: u32| if negative { numbers[v as usize] - count - 1 } else { numbers[v as usize] };
        writeln!(text, "f {} {} {}", index(triangle[0]), index(triangle[1]), index(triangle[2])).unwrap();
    }
    text
}

#[derive(Clone, Copy)]
enum Encoding {
    Text,
    Little,
    Big,
}

/// PLY with these types for coordinates, numbers of corners and corners.
fn ply(mesh: &Mesh, faces: &[Vec<u32>], encoding: Encoding, [real, count, index]: [&str; 3], more: bool) -> Vec<u8> {
    let (name, big) = match encoding {
        Encoding::Text => ("ascii", false),
        Encoding::Little => ("binary_little_endian", false),
        Encoding::Big => ("binary_big_endian", true),
    };
    let extra = if more { "property uchar red\n" } else { "" };
    let between = if more { "element material 1\nproperty list uchar float ambient\nproperty int shine\n" } else { "" };
    let mut bytes = format!(
        "ply\nformat {name} 1.0\ncomment a block\nelement vertex {}\nproperty {real} x\nproperty {real} y\nproperty {real} z\n{extra}\
         {between}element face {}\nproperty list {count} {index} vertex_indices\n{extra}end_header\n",
        mesh.vertices.len(),
        faces.len()
    )
    .into_bytes();
    let put = |bytes: &mut Vec<u8>, kind: &str, value: f64| {
        let mut little = match kind {
            _ if matches!(encoding, Encoding::Text) => {
                bytes.extend(format!("{value} ").bytes());
                return;
            }
            "double" => value.to_le_bytes().to_vec(),
            "float" => (value as f32).to_le_bytes().to_vec(),
            "uchar" => vec![value as u8],
            "ushort" => (value as u16).to_le_bytes().to_vec(),
            _ => (value as i32).to_le_bytes().to_vec(),
        };
        if big {
            little.reverse();
        }
        bytes.extend(little);
    };
    let line = |bytes: &mut Vec<u8>| {
        if matches!(encoding, Encoding::Text) {
            bytes.push(b'\n');
        }
    };
    for v in &mesh.vertices {
        v.to_array().iter().for_each(|c| put(&mut bytes, real, *c));
        if more {
            put(&mut bytes, "uchar", 200.0);
        }
        line(&mut bytes);
    }
    if more {
        for (kind, value) in [("uchar", 2.0), ("float", 0.5), ("float", 0.25), ("int", 3.0)] {
            put(&mut bytes, kind, value);
        }
        line(&mut bytes);
    }
    for face in faces {
        put(&mut bytes, count, face.len() as f64);
        face.iter().for_each(|&v| put(&mut bytes, index, v.into()));
        if more {
            put(&mut bytes, "uchar", 7.0);
        }
        line(&mut bytes);
    }
    bytes
}

fn off(mesh: &Mesh, faces: &[Vec<u32>], head: &str, of_vertex: &str, of_face: &str) -> String {
    let mut text = format!("{head}{} {} 0\n", mesh.vertices.len(), faces.len());
    mesh.vertices.iter().for_each(|v| writeln!(text, "{:?} {:?} {:?}{of_vertex}", v.x, v.y, v.z).unwrap());
    for face in faces {
        let corners: Vec<String> = face.iter().map(u32::to_string).collect();
        writeln!(text, "{} {}{of_face}", face.len(), corners.join(" ")).unwrap();
    }
    text
}

pub(super) fn cases(original: &Original) -> Vec<Case> {
    let mesh = &original.mesh;
    let (threes, mixed) = (triangles(mesh), polygons(mesh));
    let number = |v: u32| (v + 1).to_string();
    let plain = obj(mesh, &threes, "", &number);
    let same = |kind: &str, from, format, bytes: Vec<u8>| case(kind, from, format, bytes, Outcome::Block(EXACT));
    let refused =
        |kind: &str, from, format, bytes: Vec<u8>, words| case(kind, from, format, bytes, Outcome::Refused(words));
    let wide: Vec<u8> = std::iter::once(0xfeff).chain(plain.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    let small = ["float", "uchar", "int"];
    let text = String::from_utf8(ply(mesh, &threes, Encoding::Text, small, false)).unwrap();
    let strips = {
        let header = text.replace(
            &format!("element face {}\nproperty list uchar int", threes.len()),
            "element tristrips 1\nproperty list int int",
        );
        let body = header.find(&format!("\n3 {}", threes[0][0])).unwrap();
        let joined: Vec<String> = threes.iter().map(|t| format!("{} {} {}", t[0], t[1], t[2])).collect();
        format!("{}\n{} {}\n", &header[..body], 4 * threes.len() - 1, joined.join(" -1 "))
    };
    let whole = ply(mesh, &threes, Encoding::Little, small, false);
    vec![
        same("as we write it", "glasswarp", Obj, original.exported("obj")),
        same(
            "negative indices",
            "ZBrush, scripts",
            Obj,
            obj(mesh, &threes, "", &|v| (i64::from(v) - mesh.vertices.len() as i64).to_string()).into(),
        ),
        same("quads, and the entry face as one polygon", "Blender, Rhino", Obj, obj(mesh, &mixed, "", &number).into()),
        same("vertices and faces in turns", "SketchUp, scripts", Obj, interleaved(mesh, false).into()),
        same("the same with negative indices", "scripts", Obj, interleaved(mesh, true).into()),
        same("colours of vertices", "MeshLab, scanners", Obj, obj(mesh, &threes, " 0.5 0.25 1", &number).into()),
        same("a fourth coordinate", "old exporters", Obj, obj(mesh, &threes, " 1.0", &number).into()),
        same("lines that go on", "Alias, Maya", Obj, plain.replace("f ", "f \\\n").into()),
        same("notes behind the numbers", "hand-made files", Obj, plain.replace("\nf", " # note\nf").into()),
        same("notes in Latin-1", "old programs", Obj, [b"# L\xe4nge\n", plain.as_bytes()].concat()),
        same(
            "textures, materials, groups",
            "3ds Max",
            Obj,
            format!(
                "mtllib a.mtl\nvt 0 0\ng u\nusemtl m\ns 1\n{}",
                obj(mesh, &threes, "", &|v| format!("{}/1", v + 1))
            )
            .into(),
        ),
        same("lines and points beside the faces", "Rhino", Obj, format!("{plain}l 1 2 3\np 4\n").into()),
        same("lines end with CR LF", "Windows", Obj, plain.replace('\n', "\r\n").into()),
        same("lines end with CR", "old Macintosh programs", Obj, plain.replace('\n', "\r").into()),
        same("a byte order mark", "editors under Windows", Obj, format!("\u{feff}{plain}").into()),
        same(
            "two objects that share vertices",
            "assemblies",
            Obj,
            plain.replacen("\nf 1 ", "\no second\nf 1 ", 1).into(),
        ),
        refused("an index beyond the vertices", "cut files", Obj, format!("{plain}f 1 2 9999\n").into(), "OBJ"),
        refused("text in UTF-16", "PowerShell redirection", Obj, wide, "UTF-16"),
        same("text", "MeshLab, Blender", Ply, text.clone().into()),
        same("little endian", "MeshLab, Open3D", Ply, whole.clone()),
        same("big endian", "Stanford's scanners", Ply, ply(mesh, &threes, Encoding::Big, small, false)),
        same(
            "doubles",
            "CloudCompare, Open3D",
            Ply,
            ply(mesh, &threes, Encoding::Little, ["double", "uchar", "int"], false),
        ),
        same("quads and a polygon", "Blender", Ply, ply(mesh, &mixed, Encoding::Big, small, false)),
        same(
            "numbers of corners as int",
            "trimesh, VCG",
            Ply,
            ply(mesh, &mixed, Encoding::Little, ["float", "int", "int"], false),
        ),
        same(
            "numbers of corners and corners as ushort",
            "compact writers",
            Ply,
            ply(mesh, &mixed, Encoding::Little, ["float", "ushort", "ushort"], false),
        ),
        same(
            "other properties and elements",
            "scanners, MeshLab",
            Ply,
            ply(mesh, &threes, Encoding::Little, small, true),
        ),
        same("the same as text", "scanners, MeshLab", Ply, ply(mesh, &mixed, Encoding::Text, small, true)),
        same("strips of triangles", "Stanford's archive", Ply, strips.into()),
        same("text, lines end with CR LF", "Windows", Ply, text.replace('\n', "\r\n").into()),
        same("binary, its header with CR LF", "Windows", Ply, {
            let end = whole.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
            let header = String::from_utf8(whole[..end].to_vec()).unwrap().replace('\n', "\r\n");
            [header.as_bytes(), &whole[end..]].concat()
        }),
        refused("cut off", "broken downloads", Ply, whole[..whole.len() - 5].into(), "ends before its last element"),
        refused(
            "a cloud of points",
            "scanners",
            Ply,
            text[..text.find("\n3 ").unwrap()]
                .replace(&format!("element face {}", threes.len()), "element face 0")
                .into(),
            "no triangles",
        ),
        same("triangles", "CGAL, Geomview", Off, off(mesh, &threes, "OFF\n", "", "").into()),
        same("quads and a polygon", "CGAL", Off, off(mesh, &mixed, "OFF\n", "", "").into()),
        same(
            "counts beside the keyword",
            "ModelNet",
            Off,
            off(mesh, &threes, "OFF", "", "").replacen("OFF", "OFF ", 1).into(),
        ),
        same("no keyword", "scripts", Off, off(mesh, &threes, "", "", "").into()),
        same(
            "colours of vertices and faces",
            "MeshLab, OpenSCAD",
            Off,
            off(mesh, &mixed, "COFF\n", " 200 10 10 255", " 255 255 0").into(),
        ),
        same("notes and empty lines", "hand-made files", Off, off(mesh, &threes, "OFF # mm\n\n", " # at", "").into()),
        refused("binary", "Geomview", Off, b"OFF BINARY\n\0\0\0\x04\0\0\0\x04\0\0\0\0".to_vec(), "binary"),
        refused(
            "of four dimensions",
            "Geomview",
            Off,
            off(mesh, &threes, "4OFF\n", " 1", "").into(),
            "other dimensions",
        ),
    ]
}
