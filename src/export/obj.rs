use super::Design;
use crate::solid::{Face, Solid};
use rayon::prelude::*;
use std::{
    io::{self, Write},
    ops::Range,
};

/// Writes Wavefront OBJ, mm, z up. Exit vertices have the normals of the smooth surface, the planes their own. Numbers are
/// the shortest that read back as the same `f32`.
///
/// # Errors
/// Those of the writer.
pub fn write_obj(writer: &mut impl Write, solid: &Solid, design: &Design) -> io::Result<()> {
    writeln!(writer, "# glasswarp {}", design.summary(solid))?;
    writeln!(writer, "# millimetres, z up; light travels +z, the mean exit plane is z = 0, the receiver z = distance")?;
    writeln!(writer, "o {}", object_name(&design.ascii_name()))?;
    in_order(writer, 0..solid.vertex_count(), |text, v| numbers(text, "v", solid.vertex(v)))?;
    let normals = solid.exit_normals();
    in_order(writer, 0..normals.len(), |text, v| numbers(text, "vn", normals[v]))?;
    for (k, (face, triangles)) in solid.faces().into_iter().enumerate() {
        if face != Face::Exit {
            let [x, y, z] = face.normal();
            writeln!(writer, "vn {x} {y} {z}")?;
        }
        in_order(writer, triangles, |text, t| {
            text.push(b'f');
            for v in solid.triangle(t) {
                // OBJ counts from 1; the planes' normals follow those of the exit face.
                let normal = if face == Face::Exit { v as usize + 1 } else { normals.len() + k };
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

fn object_name(name: &str) -> String {
    let name = name.trim().replace(' ', "_");
    if name.is_empty() { "block".to_owned() } else { name }
}

/// Formats pieces in parallel and writes them in order, so that neither the text as a whole nor more than a few MB of it is
/// ever held.
fn in_order(
    writer: &mut impl Write,
    items: Range<usize>,
    format: impl Fn(&mut Vec<u8>, usize) + Sync,
) -> io::Result<()> {
    const PIECE: usize = 1 << 12;
    const PIECES: usize = 1 << 6;
    for start in items.clone().step_by(PIECE * PIECES) {
        let texts: Vec<Vec<u8>> = (0..PIECES)
            .into_par_iter()
            .map(|k| {
                let mut text = Vec::with_capacity(PIECE * 40);
                for item in start + k * PIECE..items.end.min(start + (k + 1) * PIECE) {
                    format(&mut text, item);
                }
                text
            })
            .collect();
        for text in &texts {
            writer.write_all(text)?;
        }
    }
    Ok(())
}

fn numbers(text: &mut Vec<u8>, keyword: &str, values: [f32; 3]) {
    text.extend_from_slice(keyword.as_bytes());
    for value in values {
        text.push(b' ');
        let mut buffer = zmij::Buffer::new();
        let shortest = buffer.format_finite(value);
        // Not every reader takes an exponent.
        if shortest.contains('e') {
            text.extend_from_slice(value.to_string().as_bytes());
        } else {
            text.extend_from_slice(shortest.strip_suffix(".0").unwrap_or(shortest).as_bytes());
        }
    }
    text.push(b'\n');
}
