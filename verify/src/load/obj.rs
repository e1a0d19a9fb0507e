//! Wavefront OBJ.

use super::{
    assemble::{Assembler, Failed, Normals, Points},
    error::LoadError,
    polygon,
};
use crate::mesh::Mesh;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::io::{self, Read};

/// Parses the geometry of an OBJ file, all objects together; polygons are cut into triangles,
/// materials are passed over.
pub(super) fn parse(bytes: &[u8], normals: Normals) -> Result<Mesh, LoadError> {
    let failed = |error: io::Error| LoadError::Malformed { format: "OBJ", reason: error.to_string() };
    stream(&mut &*bytes, normals, &failed)?.map_or_else(|| any(bytes), Ok)
}

/// Parses a file of nothing but triangles by absolute indices, as most large ones are, on all cores
/// and without holding it as a whole. `None` for any other, of which a part has been read.
pub(super) fn stream(file: &mut impl Read, normals: Normals, failed: Failed<'_>) -> Result<Option<Mesh>, LoadError> {
    let (mut assembler, mut points, mut directions) = (Assembler::new(0), Points::new(Vec::new()), Vec::new());
    let (mut pieces, mut line) = (vec![Vec::new(); PIECES], Vec::new());
    loop {
        if !read(file, &mut pieces, &mut line, failed)? {
            return Ok(None);
        }
        if pieces[0].is_empty() {
            break;
        }
        let parsed: Option<Vec<PlainPiece>> = pieces.par_iter().map(|piece| plain(piece, normals)).collect();
        let Some(parsed) = parsed else { return Ok(None) };
        for piece in parsed {
            points.extend(piece.positions.iter().map(|v| v.as_dvec3()));
            directions.extend(piece.directions.iter().map(|v| v.as_dvec3()));
            let known =
                |corners: &[[u32; 3]], count: usize| corners.as_flattened().iter().all(|&k| (k as usize) < count);
            // Files may speak of what comes later, or be broken.
            if !known(&piece.triangles, points.len()) || !known(&piece.normals, directions.len()) {
                return Ok(None);
            }
            for corners in piece.triangles {
                assembler.numbered(&mut points, corners.map(|k| k as usize), nothing)?;
            }
            assembler.normal_corners.extend(piece.normals);
        }
    }
    if !directions.is_empty() && assembler.normal_corners.len() != assembler.triangles.len() {
        return Ok(None);
    }
    assembler.finish(directions).map(Some)
}

fn nothing(index: usize) -> LoadError {
    LoadError::Malformed { format: "OBJ", reason: format!("index {index} points at nothing") }
}

/// Bytes parsed by one task, and tasks at a time.
const PIECE: usize = 1 << 20;
const PIECES: usize = 16;

/// Fills pieces with whole lines of a file; what is left of the last line stays in `line`. Tells
/// whether no line is longer than a piece.
fn read(
    file: &mut impl Read,
    pieces: &mut [Vec<u8>],
    line: &mut Vec<u8>,
    failed: Failed<'_>,
) -> Result<bool, LoadError> {
    for piece in pieces {
        piece.clear();
        piece.append(line);
        if file.take(PIECE as u64).read_to_end(piece).map_err(failed)? > 0 {
            let Some(end) = piece.iter().rposition(|&b| b == b'\n') else { return Ok(false) };
            line.extend_from_slice(&piece[end + 1..]);
            piece.truncate(end + 1);
        }
    }
    Ok(true)
}

/// What a piece of a plain file holds.
#[derive(Default)]
struct PlainPiece {
    positions: Vec<Vec3>,
    directions: Vec<Vec3>,
    /// Corners, counted from 0.
    triangles: Vec<[u32; 3]>,
    /// Of every triangle, or of none.
    normals: Vec<[u32; 3]>,
}

fn plain(mut text: &[u8], normals: Normals) -> Option<PlainPiece> {
    let mut piece = PlainPiece::default();
    while let [first, after @ ..] = text {
        text = match (first, after) {
            (b'v', [b' ' | b'\t', after @ ..]) => vector(after, &mut piece.positions)?,
            (b'v', [b'n', b' ' | b'\t', after @ ..]) if normals == Normals::Read => {
                vector(after, &mut piece.directions)?
            }
            (b'v', [b'n', b' ' | b'\t', ..]) => rest_of_line(after),
            (b'f', [b' ' | b'\t', after @ ..]) => triangle(after, normals, &mut piece)?,
            (b'#', _) | (b'o' | b'g' | b's', [b' ' | b'\t' | b'\r' | b'\n', ..]) => rest_of_line(after),
            (b' ' | b'\t' | b'\r' | b'\n', after) => after,
            _ => return None,
        };
    }
    Some(piece)
}

