//! OFF (Object File Format of Geomview), as text.

use super::{
    assemble::{Allowance, Assembler, Normals, Points},
    error::LoadError,
    polygon,
};
use crate::mesh::Mesh;
use glam::DVec3;

fn malformed(reason: impl Into<String>) -> LoadError {
    LoadError::malformed("OFF", reason)
}

/// Parses a file with or without normals, colours and texture coordinates, of which the normals are
/// read.
pub(super) fn parse(bytes: &[u8], normals: Normals) -> Result<Mesh, LoadError> {
    let text = String::from_utf8_lossy(bytes);
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let mut lines = text
        .split(['\n', '\r'])
        .map(|line| line.split('#').next().unwrap_or_default().trim())
        .filter(|line| !line.is_empty());
    let first = lines.next().ok_or_else(|| malformed("it is empty"))?;
    let (kind, after) = first.split_once(|c: char| c.is_ascii_whitespace()).unwrap_or((first, ""));
    let (features, counts) = match kind.strip_suffix("OFF") {
        Some(features) => (features, after.trim()),
        // Some programs leave the keyword out.
        None if kind.parse::<u32>().is_ok() => ("", first),
        None => return Err(malformed("it does not begin with OFF")),
    };
    let has_normals = match features {
        "" | "C" | "ST" | "STC" => false,
        "N" | "CN" | "STN" | "STCN" => true,
        _ => return Err(malformed(format!("{kind} holds points of other dimensions than three"))),
    };
    if counts.starts_with("BINARY") {
        return Err(malformed("it is binary, which is not understood: save it as text"));
    }
    let counts = if counts.is_empty() { lines.next().unwrap_or_default() } else { counts };
    let mut counts = counts.split_ascii_whitespace().map(|word| word.parse::<usize>().ok());
    let (Some(Some(vertices)), Some(Some(faces))) = (counts.next(), counts.next()) else {
        return Err(malformed("it does not say how many vertices and faces it has"));
    };
    let (mut positions, mut directions) = (Vec::new(), Vec::new());
    for k in 0..vertices {
        let line = lines.next().ok_or_else(|| malformed(format!("it ends after {k} of {vertices} vertices")))?;
        let mut numbers = line.split_ascii_whitespace().map(|word| word.parse::<f64>().ok());
        let mut vector = || -> Result<DVec3, LoadError> {
            let mut next = || numbers.next().flatten();
            let (Some(x), Some(y), Some(z)) = (next(), next(), next()) else {
                return Err(malformed(format!("vertex {k} has not its numbers: '{}'", shortened(line))));
            };
            Ok(DVec3::new(x, y, z))
        };
        positions.push(vector()?);
        if has_normals && normals == Normals::Read {
            directions.push(vector()?);
        }
    }
    let mut allowance = Allowance::of(bytes);
    let mut assembler = Assembler::new(faces.min(bytes.len() / 8));
    let mut points = Points::new(positions);
    let nothing = |v: usize| malformed(format!("index {v} points at none of {vertices} vertices"));
    let mut corners = Vec::new();
    for k in 0..faces {
        let line = lines.next().ok_or_else(|| malformed(format!("it ends after {k} of {faces} faces")))?;
        // Colours may follow.
        let mut numbers = line.split_ascii_whitespace().map(|word| word.parse::<usize>().ok());
        let count = numbers.next().flatten();
        corners.clear();
        corners.extend(numbers.by_ref().take(count.unwrap_or(0)).map_while(|index| index));
        if count != Some(corners.len()) {
            return Err(malformed(format!("face {k} has not its indices: '{}'", shortened(line))));
        }
        allowance.take(corners.len(), "OFF")?;
        let of_normals = (!directions.is_empty()).then_some(&corners[..]);
        polygon::add(&mut assembler, &mut points, &corners, of_normals, nothing)?;
    }
    assembler.finish(directions)
}

fn shortened(line: &str) -> String {
    line.chars().take(60).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: &str = "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

    fn read(text: &str) -> Result<Mesh, LoadError> {
        parse(text.as_bytes(), Normals::Read)
    }

    #[test]
    fn every_kind_of_file_is_the_same_solid() {
        let mesh = read(TETRAHEDRON).unwrap();
        assert!((mesh.volume_mm3() - 1.0 / 6.0).abs() < 1e-15 && mesh.normals.is_none());
        let coloured = TETRAHEDRON.replace("OFF", "COFF").replace("0 0 0\n", "0 0 0 255 0 0 255\n");
        for text in [
            TETRAHEDRON.replace("OFF\n4", "OFF 4"),
            TETRAHEDRON.replace("OFF\n", ""),
            TETRAHEDRON.replace('\n', "\r\n"),
            format!("\u{feff}{TETRAHEDRON}"),
            TETRAHEDRON.replace("OFF\n", "OFF # a tetrahedron\n# by hand\n\n"),
            TETRAHEDRON.replace("3 1 2 3", "3 1 2 3 0.5 0.5 0.5 # grey"),
            coloured,
        ] {
            assert_eq!(read(&text).unwrap(), mesh, "{text}");
        }
        let normals = "NOFF\n4 1 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n1 1 0 0 1 0\n0 1 0 0 0 1\n4 0 1 2 3\n";
        let mesh = read(normals).unwrap();
        let normals = mesh.normals.unwrap();
        assert_eq!((mesh.triangles.len(), normals.directions[normals.corners[0][2] as usize]), (2, DVec3::Y));
    }

    #[test]
    fn broken_files_are_named() {
        for (from, to, words) in [
            ("OFF", "OFF BINARY", "binary"),
            ("OFF", "4OFF", "other dimensions"),
            ("OFF", "FFO", "does not begin"),
            ("4 4 6", "four", "how many"),
            ("4 4 6", "18446744073709551615 4 6", "vertices"),
            ("4 4 6", "4 18446744073709551615 6", "ends after 4 of"),
            ("0 1 0\n", "0 one 0\n", "vertex 2"),
            ("3 0 2 1", "3 0 2", "face 0"),
            ("3 0 2 1", "3 0 2 9", "index 9"),
            ("3 0 2 1", "3 0 2 -1", "face 0"),
        ] {
            let reason = read(&TETRAHEDRON.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(reason.contains("OFF") && reason.contains(words), "{to}: {reason}");
        }
        assert!(matches!(read(&TETRAHEDRON.replace("0 1 0\n", "0 nan 0\n")), Err(LoadError::NotFinite { .. })));
        assert!(matches!(read("OFF\n0 0 0\n"), Err(LoadError::Empty)));
    }
}
