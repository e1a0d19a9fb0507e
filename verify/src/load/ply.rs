//! Polygon File Format (Stanford), text and binary.

use super::{
    assemble::{Assembler, Points},
    error::LoadError,
    polygon,
};
use crate::mesh::Mesh;
use glam::DVec3;
use std::borrow::Cow;

/// Parses the elements `vertex` and `face` of a PLY file; polygons are cut into fans, all other
/// elements are passed over.
pub(super) fn parse(bytes: &[u8]) -> Result<Mesh, LoadError> {
    let (header, body) = split(bytes)?;
    let (encoding, elements) = declared(&header)?;
    let mut values = Values { encoding, rest: body };
    let (mut positions, mut directions) = (Vec::new(), Vec::new());
    // Corners of the polygons one after the other, and where each ends.
    let (mut corners, mut ends) = (Vec::<f64>::new(), Vec::new());
    let (mut strips, mut passed_over) = (Vec::<f64>::new(), Vec::new());
    for element in &elements {
        let roles: Vec<Role> = element.properties.iter().map(|property| Role::of(element, property)).collect();
        for _ in 0..element.count {
            let (mut position, mut direction) = ([f64::NAN; 3], [f64::NAN; 3]);
            for (property, role) in element.properties.iter().zip(&roles) {
                match role {
                    Role::Place(axis) => position[*axis] = values.scalar(property.item)?,
                    Role::Normal(axis) => direction[*axis] = values.scalar(property.item)?,
                    Role::Corners => {
                        values.list(property, &mut corners)?;
                        ends.push(corners.len());
                    }
                    Role::Strips => {
                        values.list(property, &mut strips)?;
                        strips.push(-1.0);
                    }
                    Role::None => {
                        passed_over.clear();
                        values.list(property, &mut passed_over)?;
                    }
                }
            }
            if element.name == "vertex" {
                positions.push(DVec3::from(position));
                directions.push(DVec3::from(direction));
            }
        }
        let has = |role: Role| roles.contains(&role);
        if element.name == "vertex" && !(0..3).all(|axis| has(Role::Place(axis))) {
            return Err(malformed("its vertices have no x, y and z".into()));
        }
        if element.name == "vertex" && !(0..3).all(|axis| has(Role::Normal(axis))) {
            directions.clear();
        }
    }
    let mut assembler = Assembler::new(ends.len());
    let has_normals = !directions.is_empty() && directions.len() == positions.len();
    let count = positions.len();
    let mut points = Points::new(positions);
    let nothing = |found: f64| malformed(format!("index {found} points at none of {count} vertices"));
    let index =
        |value: f64| if value >= 0.0 && value.fract() == 0.0 { Ok(value as usize) } else { Err(nothing(value)) };
    let mut add = |corners: &[usize]| {
        polygon::add(&mut assembler, &mut points, corners, has_normals.then_some(corners), |k| nothing(k as f64))
    };
    let (mut first, mut polygon) = (0, Vec::new());
    for end in ends {
        polygon.clear();
        for &corner in &corners[first..end] {
            polygon.push(index(corner)?);
        }
        add(&polygon)?;
        first = end;
    }
    // Strips of triangles, each turned the other way than the one before it; a negative number ends
    // one.
    for strip in strips.split(|&index| index < 0.0) {
        for (k, corners) in strip.windows(3).enumerate() {
            let [a, b, c] = [index(corners[0])?, index(corners[1])?, index(corners[2])?];
            if a != b && b != c && c != a {
                add(&if k % 2 == 0 { [a, b, c] } else { [b, a, c] })?;
            }
        }
    }
    assembler.finish(if has_normals { directions } else { Vec::new() })
}

/// What a property is read for.
#[derive(Clone, Copy, PartialEq)]
enum Role {
    Place(usize),
    Normal(usize),
    Corners,
    Strips,
    None,
}

