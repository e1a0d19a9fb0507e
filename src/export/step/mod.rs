//! STEP (ISO 10303-21, application protocol 214): one closed solid of a bicubic B-spline exit face,
//! planes and elliptic cylinders, as CAD and CAM programs want it. An entry face that is no plane is
//! a bicubic B-spline face too.
//!
//! The face is the [`ControlNet`]. Of a rectangular block its border curves are made of the net's
//! own outermost control points, and so lie in the walls and on the face exactly. Any other outline
//! trims the face: by curves of their own, exact on straight sides and as near to face and wall as
//! nobody can tell on curved ones, whose images in the parameters of both are in the file too.
//! Heights are written to nine decimals of a millimetre.

mod choose;
mod nets;
mod part;
mod piece;
mod shell;
mod text;
mod trace;

pub use choose::{NetFit, StepError, StepTolerance, choose_net};

use super::{Design, text::in_order};
use crate::{solid::Solid, surface::ControlNet};
use nets::{Nets, count};
use part::Part;
use shell::Shell;
use std::io::{self, Write};
use text::{quoted, text_of};

/// Writes a STEP file of the block with `net` as its exit face, mm, and with `entry` as an entry face
/// that is no plane: without one, it is the spline through the nodes of that face.
///
/// # Errors
/// Those of the writer.
pub fn write_step(
    writer: &mut impl Write,
    solid: &Solid,
    net: &ControlNet,
    entry: Option<&ControlNet>,
    design: &Design,
) -> io::Result<()> {
    let of_nodes = match (entry, solid.entry_surface()) {
        (None, Some(surface)) => Some(ControlNet::interpolating(surface)),
        _ => None,
    };
    let entry = entry.filter(|_| solid.entry_surface().is_some()).or(of_nodes.as_ref());
    let nets = Nets { exit: net, entry };
    let shell = Shell::new(solid, nets);
    let name = quoted(&design.name);
    header(writer, solid, design)?;
    let mut written = 0;
    for net in nets.all() {
        write_points(writer, solid, net, written)?;
        written += count(net);
    }
    let mut out = Part::after(written, solid, nets);
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

/// The control points, numbered row by row after those that were written before.
fn write_points(writer: &mut impl Write, solid: &Solid, net: &ControlNet, before: usize) -> io::Result<()> {
    let origin = solid.origin_mm();
    let [x, y] = net.places_mm();
    let x: Vec<String> = x.iter().map(|v| text_of(v - origin.x)).collect();
    let y: Vec<String> = y.iter().map(|v| text_of(v - origin.y)).collect();
    let heights = net.heights_mm().as_slice();
    in_order(writer, 0..heights.len(), |text, k| {
        let z = text_of(heights[k] - origin.z);
        let (x, y) = (&x[k % x.len()], &y[k / x.len()]);
        text.push(b'#');
        text.extend_from_slice(itoa::Buffer::new().format(before + k + 1).as_bytes());
        for part in ["=CARTESIAN_POINT('',(", x, ",", y, ",", &z, "));\n"] {
            text.extend_from_slice(part.as_bytes());
        }
    })
}
