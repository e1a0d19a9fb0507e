//! 3MF as slicers write it, and STEP in several units.

use super::{Case, EXACT, Original, Outcome, case};
use glasswarp_verify::load::Format::{Step, ThreeMf};
use std::io::{Cursor, Write as _};

fn package(parts: &[(&str, &str)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default();
    let relations = "<?xml version=\"1.0\"?><Relationships><Relationship Id=\"r1\" Target=\"/3D/3dmodel.model\" \
        Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>";
    for (name, text) in [("_rels/.rels", relations)].iter().chain(parts) {
        zip.start_file(*name, options).unwrap();
        zip.write_all(text.as_bytes()).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// A model of this mesh, with numbers divided by the unit's millimetres.
fn model(original: &Original, (unit, mm): (&str, f64), resources: &str, items: &str) -> String {
    let mut vertices = String::new();
    for v in &original.mesh.vertices {
        let v = *v / mm;
        vertices += &format!("<vertex x=\"{:?}\" y=\"{:?}\" z=\"{:?}\"/>", v.x, v.y, v.z);
    }
    let mut triangles = String::new();
    for [a, b, c] in &original.mesh.triangles {
        triangles += &format!("<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>");
    }
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?><model unit=\"{unit}\" xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\" \
         xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\"><metadata name=\"Application\">test</metadata>\
         <resources><object id=\"1\" type=\"model\"><mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh>\
         </object>{resources}</resources><build>{items}</build></model>"
    )
}

const MILLIMETRES: (&str, f64) = ("millimeter", 1.0);
/// As slicers place things on their beds.
const BED: &str = "transform=\"1 0 0 0 1 0 0 0 1 125 105 13.2\"";

pub(super) fn cases(original: &Original) -> Vec<Case> {
    // `prusa-slicer --export-3mf` of the block as STL.
    let prusa_slicer = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus/prusa-slicer.3mf");
    let of = |model: &str| package(&[("3D/3dmodel.model", model)]);
    let component = "<object id=\"2\" type=\"model\"><components><component objectid=\"1\"/></components></object>";
    let turned = "<object id=\"2\"><components><component objectid=\"1\" transform=\"0 1 0 -1 0 0 0 0 1 3 0 0\"/></components></object>";
    let elsewhere = "<object id=\"8\" p:UUID=\"u\" type=\"model\"><components><component p:path=\"/3D/Objects/object_1.model\" \
        objectid=\"1\" p:UUID=\"v\" transform=\"1 0 0 0 1 0 0 0 1 0 0 0\"/></components></object>";
    let root = format!(
        "<model unit=\"millimeter\" requiredextensions=\"p\" xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\">\
         <resources>{elsewhere}</resources><build p:UUID=\"w\"><item objectid=\"8\" p:UUID=\"x\" {BED} printable=\"1\"/></build></model>"
    );
    let item = |text: &str| model(original, MILLIMETRES, "", text);
    let same = |kind: &str, from, bytes: Vec<u8>| case(kind, from, ThreeMf, bytes, Outcome::Block(EXACT));
    let righted = |kind: &str, from, bytes: Vec<u8>, what| case(kind, from, ThreeMf, bytes, Outcome::Righted(what));
    let refused = |kind: &str, from, bytes: Vec<u8>, words| case(kind, from, ThreeMf, bytes, Outcome::Refused(words));
    let unit = |unit: (&str, f64)| of(&model(original, unit, "", "<item objectid=\"1\"/>"));
    let support = "<object id=\"5\" type=\"support\"><mesh><vertices/><triangles/></mesh></object>";
    let step = String::from_utf8(original.exported("step")).unwrap();
    let statement = "SI_UNIT(.MILLI.,.METRE.)";
    assert!(step.contains(statement) && step.contains("DATA;"));
    let step_of = |kind: &str, from, text: String| case(kind, from, Step, text, Outcome::Block(2e-5));
    // An inch, by another number than any in the file, in the place of the millimetre; and points
    // in inches would be needed: the block of a file in metres is a thousand times as large.
    let other = |lines: &str| step.replacen("DATA;", &format!("DATA;{lines}"), 1);
    let metres = "#900001=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.));";
    vec![
        same("as we write it", "glasswarp", original.exported("3mf")),
        same("one object", "nearly all programs", unit(MILLIMETRES)),
        righted(
            "saved by PrusaSlicer 2.5",
            "PrusaSlicer",
            std::fs::read(prusa_slicer).unwrap_or_default(),
            "moved back",
        ),
        righted(
            "components, and an item with a transform",
            "slicers",
            of(&model(original, MILLIMETRES, component, &format!("<item objectid=\"2\" {BED}/>"))),
            "moved back",
        ),
        righted(
            "a component turned by a quarter",
            "slicers",
            of(&model(original, MILLIMETRES, turned, "<item objectid=\"2\"/>")),
            "turned back",
        ),
        righted(
            "objects in parts of their own",
            "Bambu Studio, OrcaSlicer",
            package(&[("3D/3dmodel.model", &root), ("3D/Objects/object_1.model", &item(""))]),
            "moved back",
        ),
        same(
            "scaled by its item",
            "slicers",
            of(&model(
                original,
                ("millimeter", 2.0),
                "",
                "<item objectid=\"1\" transform=\"2 0 0 0 2 0 0 0 2 0 0 0\"/>",
            )),
        ),
        case(
            "mirrored by its item",
            "slicers",
            ThreeMf,
            of(&item("<item objectid=\"1\" transform=\"-1 0 0 0 1 0 0 0 1 0 0 0\"/>")),
            Outcome::Mirrored,
        ),
        same(
            "supports beside it",
            "slicers",
            of(&model(original, MILLIMETRES, support, "<item objectid=\"5\"/><item objectid=\"1\"/>")),
        ),
        same("in inches", "Windows 3D Builder", unit(("inch", 25.4))),
        same("in metres", "scripts", unit(("meter", 1000.0))),
        same("in microns", "scripts", unit(("micron", 1e-3))),
        same("nothing is built", "scripts", of(&item(""))),
        same(
            "a slice stack beside it",
            "slicers",
            of(&model(
                original,
                MILLIMETRES,
                "<s:slicestack id=\"9\"><s:slice ztop=\"1\"><s:vertices><s:vertex x=\"0\" y=\"0\"/></s:vertices></s:slice></s:slicestack>",
                "<item objectid=\"1\"/>",
            )),
        ),
        refused("in furlongs", "nobody", unit(("furlong", 201_168.0)), "no unit of 3MF"),
        refused("an object that is not there", "cut files", of(&item("<item objectid=\"4\"/>")), "no object 4"),
        refused("no archive", "failed downloads", b"PK\x03\x04 and no more".to_vec(), "3MF"),
        step_of("as we write it", "glasswarp", step.clone()),
        step_of("a second unit of length before its own", "assemblies of several programs", other(metres)),
        step_of(
            "a second unit of length behind its own",
            "assemblies of several programs",
            step.replacen("ENDSEC;\nEND-ISO", &format!("{metres}ENDSEC;\nEND-ISO"), 1),
        ),
        step_of("notes between the entities", "CATIA", other("/* the part; its '#1 */")),
        step_of("names in Latin-1", "old programs", other("#900002=PRODUCT_CATEGORY('L\u{e4}nge',$);")),
        case(
            "a unit that is none of length",
            "broken exports",
            Step,
            step.replace(statement, "SI_UNIT($,.GRAM.)"),
            Outcome::Refused("not understood"),
        ),
    ]
}