impl Role {
    fn of(element: &Element, property: &Property) -> Self {
        let axis = |names: [&str; 3]| names.iter().position(|name| *name == property.name);
        match (element.name.as_str(), property.length.is_some()) {
            ("vertex", false) => {
                let place = axis(["x", "y", "z"]).map(Self::Place);
                place.or_else(|| axis(["nx", "ny", "nz"]).map(Self::Normal)).unwrap_or(Self::None)
            }
            ("face", true) if matches!(property.name.as_str(), "vertex_indices" | "vertex_index") => Self::Corners,
            ("tristrips", true) if matches!(property.name.as_str(), "vertex_indices" | "vertex_index") => Self::Strips,
            _ => Self::None,
        }
    }
}

fn malformed(reason: String) -> LoadError {
    LoadError::malformed("PLY", reason)
}

#[derive(Clone, Copy, PartialEq)]
enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

struct Property {
    name: String,
    /// Of a list, the kind of its length.
    length: Option<Scalar>,
    item: Scalar,
}

#[derive(Clone, Copy)]
enum Scalar {
    Signed(usize),
    Unsigned(usize),
    Float(usize),
}

impl Scalar {
    fn named(name: &str) -> Result<Self, LoadError> {
        Ok(match name {
            "char" | "int8" => Self::Signed(1),
            "short" | "int16" => Self::Signed(2),
            "int" | "int32" => Self::Signed(4),
            "uchar" | "uint8" => Self::Unsigned(1),
            "ushort" | "uint16" => Self::Unsigned(2),
            "uint" | "uint32" => Self::Unsigned(4),
            "float" | "float32" => Self::Float(4),
            "double" | "float64" => Self::Float(8),
            other => return Err(malformed(format!("a property has the unknown type '{other}'"))),
        })
    }
}

/// The text up to `end_header`, and what follows its line.
fn split(bytes: &[u8]) -> Result<(Cow<'_, str>, &[u8]), LoadError> {
    const END: &[u8] = b"end_header";
    let at = bytes.windows(END.len()).position(|w| w == END).filter(|_| bytes.starts_with(b"ply"));
    let at = at.ok_or_else(|| malformed("it has no header from 'ply' to 'end_header'".into()))?;
    // A body may begin with the byte that ends lines elsewhere.
    let line_end = if bytes[..at].contains(&b'\n') { b'\n' } else { b'\r' };
    let body = bytes[at..].iter().position(|&b| b == line_end).map_or(bytes.len(), |end| at + end + 1);
    Ok((String::from_utf8_lossy(&bytes[..at]), &bytes[body..]))
}

fn declared(header: &str) -> Result<(Encoding, Vec<Element>), LoadError> {
    let (mut encoding, mut elements) = (None, Vec::<Element>::new());
    for line in header.split(['\n', '\r']).skip(1) {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["format", name, "1.0"] => {
                encoding = Some(match name {
                    "ascii" => Encoding::Text,
                    "binary_little_endian" => Encoding::LittleEndian,
                    "binary_big_endian" => Encoding::BigEndian,
                    _ => return Err(malformed(format!("its encoding '{name}' is unknown"))),
                });
            }
            ["element", name, count] => {
                let count = count.parse().map_err(|_| malformed(format!("'{count}' is no number of elements")))?;
                elements.push(Element { name: name.into(), count, properties: Vec::new() });
            }
            ["property", ref kind @ .., name] => {
                let (length, item) = match kind {
                    ["list", length, item] => (Some(Scalar::named(length)?), Scalar::named(item)?),
                    [item] => (None, Scalar::named(item)?),
                    _ => return Err(malformed(format!("the line '{line}' of its header is not understood"))),
                };
                let element =
                    elements.last_mut().ok_or_else(|| malformed("a property stands before any element".into()))?;
                element.properties.push(Property { name: name.into(), length, item });
            }
            ["comment" | "obj_info", ..] | [] => {}
            _ => return Err(malformed(format!("the line '{line}' of its header is not understood"))),
        }
    }
    // Such an element takes no bytes, and its count could be anything.
    if let Some(empty) = elements.iter().find(|e| e.properties.is_empty()) {
        return Err(malformed(format!("its element '{}' has no properties", empty.name)));
    }
    Ok((encoding.ok_or_else(|| malformed("its header names no format".into()))?, elements))
}

