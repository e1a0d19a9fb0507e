//! STEP (ISO 10303-21, application protocol 214): one closed solid of a bicubic B-spline exit face,
//! planes and elliptic cylinders, as CAD and CAM programs want it.
//!
//! The face is the [`ControlNet`]. Of a rectangular block its border curves are made of the net's
//! own outermost control points, and so lie in the walls and on the face exactly. Any other outline
//! trims the face: by curves of their own, exact on straight sides and as near to face and wall as
//! nobody can tell on curved ones, whose images in the parameters of both are in the file too.
//! Heights are written to nine decimals of a millimetre.

mod choose;
mod part;
mod piece;
mod shell;
mod text;
mod trace;

pub use choose::{NetFit, StepError, StepTolerance, choose_net};

use super::{Design, text::in_order};
use crate::{solid::Solid, surface::ControlNet};
use part::Part;
use shell::Shell;
use std::io::{self, Write};
use text::{quoted, text_of};

/// Writes a STEP file of the block with `net` as its exit face, mm.
///
/// # Errors
/// Those of the writer.
pub fn write_step(writer: &mut impl Write, solid: &Solid, net: &ControlNet, design: &Design) -> io::Result<()> {
    let shell = Shell::new(solid, net);
    let name = quoted(&design.name);
    header(writer, solid, design)?;
    let points = net.points();
    write_points(writer, solid, net)?;
    let mut out = Part::after(points.0 * points.1, solid, net);
    let brep = out.shell(&shell, &name);
    out.product(brep, &name, &quoted(&design.description(solid)));
    writer.write_all(out.text().as_bytes())?;
    writer.write_all(b"ENDSEC;\nEND-ISO-10303-21;\n")?;
    writer.flush()
}

fn header(writer: &mut impl Write, solid: &Solid, design: &Design) -> io::Result<()> {
    writeln!(writer, "ISO-10303-21;\nHEADER;")?;
    writeln!(writer, "FILE_DESCRIPTION(({}),'2;1');", quoted(&design.description(solid)))?;
    // The time is left out, so that the same block is the same file.
    let version = env!("CARGO_PKG_VERSION");
    let name = quoted(&design.name);
    writeln!(writer, "FILE_NAME({name},'',(''),(''),'glasswarp {version}','glasswarp {version}','');")?;
    writeln!(writer, "FILE_SCHEMA(('AUTOMOTIVE_DESIGN {{ 1 0 10303 214 1 1 1 1 }}'));\nENDSEC;\nDATA;")
}

/// The control points, numbered row by row from 1.
fn write_points(writer: &mut impl Write, solid: &Solid, net: &ControlNet) -> io::Result<()> {
    let origin = solid.origin_mm();
    let [x, y] = net.places_mm();
    let x: Vec<String> = x.iter().map(|v| text_of(v - origin.x)).collect();
    let y: Vec<String> = y.iter().map(|v| text_of(v - origin.y)).collect();
    let heights = net.heights_mm().as_slice();
    in_order(writer, 0..heights.len(), |text, k| {
        let z = text_of(heights[k] - origin.z);
        let (x, y) = (&x[k % x.len()], &y[k / x.len()]);
        text.push(b'#');
        text.extend_from_slice(itoa::Buffer::new().format(k + 1).as_bytes());
        for part in ["=CARTESIAN_POINT('',(", x, ",", y, ",", &z, "));\n"] {
            text.extend_from_slice(part.as_bytes());
        }
    })
}
