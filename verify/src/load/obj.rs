//! Wavefront OBJ.

use super::{Assembler, Failed, LoadError, Normals, Points};
use crate::mesh::Mesh;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::io::{self, Read};

/// Parses the geometry of an OBJ file, all objects together; polygons are cut into fans, materials are passed over.
pub(super) fn parse(bytes: &[u8], normals: Normals) -> Result<Mesh, LoadError> {
    let failed = |error: io::Error| LoadError::Malformed { format: "OBJ", reason: error.to_string() };
    stream(&mut &*bytes, normals, &failed)?.map_or_else(|| any(bytes), Ok)
}

/// Parses a file of nothing but triangles by absolute indices, as most large ones are, on all cores and without holding it as a whole.
/// `None` for any other, of which a part has been read.
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
        let parsed: Option<Vec<Plain>> = pieces.par_iter().map(|piece| plain(piece, normals)).collect();
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

/// Fills pieces with whole lines of a file; what is left of the last line stays in `line`. Tells whether no line is longer than a piece.
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
struct Plain {
    positions: Vec<Vec3>,
    directions: Vec<Vec3>,
    /// Corners, counted from 0.
    triangles: Vec<[u32; 3]>,
    /// Of every triangle, or of none.
    normals: Vec<[u32; 3]>,
}

fn plain(mut text: &[u8], normals: Normals) -> Option<Plain> {
    let mut piece = Plain::default();
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
fn triangle<'a>(mut text: &'a [u8], wanted: Normals, piece: &mut Plain) -> Option<&'a [u8]> {
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
        3 if wanted == Normals::Read => piece.normals.push(normals),
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
fn any(mut bytes: &[u8]) -> Result<Mesh, LoadError> {
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
        let vectors = |of: &[f32]| -> Vec<DVec3> {
            of.chunks_exact(3).map(|v| DVec3::new(v[0].into(), v[1].into(), v[2].into())).collect()
        };
        let mut points = Points::new(vectors(&mesh.positions));
        let first_normal = directions.len() as u32;
        directions.extend(vectors(&mesh.normals));
        for corners in mesh.indices.chunks_exact(3) {
            assembler.numbered(&mut points, [corners[0], corners[1], corners[2]].map(|k| k as usize), nothing)?;
        }
        for corners in mesh.normal_indices.chunks_exact(3) {
            let corners = [corners[0], corners[1], corners[2]].map(|k| first_normal + k);
            if let Some(&k) = corners.iter().find(|&&k| k as usize >= directions.len()) {
                return Err(nothing(k as usize));
            }
            assembler.normal_corners.push(corners);
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
