//! 3MF: objects, and what is put together from them, in XML within a ZIP archive, with their unit.

mod fault;
mod part;

use super::{
    assemble::{Allowance, Assembler, Points},
    error::LoadError,
};
use crate::mesh::Mesh;
use fault::malformed;
use glam::DAffine3;
use part::{ModelPart, attribute, each_element};
use std::{
    collections::HashMap,
    io::{BufReader, Cursor, Read},
};

/// The models may be this many times as large as their archive: what deflate makes of such text is
/// about a tenth.
const MOST_EXPANSION: u64 = 200;
/// Deepest nesting of components.
const DEEPEST: usize = 64;

/// Parses all that the file builds; of one that builds nothing, all objects that are no part of
/// others.
pub(super) fn parse(bytes: &[u8]) -> Result<Mesh, LoadError> {
    let mut package = Package::open(bytes)?;
    let root = package.model_name()?;
    // Objects may be used any number of times.
    let mut allowance = Allowance::bytes(package.read(&root)?);
    let part = &package.parts[&root];
    let placed = |item: &part::Use| (item.path_or(&root), item.object, item.placed(part.unit_mm), 0);
    let mut waiting: Vec<(String, u64, DAffine3, usize)> = part.built().iter().rev().map(placed).collect();
    let mut assembler = Assembler::new(0);
    while let Some((path, number, placed, depth)) = waiting.pop() {
        if depth > DEEPEST {
            return Err(malformed(format!("its components are nested more than {DEEPEST} deep")));
        }
        allowance.grow(package.read(&path)?);
        let part = &package.parts[&path];
        let object = part.objects.get(&number);
        let object = object.ok_or_else(|| malformed(format!("there is no object {number} in {path}")))?;
        if object.is_support {
            continue;
        }
        let count = object.positions.len();
        allowance.take(1 + count + object.triangles.len(), "3MF")?;
        let positions = object.positions.iter().map(|&at| placed.transform_point3(part.unit_mm * at)).collect();
        let mut points = Points::new(positions);
        // A mirroring transformation turns triangles inside out.
        let mirrored = placed.matrix3.determinant() < 0.0;
        for &[a, b, c] in &object.triangles {
            let corners = if mirrored { [a, c, b] } else { [a, b, c] };
            let nothing = |v| malformed(format!("index {v} points at none of {count} vertices"));
            assembler.numbered(&mut points, corners.map(|v| v as usize), nothing)?;
        }
        let within =
            |used: &part::Use| (used.path_or(&path), used.object, placed * used.placed(part.unit_mm), depth + 1);
        waiting.extend(object.components.iter().rev().map(within));
    }
    assembler.finish(Vec::new())
}

/// The archive, and the parts of it that have been read.
struct Package<'a> {
    archive: zip::ZipArchive<Cursor<&'a [u8]>>,
    parts: HashMap<String, ModelPart>,
    /// Bytes that may still be unpacked.
    left: u64,
}

