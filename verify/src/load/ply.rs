//! Polygon File Format (Stanford), text and binary.

use super::{Assembler, LoadError, Points};
use crate::mesh::Mesh;
use glam::DVec3;

/// Parses the elements `vertex` and `face` of a PLY file; polygons are cut into fans, all other elements are passed over.
pub(super) fn parse(bytes: &[u8]) -> Result<Mesh, LoadError> {
    let (header, body) = split(bytes)?;
    let (encoding, elements) = declared(header)?;
    let mut values = Values { encoding, rest: body };
    let (mut positions, mut directions) = (Vec::new(), Vec::new());
    let mut polygons: Vec<Vec<f64>> = Vec::new();
    for element in &elements {
        for _ in 0..element.count {
            let (mut position, mut direction) = ([None; 3], [None; 3]);
            for property in &element.properties {
                let list = values.read(property)?;
                match (element.name.as_str(), property.name.as_str()) {
                    ("vertex", name) => {
                        for (k, (place, normal)) in [("x", "nx"), ("y", "ny"), ("z", "nz")].into_iter().enumerate() {
                            if name == place {
                                position[k] = list.first().copied();
                            } else if name == normal {
                                direction[k] = list.first().copied();
                            }
                        }
                    }
                    ("face", "vertex_indices" | "vertex_index") => polygons.push(list),
                    _ => {}
                }
            }
            if element.name == "vertex" {
                let [Some(x), Some(y), Some(z)] = position else {
                    return Err(malformed("its vertices have no x, y and z".into()));
                };
                positions.push(DVec3::new(x, y, z));
                if let [Some(x), Some(y), Some(z)] = direction {
                    directions.push(DVec3::new(x, y, z));
                }
            }
        }
    }
    let mut assembler = Assembler::new(polygons.len());
    let has_normals = directions.len() == positions.len();
    let count = positions.len();
    let mut points = Points::new(positions);
    let nothing = |found: f64| malformed(format!("index {found} points at none of {count} vertices"));
    for polygon in &polygons {
        let index = |k: usize| if polygon[k] >= 0.0 { Ok(polygon[k] as usize) } else { Err(nothing(polygon[k])) };
        for k in 2..polygon.len() {
            let corners = [index(0)?, index(k - 1)?, index(k)?];
            assembler.numbered(&mut points, corners, |k| nothing(k as f64))?;
            if has_normals {
                assembler.normal_corners.push(corners.map(|v| v as u32));
            }
        }
    }
    assembler.finish(if has_normals { directions } else { Vec::new() })
}

fn malformed(reason: String) -> LoadError {
    LoadError::Malformed { format: "PLY", reason }
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
fn split(bytes: &[u8]) -> Result<(&str, &[u8]), LoadError> {
    const END: &[u8] = b"end_header";
    let at = bytes.windows(END.len()).position(|w| w == END).filter(|_| bytes.starts_with(b"ply"));
    let at = at.ok_or_else(|| malformed("it has no header from 'ply' to 'end_header'".into()))?;
    let line = bytes[at..].iter().position(|&b| b == b'\n').map_or(bytes.len(), |end| at + end + 1);
    let header = std::str::from_utf8(&bytes[..at]).map_err(|error| malformed(format!("its header: {error}")))?;
    Ok((header, &bytes[line..]))
}

fn declared(header: &str) -> Result<(Encoding, Vec<Element>), LoadError> {
    let (mut encoding, mut elements) = (None, Vec::<Element>::new());
    for line in header.lines().skip(1) {
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
    /// A scalar, or the items of a list. Every item takes bytes of the file, so that no count has to be believed.
    fn read(&mut self, property: &Property) -> Result<Vec<f64>, LoadError> {
        let count = match property.length {
            None => 1.0,
            Some(length) => self.scalar(length)?,
        };
        let mut items = Vec::new();
        while (items.len() as f64) < count {
            items.push(self.scalar(property.item)?);
        }
        Ok(items)
    }

    fn scalar(&mut self, scalar: Scalar) -> Result<f64, LoadError> {
        let ended = || malformed("the file ends before its last element".into());
        if self.encoding == Encoding::Text {
            self.rest = self.rest.trim_ascii_start();
            let end = self.rest.iter().position(u8::is_ascii_whitespace).unwrap_or(self.rest.len());
            let (word, rest) = self.rest.split_at(end);
            self.rest = rest;
            let word = String::from_utf8_lossy(word);
            return if word.is_empty() {
                Err(ended())
            } else {
                word.parse().map_err(|_| malformed(format!("'{word}' is no number")))
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
