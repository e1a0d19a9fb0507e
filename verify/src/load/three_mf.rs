//! 3MF: a mesh in XML within a ZIP archive, with its unit.

use super::{Assembler, LoadError, Points};
use crate::mesh::Mesh;
use glam::DVec3;
use quick_xml::{
    Reader,
    events::{BytesStart, Event},
};
use std::io::{BufRead, BufReader, Cursor, Read};

fn malformed(reason: impl Into<String>) -> LoadError {
    LoadError::Malformed { format: "3MF", reason: reason.into() }
}

/// The model may be this many times as large as its archive: what deflate makes of such text is about a tenth.
const MOST_EXPANSION: u64 = 200;

/// Parses the mesh of the only object.
pub(super) fn parse(bytes: &[u8]) -> Result<Mesh, LoadError> {
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|error| malformed(error.to_string()))?;
    let name = model_name(&mut archive)?;
    let file = archive.by_name(&name).map_err(|error| malformed(format!("{name}: {error}")))?;
    let most = MOST_EXPANSION * bytes.len() as u64;
    if file.size() > most {
        return Err(malformed("it unpacks to more than 200 times its size"));
    }
    let mut model = Model::default();
    each_element(BufReader::with_capacity(1 << 16, file.take(most)), |element| model.take(element))?;
    model.finish()
}

/// The part that the package calls its model.
fn model_name(archive: &mut zip::ZipArchive<Cursor<&[u8]>>) -> Result<String, LoadError> {
    let relations = archive.by_name("_rels/.rels").map_err(|error| malformed(format!("_rels/.rels: {error}")))?;
    let mut name = None;
    each_element(BufReader::new(relations.take(1 << 20)), |element| {
        if element.local_name().as_ref() == "Relationship"
            && attribute(element, "Type")?.is_some_and(|kind| kind.ends_with("/3dmodel"))
        {
            name = attribute(element, "Target")?;
        }
        Ok(())
    })?;
    let name = name.ok_or_else(|| malformed("its relationships name no model"))?;
    Ok(name.trim_start_matches('/').to_owned())
}