/// The text from the next end of a line on.
fn rest_of_line(text: &[u8]) -> &[u8] {
    &text[text.iter().position(|&b| b == b'\n').unwrap_or(text.len())..]
}

/// The text after blanks.
fn after_blanks(mut text: &[u8]) -> &[u8] {
    while let [b' ' | b'\t', after @ ..] = text {
        text = after;
    }
    text
}

/// Whether a word ends where this text begins.
fn ends_here(text: &[u8]) -> bool {
    matches!(text, [] | [b' ' | b'\t' | b'\r' | b'\n', ..])
}

/// The text from the end of a line on, if nothing but blanks stands before it.
fn line_end(text: &[u8]) -> Option<&[u8]> {
    match after_blanks(text) {
        rest @ ([] | [b'\n', ..] | [b'\r', b'\n', ..] | [b'\r']) => Some(rest),
        _ => None,
    }
}

/// Reads three numbers of single precision, and no more.
fn vector<'a>(mut text: &'a [u8], vectors: &mut Vec<Vec3>) -> Option<&'a [u8]> {
    let mut vector = [0.0; 3];
    for value in &mut vector {
        let number = after_blanks(text);
        let length;
        (*value, length) = fast_float2::parse_partial::<f32, _>(number).ok()?;
        text = &number[length..];
        if !ends_here(text) {
            return None;
        }
    }
    vectors.push(vector.into());
    line_end(text)
}

/// Reads three corners, and no more: all with normals, or none.
fn triangle<'a>(mut text: &'a [u8], reading: Normals, piece: &mut PlainPiece) -> Option<&'a [u8]> {
    let (mut corners, mut normals, mut with_normals) = ([0; 3], [0; 3], 0);
    for (corner, normal) in corners.iter_mut().zip(&mut normals) {
        (*corner, text) = number(after_blanks(text))?;
        if let [b'/', b'/', after @ ..] = text {
            (*normal, text) = number(after)?;
            with_normals += 1;
        }
        if !ends_here(text) {
            return None;
        }
    }
    piece.triangles.push(corners);
    match with_normals {
        0 => {}
        3 if reading == Normals::Read => piece.normals.push(normals),
        3 => {}
        _ => return None,
    }
    line_end(text)
}

/// A number that is counted from 1, as one from 0, and what comes after its digits.
fn number(text: &[u8]) -> Option<(u32, &[u8])> {
    let (mut value, mut rest) = (0u32, text);
    while let [digit @ b'0'..=b'9', after @ ..] = rest {
        value = value.checked_mul(10)?.checked_add(u32::from(digit - b'0'))?;
        rest = after;
    }
    Some((value.checked_sub(1)?, rest))
}

/// Parses any file.
fn any(bytes: &[u8]) -> Result<Mesh, LoadError> {
    let malformed = |reason: String| LoadError::Malformed { format: "OBJ", reason };
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        return Err(malformed("it is text in UTF-16, which is not understood: save it as ASCII or UTF-8".into()));
    }
    let options = tobj::LoadOptions { ignore_points: true, ignore_lines: true, ..tobj::LoadOptions::default() };
    let no_materials = |_: &std::path::Path| Ok(Default::default());
    let (models, _) = tobj::load_obj_buf(&mut &*geometry(bytes), &options, no_materials)
        .map_err(|error| malformed(error.to_string()))?;
    let mut assembler = Assembler::new(models.iter().map(|m| m.mesh.indices.len() / 3).sum());
    let mut directions = Vec::new();
    for model in &models {
        let mesh = &model.mesh;
        let vectors = |of: &[f32]| -> Vec<DVec3> {
            of.chunks_exact(3).map(|v| DVec3::new(v[0].into(), v[1].into(), v[2].into())).collect()
        };
        let mut points = Points::new(vectors(&mesh.positions));
        let first_normal = directions.len();
        directions.extend(vectors(&mesh.normals));
        let indices = |of: &[u32], first: usize| -> Vec<usize> { of.iter().map(|&k| first + k as usize).collect() };
        let (corners, normals) = (indices(&mesh.indices, 0), indices(&mesh.normal_indices, first_normal));
        if let Some(&k) = normals.iter().find(|&&k| k >= directions.len()) {
            return Err(nothing(k));
        }
        let with_normals = !normals.is_empty() && normals.len() == corners.len();
        // Faces of three corners only have no list of their numbers of corners.
        let threes = corners.len() / 3;
        let arities = mesh.face_arities.iter().map(|&count| count as usize);
        let all_threes = std::iter::repeat_n(3, if mesh.face_arities.is_empty() { threes } else { 0 });
        let mut first = 0;
        for count in arities.chain(all_threes) {
            let face = first..first + count;
            first += count;
            let Some(of_face) = corners.get(face.clone()) else { return Err(malformed("a face is cut off".into())) };
            polygon::add(&mut assembler, &mut points, of_face, with_normals.then(|| &normals[face]), nothing)?;
        }
    }
    assembler.finish(directions)
}

