use super::{
    Design,
    text::{in_order, plain_decimal},
};
use crate::solid::Solid;
use std::io::{self, Cursor, Write};
use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

const CONTENT_TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"><Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>
"#;
const RELATIONSHIPS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Target="/3D/3dmodel.model" Id="model" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>
"#;
/// Fast: twice the level is a tenth of the size, and three times the time.
const LEVEL: i64 = 3;

/// Writes 3MF (core specification 1.3), mm, z up: one object of the block's mesh.
///
/// # Errors
/// Those of the writer.
pub fn write_3mf(writer: &mut impl Write, solid: &Solid, design: &Design) -> io::Result<()> {
    // No time: the same block is the same file.
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .compression_level(Some(LEVEL))
        .last_modified_time(zip::DateTime::default())
        .large_file(solid.triangle_count() > 20_000_000);
    let mut package = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, text) in [("[Content_Types].xml", CONTENT_TYPES), ("_rels/.rels", RELATIONSHIPS)] {
        package.start_file(name, options)?;
        package.write_all(text.as_bytes())?;
    }
    package.start_file("3D/3dmodel.model", options)?;
    model(&mut package, solid, design)?;
    writer.write_all(package.finish()?.get_ref())?;
    writer.flush()
}

fn model(writer: &mut impl Write, solid: &Solid, design: &Design) -> io::Result<()> {
    writeln!(writer, r#"<?xml version="1.0" encoding="UTF-8"?>"#)?;
    writeln!(
        writer,
        r#"<model unit="millimeter" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">"#
    )?;
    let name = escaped(&design.name);
    let description = escaped(&design.description(solid));
    let application = concat!("glasswarp ", env!("CARGO_PKG_VERSION"));
    for (key, value) in [("Title", &name), ("Description", &description), ("Application", &application.to_owned())] {
        writeln!(writer, r#"<metadata name="{key}">{value}</metadata>"#)?;
    }
    writeln!(writer, r#"<resources><object id="1" type="model" name="{name}"><mesh><vertices>"#)?;
    in_order(writer, 0..solid.vertex_count(), |text, v| {
        for (before, value) in ["<vertex x=\"", "\" y=\"", "\" z=\""].into_iter().zip(solid.vertex(v)) {
            text.extend_from_slice(before.as_bytes());
            plain_decimal(text, value);
        }
        text.extend_from_slice(b"\"/>\n");
    })?;
    writeln!(writer, "</vertices><triangles>")?;
    in_order(writer, 0..solid.triangle_count(), |text, t| {
        for (before, value) in ["<triangle v1=\"", "\" v2=\"", "\" v3=\""].into_iter().zip(solid.triangle(t)) {
            text.extend_from_slice(before.as_bytes());
            text.extend_from_slice(itoa::Buffer::new().format(value).as_bytes());
        }
        text.extend_from_slice(b"\"/>\n");
    })?;
    writeln!(writer, r#"</triangles></mesh></object></resources><build><item objectid="1"/></build></model>"#)
}

/// A text within XML.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}