fn each_element(
    source: impl BufRead,
    mut take: impl FnMut(&BytesStart<'_>) -> Result<(), LoadError>,
) -> Result<(), LoadError> {
    let mut reader = Reader::from_reader(source);
    let mut buffer = Vec::new();
    let mut depth = 0_i64;
    loop {
        buffer.clear();
        match reader.read_event_into(&mut buffer).map_err(|error| malformed(error.to_string()))? {
            Event::Start(element) => {
                depth += 1;
                take(&element)?;
            }
            Event::Empty(element) => take(&element)?,
            Event::End(_) => depth -= 1,
            Event::Eof if depth == 0 => return Ok(()),
            Event::Eof => return Err(malformed("its XML ends too early")),
            _ => {}
        }
    }
}

fn attribute(element: &BytesStart<'_>, name: &str) -> Result<Option<String>, LoadError> {
    let found = element.try_get_attribute(name).map_err(|error| malformed(error.to_string()))?;
    Ok(found.map(|attribute| attribute.value.into_owned()))
}

#[derive(Default)]
struct Model {
    scale: Option<f64>,
    objects: usize,
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

impl Model {
    fn take(&mut self, element: &BytesStart<'_>) -> Result<(), LoadError> {
        match element.local_name().as_ref() {
            "model" => {
                let unit = attribute(element, "unit")?;
                self.scale = Some(match unit.as_deref() {
                    None | Some("millimeter") => 1.0,
                    Some("micron") => 1e-3,
                    Some("centimeter") => 10.0,
                    Some("inch") => 25.4,
                    Some("foot") => 304.8,
                    Some("meter") => 1000.0,
                    Some(other) => return Err(malformed(format!("'{other}' is no unit of 3MF"))),
                });
            }
            "object" => self.objects += 1,
            "component" => return Err(malformed("it is put together from components, which are not understood")),
            "item" if attribute(element, "transform")?.is_some() => {
                return Err(malformed("its object is moved by a transform, which is not understood"));
            }
            "vertex" => {
                let [x, y, z] = values(element, ["x", "y", "z"])?;
                self.positions.push(DVec3::new(x, y, z));
            }
            "triangle" => self.triangles.push(values(element, ["v1", "v2", "v3"])?),
            _ => {}
        }
        Ok(())
    }

    fn finish(self) -> Result<Mesh, LoadError> {
        let scale = self.scale.ok_or_else(|| malformed("it holds no model"))?;
        if self.objects > 1 {
            return Err(malformed(format!("it holds {} objects instead of one", self.objects)));
        }
        let mut assembler = Assembler::new(self.triangles.len());
        let count = self.positions.len();
        let mut points = Points::new(self.positions.into_iter().map(|at| scale * at).collect());
        let nothing = |v| malformed(format!("index {v} points at none of {count} vertices"));
        for triangle in &self.triangles {
            assembler.numbered(&mut points, triangle.map(|v| v as usize), nothing)?;
        }
        assembler.finish(Vec::new())
    }
}

/// Three attributes of an element.
fn values<T: std::str::FromStr>(element: &BytesStart<'_>, names: [&str; 3]) -> Result<[T; 3], LoadError> {
    let mut found = [None, None, None];
    for attribute in element.attributes() {
        let attribute = attribute.map_err(|error| malformed(error.to_string()))?;
        if let Some(k) = names.iter().position(|name| *name == attribute.key.as_ref()) {
            found[k] = attribute.value.trim().parse().ok();
        }
    }
    match found {
        [Some(a), Some(b), Some(c)] => Ok([a, b, c]),
        _ => Err(malformed(format!("an element '{}' has not its three numbers", element.name().as_ref()))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    const VERTICES: &str = "<vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"1\" y=\"0\" z=\"0\"/><vertex x=\"0\" y=\"1\" z=\"0\"/><vertex x=\"0\" y=\"0\" z=\"1\"/>";
    const TRIANGLES: &str = "<triangle v1=\"0\" v2=\"2\" v3=\"1\"/><triangle v1=\"0\" v2=\"1\" v3=\"3\"/><triangle v1=\"0\" v2=\"3\" v3=\"2\"/><triangle v1=\"1\" v2=\"2\" v3=\"3\"/>";

    fn model() -> String {
        format!(
            "<?xml version=\"1.0\"?><model unit=\"millimeter\"><resources><object id=\"1\"><mesh><vertices>{VERTICES}</vertices>\
             <triangles>{TRIANGLES}</triangles></mesh></object></resources><build><item objectid=\"1\"/></build></model>"
        )
    }

    fn package(model: &str) -> Vec<u8> {
        let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
        let options = zip::write::SimpleFileOptions::default();
        let relations = "<Relationships><Relationship Target=\"/3D/m.model\" Type=\"x/3dmodel\"/></Relationships>";
        for (name, text) in [("_rels/.rels", relations), ("3D/m.model", model)] {
            zip.start_file(name, options).unwrap();
            zip.write_all(text.as_bytes()).unwrap();
        }
        zip.finish().unwrap().into_inner()
    }

    #[test]
    fn a_tetrahedron_has_its_volume_in_its_unit() {
        for (unit, mm) in [("millimeter", 1.0_f64), ("inch", 25.4), ("micron", 1e-3)] {
            let mesh = parse(&package(&model().replace("millimeter", unit))).unwrap();
            assert!((mesh.volume_mm3() - mm.powi(3) / 6.0).abs() < 1e-12 * mm.powi(3));
        }
    }

    #[test]
    fn broken_packages_are_named() {
        let damaged = |from: &str, to: &str| parse(&package(&model().replacen(from, to, 1)));
        let whole = package(&model());
        for error in [
            parse(b"PK"),
            parse(&whole[..whole.len() - 30]),
            damaged("</model>", ""),
            damaged("millimeter", "furlong"),
            damaged("v3=\"1\"", "v3=\"9\""),
            damaged("v3=\"1\"", "v3=\"-1\""),
            damaged("x=\"1\"", "x=\"one\""),
            damaged("<resources>", "<resources><object id=\"2\"/>"),
            damaged("objectid=\"1\"/>", "objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 5 0 0\"/>"),
        ] {
            assert!(matches!(error, Err(LoadError::Malformed { format: "3MF", .. })), "{error:?}");
        }
        assert!(matches!(damaged("x=\"1\"", "x=\"nan\""), Err(LoadError::NotFinite { .. })));
    }
}
