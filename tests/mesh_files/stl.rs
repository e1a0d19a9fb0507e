//! STL in its dialects.

use super::{Case, EXACT, Original, Outcome, case};
use glam::DVec3;
use glasswarp_verify::load::Format::Stl;

pub(super) fn binary(header: &str, triangles: &[[DVec3; 3]]) -> Vec<u8> {
    let mut bytes = header.as_bytes().to_vec();
    bytes.resize(80, b' ');
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for corners in triangles {
        bytes.extend([0; 12]);
        corners.iter().for_each(|v| v.to_array().iter().for_each(|c| bytes.extend((*c as f32).to_le_bytes())));
        bytes.extend([0; 2]);
    }
    bytes
}

fn text(triangles: &[[DVec3; 3]]) -> String {
    let mut text = String::from("solid part\n");
    for corners in triangles {
        text += "facet normal 0 0 1\n  outer loop\n";
        corners.iter().for_each(|v| text += &format!("    vertex {:?} {:?} {:?}\n", v.x, v.y, v.z));
        text += "  endloop\nendfacet\n";
    }
    text + "endsolid part\n"
}

pub(super) fn cases(original: &Original) -> Vec<Case> {
    let triangles = original.triangles();
    let (whole, plain) = (binary("", &triangles), text(&triangles));
    let same = |kind: &str, from, bytes: Vec<u8>| case(kind, from, Stl, bytes, Outcome::Block(EXACT));
    let changed = |kind: &str, from, old: &str, new: &str| {
        assert!(plain.contains(old), "{old}");
        same(kind, from, plain.replace(old, new).into())
    };
    let refused = |kind: &str, from, bytes: Vec<u8>, words| case(kind, from, Stl, bytes, Outcome::Refused(words));
    let counted = |count: usize| {
        let mut bytes = whole.clone();
        bytes[80..84].copy_from_slice(&(count as u32).to_le_bytes());
        bytes
    };
    let half = triangles.len() / 2;
    let two = text(&triangles[..half]).replace("part", "lower") + &text(&triangles[half..]);
    let mut inward = triangles.clone();
    inward.iter_mut().for_each(|corners| corners.swap(1, 2));
    let mut flipped = triangles.clone();
    flipped[7].swap(0, 1);
    let mut not_a_number = whole.clone();
    not_a_number[84 + 50 + 12..84 + 50 + 16].copy_from_slice(&f32::NAN.to_le_bytes());
    let wide: Vec<u8> = std::iter::once(0xfeff).chain(plain.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    vec![
        same("binary", "nearly all programs", whole.clone()),
        same("binary whose header begins with 'solid'", "SolidWorks, many libraries", binary("solid part", &triangles)),
        same("binary with a byte behind the end", "downloads, old exporters", [whole.clone(), vec![0]].concat()),
        same(
            "binary headed 'solid' with bytes behind the end",
            "Materialise Magics",
            [binary("solid exported part", &triangles), vec![1; 70]].concat(),
        ),
        same("binary with colours in its attributes", "VisCAM, SolidView", {
            let mut bytes = whole.clone();
            (0..triangles.len()).for_each(|k| bytes[84 + 50 * k + 48..84 + 50 * (k + 1)].fill(0x7c));
            bytes
        }),
        same("text", "OpenSCAD, CAD programs", plain.clone().into()),
        changed("text, normals NaN", "MeshLab, numpy", "0 0 1", "nan nan nan"),
        changed("text, normals -1.#IND", "programs of old Visual C++", "0 0 1", "-1.#IND -1.#IND -1.#IND"),
        changed("text without normals", "scripts", " normal 0 0 1", ""),
        changed("text with decimal commas", "programs under a German or French locale", ".", ","),
        changed("text, 'end loop'", "old exporters", "endloop", "end loop"),
        same("text in upper case", "AutoCAD, CATIA", plain.to_uppercase().into()),
        same("text with a byte order mark", "editors under Windows", format!("\u{feff}{plain}").into()),
        changed("text, lines end with CR LF", "Windows", "\n", "\r\n"),
        changed("text, lines end with CR", "old Macintosh programs", "\n", "\r"),
        changed("text, words behind 'endfacet'", "colouring tools", "endfacet", "endfacet 31"),
        same("text, several solids", "assemblies", two.into()),
        same(
            "text without its last line",
            "cut copies",
            plain.trim_end().strip_suffix("endsolid part").unwrap().into(),
        ),
        changed("text, a name of keywords", "strange part names", "solid part", "solid facet normal vertex"),
        changed("text, no name", "scripts", "solid part", "solid"),
        same("text with notes before it", "scripts", format!("; made by hand\n\n{plain}").into()),
        changed("text with tabs and empty lines", "scripts", "\n", "\t \n\n"),
        changed("text, all of a facet on one line", "scripts", "\n  ", " "),
        case(
            "triangles all inside out",
            "mirrored by scaling with -1",
            Stl,
            binary("", &inward),
            Outcome::Righted("turned inside out"),
        ),
        refused("one triangle turned over", "hand-made repairs", binary("", &flipped), "opposite orientation"),
        refused("a triangle is missing", "hand-made repairs", binary("", &triangles[1..]), "3 open edges"),
        refused("text in UTF-16", "PowerShell redirection", wide, "UTF-16"),
        refused("binary, count too small", "streaming exporters", counted(3), "promises 3 triangles"),
        refused("binary, count zero", "streaming exporters", counted(0), "promises 0 triangles"),
        refused("binary, cut off", "broken downloads", whole[..whole.len() / 2].into(), "truncated"),
        refused("text, cut off", "broken downloads", plain.as_bytes()[..plain.len() - 60].into(), "not three numbers"),
        refused("text, a word misspelt", "hand-made files", plain.replacen("vertex", "vertx", 1).into(), "'vertx'"),
        refused(
            "text, 1.234,5",
            "thousands and decimals mixed",
            plain.replacen("vertex ", "vertex 1.234,5 ", 1).into(),
            "no number",
        ),
        refused("a coordinate NaN", "failed computations", not_a_number, "not finite"),
        refused("a web page", "failed downloads", b"<!doctype html><title>404</title>".to_vec(), "STL"),
    ]
}
