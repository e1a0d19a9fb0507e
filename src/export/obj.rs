use super::{
    Design,
    text::{in_order, plain_decimal},
};
use crate::solid::{Face, Solid};
use std::io::{self, Write};

/// Writes Wavefront OBJ, mm, z up. Exit vertices have the normals of the smooth surface, the planes their own. Numbers are
/// the shortest that read back as the same `f32`.
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
    // OBJ counts from 1; the planes' normals follow those of the exit face. A wall all around has one for every triangle.
    let mut written = normals.len();
    for (face, triangles) in solid.faces() {
        let begin = triangles.start;
        let first = written + 1;
        match face {
            Face::Exit => {}
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
        in_order(writer, triangles, |text, t| {
            text.push(b'f');
            for v in solid.triangle(t) {
                let normal = match face {
                    Face::Exit => v as usize + 1,
                    Face::Side | Face::Inner => first + t - begin,
                    _ => first,
                };
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

fn numbers(text: &mut Vec<u8>, keyword: &str, values: [f32; 3]) {
    text.extend_from_slice(keyword.as_bytes());
    for value in values {
        text.push(b' ');
        plain_decimal(text, value);
    }
    text.push(b'\n');
}
