use super::Design;
use crate::solid::Solid;
use rayon::prelude::*;
use std::io::{self, Write};

/// Writes binary PLY, mm, z up.
///
/// # Errors
/// Those of the writer.
pub fn write_ply(writer: &mut impl Write, solid: &Solid, design: &Design) -> io::Result<()> {
    let (vertices, triangles) = (solid.vertex_count(), solid.triangle_count());
    writeln!(writer, "ply\nformat binary_little_endian 1.0")?;
    writeln!(writer, "comment glasswarp {}\ncomment {}", design.summary(solid), solid.frame_line())?;
    writeln!(writer, "element vertex {vertices}\nproperty float x\nproperty float y\nproperty float z")?;
    writeln!(writer, "element face {triangles}\nproperty list uchar uint vertex_indices\nend_header")?;
    pieces(writer, vertices, |v| solid.vertex(v).map(f32::to_le_bytes).as_flattened().to_vec())?;
    pieces(writer, triangles, |t| {
        let corners = solid.triangle(t).map(u32::to_le_bytes);
        [&[3], corners.as_flattened()].concat()
    })?;
    writer.flush()
}

fn pieces(writer: &mut impl Write, count: usize, item: impl Fn(usize) -> Vec<u8> + Sync) -> io::Result<()> {
    const PIECE: usize = 1 << 16;
    for start in (0..count).step_by(PIECE) {
        let bytes: Vec<u8> = (start..count.min(start + PIECE)).into_par_iter().flat_map_iter(&item).collect();
        writer.write_all(&bytes)?;
    }
    Ok(())
}
