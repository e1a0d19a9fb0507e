use super::{
    Design,
    text::{in_order, in_pieces, plain_decimal},
};
use crate::solid::{Face, Solid};
use std::io::{self, Write};

/// Writes Wavefront OBJ, mm, z up. Vertices of reliefs have the normals of the smooth surface, the
/// planes their own. Numbers are the shortest that read back as the same `f32`.
///
/// # Errors
/// Those of the writer.
pub fn write_obj(writer: &mut impl Write, solid: &Solid, design: &Design) -> io::Result<()> {
    writeln!(writer, "# glasswarp {}", design.summary(solid))?;
    writeln!(writer, "# {}", solid.frame_line())?;
    writeln!(writer, "o {}", object_name(&design.ascii_name()))?;
    in_order(writer, 0..solid.vertex_count(), |text, v| numbers(text, "v", solid.vertex(v)))?;
    let normals = solid.exit_normals();
    in_order(writer, 0..normals.len(), |text, v| numbers(text, "vn", normals[v]))?;
    // Vertices of an entry face that is a relief follow those of the exit face, and so do their
    // normals.
    let mut written = normals.len();
    let curved = |face| face == Face::Exit || face == Face::Entry && solid.entry_surface().is_some();
    if curved(Face::Entry) {
        let below = written..written + solid.entry_vertex_count();
        written = below.end;
        in_order(writer, below, |text, v| numbers(text, "vn", solid.normal_at(Face::Entry, v as u32)))?;
    }
    // OBJ counts from 1; the planes' normals follow those of the reliefs. A wall all around has one
    // for every triangle.
    for (face, triangles) in solid.faces() {
        let begin = triangles.start;
        let first = written + 1;
        match face {
            _ if curved(face) => {}
            Face::Side | Face::Inner => {
                written += triangles.len();
                in_order(writer, triangles.clone(), |text, t| {
                    numbers(text, "vn", solid.normal_at(face, solid.triangle(t)[0]));
                })?;
            }
            _ => {
                written += 1;
                let [x, y, z] = face.normal();
                writeln!(writer, "vn {x} {y} {z}")?;
            }
        }
        if curved(face) {
            in_pieces(writer, triangles, |text, triangles| {
                let mut corners = Corners::default();
                triangles.for_each(|t| corners.write_face(text, solid.triangle(t)));
            })?;
            continue;
        }
        in_order(writer, triangles, |text, t| {
            let normal = if matches!(face, Face::Side | Face::Inner) { first + t - begin } else { first };
            text.push(b'f');
            for v in solid.triangle(t) {
                text.push(b' ');
                text.extend_from_slice(itoa::Buffer::new().format(v + 1).as_bytes());
                text.extend_from_slice(b"//");
                text.extend_from_slice(itoa::Buffer::new().format(normal).as_bytes());
            }
            text.push(b'\n');
        })?;
    }
    Ok(())
}

/// Corners of a relief as they are written, of which each belongs to six triangles: those of
/// late.
struct Corners {
    vertices: [u32; LATE],
    texts: [[u8; LONGEST]; LATE],
    lengths: [usize; LATE],
}

/// How many are kept: more than the two rows of vertices along which a row of triangles runs need
/// at a time.
const LATE: usize = 64;
/// Length of the longest: a blank, twice a number of 32 bits, and two strokes.
const LONGEST: usize = 23;

impl Default for Corners {
    fn default() -> Self {
        Self { vertices: [u32::MAX; LATE], texts: [[b' '; LONGEST]; LATE], lengths: [0; LATE] }
    }
}

impl Corners {
    /// Writes a triangle whose vertices have the normals of the same number.
    fn write_face(&mut self, text: &mut Vec<u8>, triangle: [u32; 3]) {
        let mut line = [b'f'; 2 + 3 * LONGEST];
        let mut end = 1;
        for v in triangle {
            let k = (v.wrapping_mul(0x9e37_79b9) >> (u32::BITS - LATE.trailing_zeros())) as usize;
            if self.vertices[k] != v {
                self.vertices[k] = v;
                let mut digits = itoa::Buffer::new();
                let number = digits.format(v + 1).as_bytes();
                let (first, second) = (1, 3 + number.len());
                self.lengths[k] = second + number.len();
                self.texts[k][first..][..number.len()].copy_from_slice(number);
                self.texts[k][second - 2..second].copy_from_slice(b"//");
                self.texts[k][second..][..number.len()].copy_from_slice(number);
            }
            // Of fixed length, which is quicker than what is needed.
            line[end..end + LONGEST].copy_from_slice(&self.texts[k]);
            end += self.lengths[k];
        }
        line[end] = b'\n';
        text.extend_from_slice(&line[..=end]);
    }
}

fn object_name(name: &str) -> String {
    let name = name.trim().replace(' ', "_");
    if name.is_empty() { "block".to_owned() } else { name }
}

fn numbers(text: &mut Vec<u8>, keyword: &str, values: [f32; 3]) {
    text.extend_from_slice(keyword.as_bytes());
    for value in values {
        text.push(b' ');
        plain_decimal(text, value);
    }
    text.push(b'\n');
}