impl<'a> Package<'a> {
    fn open(bytes: &'a [u8]) -> Result<Self, LoadError> {
        let archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|error| malformed(error.to_string()))?;
        Ok(Self { archive, parts: HashMap::new(), left: MOST_EXPANSION * bytes.len() as u64 })
    }

    /// The part that the package calls its model.
    fn model_name(&mut self) -> Result<String, LoadError> {
        let relations =
            self.archive.by_name("_rels/.rels").map_err(|error| malformed(format!("_rels/.rels: {error}")))?;
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

    /// Reads a part, unless it is known; returns how many bytes it has taken.
    fn read(&mut self, name: &str) -> Result<usize, LoadError> {
        if self.parts.contains_key(name) {
            return Ok(0);
        }
        let file = self.archive.by_name(name).map_err(|error| malformed(format!("{name}: {error}")))?;
        if file.size() > self.left {
            return Err(malformed(format!("it unpacks to more than {MOST_EXPANSION} times its size")));
        }
        let length = file.size();
        let mut part = ModelPart::default();
        each_element(BufReader::with_capacity(1 << 16, file.take(length)), |element| part.take(element))?;
        if part.unit_mm == 0.0 {
            return Err(malformed(format!("{name} holds no model")));
        }
        self.left -= length;
        self.parts.insert(name.to_owned(), part);
        Ok(length as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
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
            damaged("objectid=\"1\"", "objectid=\"2\""),
            damaged("objectid=\"1\"", "objectid=\"1\" path=\"/3D/other.model\""),
            damaged("objectid=\"1\"/>", "objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 5 0\"/>"),
            damaged("</mesh>", "</mesh><components><component objectid=\"1\"/></components>"),
        ] {
            assert!(matches!(error, Err(LoadError::Malformed { format: "3MF", .. })), "{error:?}");
        }
        assert!(matches!(damaged("x=\"1\"", "x=\"nan\""), Err(LoadError::NotFinite { .. })));
    }

    /// The model with its build in other words, in a package with one more part.
    fn built(objects: &str, items: &str, other: &str) -> Mesh {
        let model =
            model().replace("</resources>", &format!("{objects}</resources>")).replace("<item objectid=\"1\"/>", items);
        let mut zip = zip::ZipWriter::new_append(Cursor::new(package(&model))).unwrap();
        zip.start_file("3D/Objects/other.model", zip::write::SimpleFileOptions::default()).unwrap();
        zip.write_all(other.as_bytes()).unwrap();
        parse(&zip.finish().unwrap().into_inner()).unwrap()
    }

    #[test]
    fn components_and_items_are_placed_by_their_transforms() {
        let component = |of: &str| format!("<object id=\"2\"><components><component {of}/></components></object>");
        let moved = "transform=\"1 0 0 0 1 0 0 0 1 125 105 13.5\"";
        let mesh = built(&component("objectid=\"1\""), &format!("<item objectid=\"2\" {moved}/>"), "");
        assert_eq!(mesh.bounds().0, DVec3::new(125.0, 105.0, 13.5));
        assert!((mesh.volume_mm3() - 1.0 / 6.0).abs() < 1e-12);
        // A quarter turn: x goes to y.
        let turned = "transform=\"0 1 0 -1 0 0 0 0 2 0 0 0\"";
        let mesh =
            built(&component(&format!("objectid=\"1\" {turned}")), &format!("<item objectid=\"2\" {moved}/>"), "");
        assert_eq!(mesh.bounds(), (DVec3::new(124.0, 105.0, 13.5), DVec3::new(125.0, 106.0, 15.5)));
        assert!((mesh.volume_mm3() - 1.0 / 3.0).abs() < 1e-12);
        let mirrored = built("", "<item objectid=\"1\" transform=\"-1 0 0 0 1 0 0 0 1 0 0 0\"/>", "");
        assert!((mirrored.volume_mm3() - 1.0 / 6.0).abs() < 1e-12 && mirrored.bounds().0.x == -1.0);
        let two = built("", &format!("<item objectid=\"1\"/><item objectid=\"1\" {moved}/>"), "");
        assert_eq!((two.vertices.len(), two.triangles.len()), (8, 8));
        let supported = built(
            "<object id=\"3\" type=\"support\"><mesh/></object>",
            "<item objectid=\"3\"/><item objectid=\"1\"/>",
            "",
        );
        assert_eq!(supported.triangles.len(), 4);
        assert_eq!(built(&component("objectid=\"1\""), "", "").triangles.len(), 4, "a build of nothing");
    }

    #[test]
    fn components_may_lie_in_other_parts_in_other_units() {
        let other = model().replace("millimeter", "centimeter");
        let objects = "<object id=\"2\"><components><component p:path=\"/3D/Objects/other.model\" objectid=\"1\" \
            transform=\"1 0 0 0 1 0 0 0 1 5 0 0\"/></components></object>";
        let mesh = built(objects, "<item objectid=\"2\"/>", &other);
        assert_eq!(mesh.bounds(), (DVec3::new(5.0, 0.0, 0.0), DVec3::new(15.0, 10.0, 10.0)));
    }

    #[test]
    fn objects_that_hold_each_other_are_refused() {
        let around = "<object id=\"1\"><components><component objectid=\"2\"/></components></object>\
            <object id=\"2\"><components><component objectid=\"1\"/></components></object>";
        let model = format!("<model><resources>{around}</resources><build><item objectid=\"1\"/></build></model>");
        let error = parse(&package(&model)).unwrap_err().to_string();
        assert!(error.contains("nested"), "{error}");
        // Each holds the one before ten times.
        let mut many = String::from("<object id=\"1\"><mesh/></object>");
        for id in 2..12 {
            let used = format!("<component objectid=\"{}\"/>", id - 1).repeat(10);
            many += &format!("<object id=\"{id}\"><components>{used}</components></object>");
        }
        let model = format!("<model><resources>{many}</resources><build><item objectid=\"11\"/></build></model>");
        let error = parse(&package(&model)).unwrap_err().to_string();
        assert!(error.contains("more points than it has bytes"), "{error}");
    }
}
