//! STL, binary and text.

mod fault;
mod text;

use super::{
    assemble::{Assembler, Failed},
    error::LoadError,
};
use crate::mesh::Mesh;
use fault::malformed;
use glam::DVec3;
use std::io::{self, Read};

const HEADER: usize = 84;
const RECORD: usize = 50;
/// Records read at a time.
const RECORDS: usize = 1 << 12;

/// Parses an STL file of either kind.
///
/// A file whose length fits its count is binary, whatever its header says: many programs begin a
/// binary file with "solid".
pub(super) fn parse(bytes: &[u8]) -> Result<Mesh, LoadError> {
    let promised = bytes.first_chunk().map(count);
    let exact = promised.is_some_and(|n| is_binary(n, bytes.len() as u64));
    if !exact && text::is_text(bytes)? {
        return text::parse(bytes);
    }
    let Some(promised) = promised else {
        return Err(malformed(format!("{} bytes are too few for a header", bytes.len())));
    };
    let (held, rest) = ((bytes.len() - HEADER) / RECORD, (bytes.len() - HEADER) % RECORD);
    if promised > held as u64 {
        return Err(LoadError::Truncated { promised, held: held as u64 });
    }
    // A few bytes behind the last triangle are some program's own; whole triangles were forgotten
    // in the count.
    if !exact && rest == 0 {
        return Err(malformed(format!("its header promises {promised} triangles, and it holds {held}")));
    }
    let failed = |error: io::Error| malformed(error.to_string());
    binary(&mut &bytes[HEADER..], promised as usize, &failed)
}

/// Parses a binary file of this length without holding it as a whole. `None` for any other, of
/// which the beginning has been read.
pub(super) fn stream(file: &mut impl Read, length: u64, failed: Failed<'_>) -> Result<Option<Mesh>, LoadError> {
    let mut header = [0; HEADER];
    if length < HEADER as u64 {
        return Ok(None);
    }
    file.read_exact(&mut header).map_err(failed)?;
    let promised = count(&header);
    is_binary(promised, length).then(|| binary(file, promised as usize, failed)).transpose()
}

/// Triangles that a header promises.
fn count(header: &[u8; HEADER]) -> u64 {
    header.last_chunk().map_or(0, |&count| u32::from_le_bytes(count)).into()
}

fn is_binary(promised: u64, length: u64) -> bool {
    HEADER as u64 + promised * RECORD as u64 == length
}

fn binary(records: &mut impl Read, mut count: usize, failed: Failed<'_>) -> Result<Mesh, LoadError> {
    let mut assembler = Assembler::new(count);
    let mut buffer = vec![0; RECORD * RECORDS.min(count)];
    while count > 0 {
        let taken = RECORDS.min(count);
        count -= taken;
        let buffer = &mut buffer[..RECORD * taken];
        records.read_exact(buffer).map_err(failed)?;
        for record in buffer.chunks_exact(RECORD) {
            // The facet normal in the first 12 bytes is redundant, and often wrong.
            let coordinate =
                |at: usize| f64::from(f32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]]));
            let corner = |k: usize| DVec3::new(coordinate(12 * k), coordinate(12 * k + 4), coordinate(12 * k + 8));
            assembler.triangle([corner(1), corner(2), corner(3)])?;
        }
    }
    assembler.finish(Vec::new())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: [[[f32; 3]; 3]; 4] = {
        let (o, x, y, z) = ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
        [[o, y, x], [o, x, z], [o, z, y], [x, y, z]]
    };

    fn tetrahedron(header: &[u8]) -> Vec<u8> {
        let mut bytes = header.to_vec();
        bytes.resize(80, b' ');
        bytes.extend(4u32.to_le_bytes());
        for triangle in TETRAHEDRON {
            bytes.extend([0; 12]);
            triangle.iter().flatten().for_each(|c| bytes.extend(c.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }

    fn tetrahedron_text(name: &str) -> String {
        let mut text = format!("solid{name}\n");
        for triangle in TETRAHEDRON {
            text += " facet normal 0 0 0\n  outer loop\n";
            triangle.iter().for_each(|[x, y, z]| text += &format!("   vertex {x} {y} {z}\n"));
            text += "  endloop\n endfacet\n";
        }
        text + "endsolid\n"
    }

    #[test]
    fn binary_and_text_give_the_same_solid() {
        let mesh = parse(&tetrahedron(b"unit mm")).unwrap();
        assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (4, 4));
        assert!((mesh.volume_mm3() - 1.0 / 6.0).abs() < 1e-15);
        for other in [tetrahedron(b"solid of a liar"), tetrahedron_text("").into(), tetrahedron_text(" tet").into()] {
            assert_eq!(parse(&other).unwrap(), mesh);
        }
    }

    #[test]
    fn broken_files_are_named_and_never_trusted() {
        let good = tetrahedron(b"");
        assert!(matches!(parse(&good[..150]), Err(LoadError::Truncated { promised: 4, held: 1 })));
        let mut hostile = good.clone();
        hostile[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(matches!(parse(&hostile), Err(LoadError::Truncated { promised: 4_294_967_295, held: 4 })));
        let mut infinite = good.clone();
        infinite[84 + 50 + 12..84 + 50 + 16].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(matches!(parse(&infinite), Err(LoadError::NotFinite { triangle: 1, vertex: 0 })));
        assert!(matches!(parse(b""), Err(LoadError::Malformed { .. })));
        assert!(matches!(parse(b"solid x\nfacet normal 0 0"), Err(LoadError::Malformed { .. })));
        assert!(matches!(parse(b"solid x\nendsolid x\n"), Err(LoadError::Empty)));
        let mut miscounted = good.clone();
        miscounted[80] = 3;
        let reason = parse(&miscounted).unwrap_err().to_string();
        assert!(reason.contains("promises 3 triangles, and it holds 4"), "{reason}");
        for tail in [1, 49, 51] {
            let longer = [good.clone(), vec![7; tail]].concat();
            assert_eq!(parse(&longer).unwrap(), parse(&good).unwrap(), "{tail} bytes behind the end");
        }
        let mut none = good;
        none.truncate(84);
        none[80..].fill(0);
        assert!(matches!(parse(&none), Err(LoadError::Empty)));
    }
}