/// The lines that tell a shape, as the library reads them: without notes behind them, each in one
/// piece, in ASCII.
fn geometry(bytes: &[u8]) -> Vec<u8> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut lines = Vec::with_capacity(bytes.len());
    let mut goes_on = false;
    for line in bytes.split(|&byte| byte == b'\n' || byte == b'\r') {
        let line = line.split(|&byte| byte == b'#').next().unwrap_or_default().trim_ascii();
        let (line, more) = line.strip_suffix(b"\\").map_or((line, false), |line| (line, true));
        let keyword = line.split(u8::is_ascii_whitespace).next().unwrap_or_default();
        if line.is_empty() && goes_on {
            continue; // Between the two characters that end a line.
        }
        if goes_on || matches!(keyword, b"v" | b"vn" | b"vt" | b"f" | b"o" | b"g") {
            lines.extend(line.iter().map(|&byte| if byte.is_ascii() { byte } else { b'?' }));
            lines.push(if more { b' ' } else { b'\n' });
        }
        goes_on = more;
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quads_objects_and_normals_are_read() {
        let mesh = parse(
            b"mtllib none.mtl\no a\nv 0 0 0\nv 1 0 0\nv 1 1 0.25\nv 0 1 0\nvn 0 0 1\nvn 0 0 -1\nf 1//1 2//1 3//1 4//1\no b\nf 3//2 2//2 1//2\n",
            Normals::Read,
        )
        .unwrap();
        assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (4, 3));
        assert_eq!(mesh.vertices[2], DVec3::new(1.0, 1.0, 0.25));
        let normals = mesh.normals.unwrap();
        assert_eq!(normals.directions[normals.corners[0][1] as usize], DVec3::Z);
        assert_eq!(normals.directions[normals.corners[2][0] as usize], DVec3::NEG_Z);
    }

    fn is_plain(text: &str) -> bool {
        matches!(stream(&mut text.as_bytes(), Normals::Read, &|source| panic!("{source}")), Ok(Some(_)) | Err(_))
    }

    #[test]
    fn plain_files_are_read_as_any_are() {
        let with_normals = "o a\nv 0 0 0\nv 1 0 0\nv 1 1e-1 0.25\n# five\nv 0 1 -0\nv 0 1 0\nvn 0 0 1\nvn 1 0 0\nf 2//1 3//1 1//2\ng b\nf 1//2 5//2 3//1\n";
        let without = "v 0 0 0\r\nv 1 0 0\r\n\nv 1 1 0\nf 1 2 3\nf 3 2 1";
        for text in [with_normals, without] {
            assert!(is_plain(text));
            let (ours, theirs) = (parse(text.as_bytes(), Normals::Read).unwrap(), any(text.as_bytes()).unwrap());
            assert_eq!((&ours.vertices, &ours.triangles), (&theirs.vertices, &theirs.triangles));
            let told = |mesh: &Mesh| {
                let normals = mesh.normals.as_ref()?;
                Some(normals.corners.iter().map(|c| c.map(|k| normals.directions[k as usize])).collect::<Vec<_>>())
            };
            assert_eq!(told(&ours), told(&theirs));
            let bare = parse(text.as_bytes(), Normals::PassOver).unwrap();
            assert_eq!(bare, Mesh { normals: None, ..ours });
        }
        for other in [
            "v 0 0 0 1\n",
            "v 0 0\n",
            "vt 0 0\n",
            "f 1 2 3 4\n",
            "f 1/1 2/1 3/1\n",
            "f -1 -2 -3\n",
            "f 0 1 2\n",
            "v 0 0 0\nf 1 1 2\n",
            "v 0 0 0\nvn 0 0 1\nf 1 1 1\n",
            "l 1 2\n",
            "usemtl a\n",
            "f 1 2 \\\n3\n",
        ] {
            assert!(!is_plain(other), "{other}");
        }
    }

    #[test]
    fn every_dialect_is_the_same_solid() {
        let plain = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 2\nf 1 4 3 2\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n";
        let mesh = parse(plain.as_bytes(), Normals::Read).unwrap();
        assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (5, 6));
        assert!((mesh.volume_mm3() - 2.0 / 3.0).abs() < 1e-12);
        let colour = |line: &str| format!("{line}{}\n", if line.starts_with('v') { " 0.5 0.5 0.5" } else { "" });
        let coloured: String = plain.lines().map(colour).collect();
        for text in [
            plain.replace("f 1 4 3 2", "f -5 -2 -3 -4"),
            plain.replace("f 1 4 3 2\n", "").replace("v 0.5", "f 1 4 3 2\nv 0.5"),
            plain.replace("f 1 4 3 2\n", "").replace("v 0.5", "f -4 -1 -2 -3\nv 0.5"),
            coloured,
            plain.replace("f 1 4 3 2", "f 1 4 \\\n3 2"),
            plain.replace("f 1 4 3 2", "f 1 4 \\\r\n3 2"),
            plain.replace("f 1 4 3 2", "f 1 4 3 2 # the floor"),
            plain.replace("f 1 4 3 2", "# L\u{e4}nge\nf 1 4 3 2"),
            plain.replace("f 1 4 3 2", "vt 0 0\nusemtl glass\ns off\nf 1/1 4/1 3/1 2/1"),
            plain.replace("f 1 4 3 2", "l 1 2\np 1\ncurv 0 1\nf 1 4 3 2"),
            plain.replace('\n', "\r\n"),
            plain.replace('\n', "\r"),
            plain.replace(' ', " \t "),
            format!("\u{feff}{plain}"),
        ] {
            let found = parse(text.as_bytes(), Normals::Read);
            let same = |found: &Mesh| found.vertices.len() == 5 && (found.volume_mm3() - 2.0 / 3.0).abs() < 1e-12;
            assert!(found.as_ref().is_ok_and(same), "{found:?} of\n{text}");
        }
        let latin = [b"# L\xe4nge\n", plain.as_bytes()].concat();
        assert_eq!(parse(&latin, Normals::Read).unwrap(), mesh);
    }

    #[test]
    fn long_files_are_read_in_pieces_that_keep_their_order() {
        let n = 100_000;
        let mut text = String::new();
        (0..n).for_each(|k| text += &format!("v {k} {} 0.5\n", k % 7));
        (0..n - 2).for_each(|k| text += &format!("f {} {} {}\n", k + 1, k + 3, k + 2));
        assert!(text.len() > 2 * PIECE);
        let mesh = parse(text.as_bytes(), Normals::Read).unwrap();
        assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (n, n - 2));
        assert!(mesh.corners(n - 3).iter().zip([n - 3, n - 1, n - 2]).all(|(at, k)| at.x == k as f64));
        assert_eq!(mesh, any(text.as_bytes()).unwrap());
    }

    #[test]
    fn broken_files_are_named() {
        for broken in
            [&b"v 0 0 0\nf 1 2 3\n"[..], b"v a b c\n", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -9\n", b"\xff\xfe\n"]
        {
            assert!(
                matches!(parse(broken, Normals::Read), Err(LoadError::Malformed { .. })),
                "{:?}",
                parse(broken, Normals::Read)
            );
        }
        assert!(matches!(parse(b"# nothing\n", Normals::Read), Err(LoadError::Empty)));
        assert!(matches!(
            parse(b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", Normals::Read),
            Err(LoadError::NotFinite { .. })
        ));
    }
}
