use super::Design;
use crate::solid::{Solid, cross, sub};
use std::io::{self, Write};
use stl_io::{Normal, Triangle, Vertex};

/// Bytes of an STL header.
const HEADER: usize = 80;

/// Writes binary STL, mm, with facet normals, and unit and design in the header.
///
/// # Errors
/// Those of the writer.
pub fn write_stl(writer: &mut impl Write, solid: &Solid, design: &Design) -> io::Result<()> {
    let mut headed = Headed { header: header(solid, design), written: 0, writer };
    stl_io::write_stl(&mut headed, Facets { solid, next: 0, count: solid.triangle_count() })?;
    headed.flush()
}

fn header(solid: &Solid, design: &Design) -> [u8; HEADER] {
    // A binary STL must not begin with "solid": that is how the text form is told.
    let text = format!("glasswarp {}", design.summary(solid));
    let mut header = [b' '; HEADER];
    for (byte, character) in header.iter_mut().zip(text.bytes()) {
        *byte = character;
    }
    header
}

/// Puts our header in the place of the one that the encoder leaves empty.
struct Headed<W> {
    header: [u8; HEADER],
    written: usize,
    writer: W,
}

impl<W: Write> Write for Headed<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let rest = self.header.get(self.written..).unwrap_or_default();
        let bytes = if rest.is_empty() { bytes } else { &rest[..rest.len().min(bytes.len())] };
        let written = self.writer.write(bytes)?;
        self.written = self.written.saturating_add(written);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

struct Facets<'a> {
    solid: &'a Solid,
    next: usize,
    count: usize,
}

impl Iterator for Facets<'_> {
    type Item = Triangle;

    fn next(&mut self) -> Option<Triangle> {
        if self.next == self.count {
            return None;
        }
        let vertices = self.solid.corners(self.next);
        self.next += 1;
        Some(Triangle { normal: Normal::new(facet_normal(vertices)), vertices: vertices.map(Vertex::new) })
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.count - self.next, Some(self.count - self.next))
    }
}

impl ExactSizeIterator for Facets<'_> {}

/// Unit normal of a triangle by the right-hand rule.
fn facet_normal(vertices: [[f32; 3]; 3]) -> [f32; 3] {
    let [a, b, c] = vertices.map(|v| v.map(f64::from));
    let n = cross(sub(b, a), sub(c, a));
    let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
    // `+ 0.0` turns a negative zero into a positive one.
    n.map(|component| (component / length) as f32 + 0.0)
}