struct Values<'a> {
    encoding: Encoding,
    rest: &'a [u8],
}

impl Values<'_> {
    /// Reads a scalar, or the items of a list. Every item takes bytes of the file, so that no count
    /// has to be believed.
    fn list(&mut self, property: &Property, items: &mut Vec<f64>) -> Result<(), LoadError> {
        let mut count = match property.length {
            None => 1.0,
            Some(length) => self.scalar(length)?,
        };
        while count > 0.0 {
            items.push(self.scalar(property.item)?);
            count -= 1.0;
        }
        Ok(())
    }

    fn scalar(&mut self, scalar: Scalar) -> Result<f64, LoadError> {
        let ended = || malformed("the file ends before its last element".into());
        if self.encoding == Encoding::Text {
            self.rest = self.rest.trim_ascii_start();
            let end = self.rest.iter().position(u8::is_ascii_whitespace).unwrap_or(self.rest.len());
            let (word, rest) = self.rest.split_at(end);
            self.rest = rest;
            return if word.is_empty() {
                Err(ended())
            } else {
                fast_float2::parse(word)
                    .map_err(|_| malformed(format!("'{}' is no number", String::from_utf8_lossy(word))))
            };
        }
        let (Scalar::Signed(size) | Scalar::Unsigned(size) | Scalar::Float(size)) = scalar;
        let (taken, rest) = self.rest.split_at_checked(size).ok_or_else(ended)?;
        self.rest = rest;
        let mut bytes = [0; 8];
        bytes[..size].copy_from_slice(taken);
        if self.encoding == Encoding::BigEndian {
            bytes[..size].reverse();
        }
        let bits = u64::from_le_bytes(bytes);
        let unused = 64 - 8 * size as u32;
        Ok(match scalar {
            Scalar::Unsigned(_) => bits as f64,
            Scalar::Signed(_) => (((bits << unused) as i64) >> unused) as f64,
            Scalar::Float(4) => f32::from_bits(bits as u32).into(),
            Scalar::Float(_) => f64::from_bits(bits),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "comment unit mm\nelement vertex 4\nproperty float x\nproperty float y\nproperty double z\n\
        property uchar red\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n";
    const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    const FACES: [[i32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

    fn text() -> String {
        let mut text = format!("ply\nformat ascii 1.0\n{HEADER}");
        CORNERS.iter().for_each(|[x, y, z]| text += &format!("{x} {y} {z} 200\n"));
        FACES.iter().for_each(|[a, b, c]| text += &format!("3 {a} {b} {c}\n"));
        text
    }

    fn binary(big: bool) -> Vec<u8> {
        let end = |mut little: Vec<u8>| {
            if big {
                little.reverse();
            }
            little
        };
        let name = if big { "big" } else { "little" };
        let mut bytes = format!("ply\nformat binary_{name}_endian 1.0\n{HEADER}").into_bytes();
        for [x, y, z] in CORNERS {
            bytes.extend(end(x.to_le_bytes().to_vec()));
            bytes.extend(end(y.to_le_bytes().to_vec()));
            bytes.extend(end(f64::from(z).to_le_bytes().to_vec()));
            bytes.push(200);
        }
        for face in FACES {
            bytes.push(3);
            face.iter().for_each(|v| bytes.extend(end(v.to_le_bytes().to_vec())));
        }
        bytes
    }

    #[test]
    fn text_and_both_byte_orders_give_the_same_solid() {
        let mesh = parse(text().as_bytes()).unwrap();
        assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (4, 4));
        assert!((mesh.volume_mm3() - 1.0 / 6.0).abs() < 1e-15 && mesh.normals.is_none());
        assert_eq!(parse(&binary(false)).unwrap(), mesh);
        assert_eq!(parse(&binary(true)).unwrap(), mesh);
    }

    #[test]
    fn every_dialect_is_the_same_solid() {
        let mesh = parse(text().as_bytes()).unwrap();
        let list = "element face 4\nproperty list uchar int vertex_indices";
        let counted = |kind: &str| format!("element face 4\nproperty list {kind} vertex_index");
        for (from, to) in [
            ("\n", "\r\n"),
            ("\n", "\r"),
            ("comment unit mm", "comment by M\u{fc}ller\nobj_info scanned"),
            ("float", "float32"),
            ("float", "double"),
            (list, &counted("uint int")),
            (list, &counted("float float")),
            (list, &counted("uint8 int32")),
        ] {
            assert!(text().contains(from), "{from}");
            assert_eq!(parse(text().replace(from, to).as_bytes()).unwrap(), mesh, "{to}");
        }
        // An element of no use, with a list, between the others; more in a face; and what lies in a
        // file behind all.
        let other = text()
            .replace("element face", "element camera 2\nproperty list char short views\nproperty int of\nelement face")
            .replace("3 0 2 1\n", "2 7 8 1\n0 1\n3 0 2 1\n");
        assert_eq!(parse((other + "left over").as_bytes()).unwrap(), mesh);
        let strips = text();
        let strips = &strips[..strips.find("3 0 2 1").unwrap()];
        let strips = strips.replace(list, "element tristrips 1\nproperty list int int vertex_indices");
        let strip = parse(format!("{strips}9 0 2 1 3 0 2 -1 0 1\n").as_bytes()).unwrap();
        assert_eq!((strip.triangles.len(), crate::solid::check(&strip).is_sound()), (4, true));
    }

    #[test]
    fn quads_and_normals_are_read() {
        let mesh = parse(
            b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
              property float nx\nproperty float ny\nproperty float nz\nelement face 1\n\
              property list uchar uint vertex_index\nend_header\n\
              0 0 0 0 0 1\n1 0 0 0 0 1\n1 1 0 0 1 0\n0 1 0 0 0 1\n4 0 1 2 3\n",
        )
        .unwrap();
        let normals = mesh.normals.unwrap();
        assert_eq!((mesh.triangles.len(), normals.directions[normals.corners[1][1] as usize]), (2, DVec3::Y));
    }

    #[test]
    fn broken_files_are_named_and_never_trusted() {
        let (text, binary) = (text(), binary(false));
        let damaged = |from: &str, to: &str| parse(text.replacen(from, to, 1).as_bytes());
        for error in [
            parse(b""),
            parse(b"ply\nformat ascii 1.0\n"),
            parse(&binary[..binary.len() - 1]),
            parse(&text.as_bytes()[..text.len() - 3]),
            damaged("element vertex 4", "element vertex 18446744073709551615"),
            damaged("element vertex 4", "element vertex -4"),
            damaged("property uchar red", "property colour red"),
            damaged("property float x", "property float u"),
            damaged("ascii", "rot13"),
            damaged("3 0 2 1", "3 0 2 9"),
            damaged("3 0 2 1", "3 0 2 -1"),
            damaged("3 0 2 1", "3 0 two 1"),
            damaged("element vertex 4", "element nothing 99999999999999\nelement vertex 4"),
        ] {
            assert!(matches!(error, Err(LoadError::Malformed { format: "PLY", .. })), "{error:?}");
        }
        assert!(matches!(damaged("1 0 0 200", "nan 0 0 200"), Err(LoadError::NotFinite { .. })));
        assert!(matches!(damaged("element face 4", "element face 0"), Err(LoadError::Empty)));
    }
}
