//! STEP (ISO 10303-21, application protocol 214): one closed solid of a bicubic B-spline exit face, planes and elliptic cylinders, as
//! CAD and CAM programs want it.
//!
//! The face is the [`ControlNet`]. Of a rectangular block its border curves are made of the net's own outermost control points, and so
//! lie in the walls and on the face exactly. Any other outline trims the face: by curves of their own, exact on straight sides
//! and as near to face and wall as nobody can tell on curved ones, whose images in the parameters of both are in the file too. Heights are
//! written to [`DECIMALS`] decimals of a millimetre.

mod choose;
mod part;
mod piece;
mod shell;
mod trace;

pub use choose::{NetFit, StepError, StepTolerance, choose_net};

use super::{Design, text::in_order};
use crate::{solid::Solid, surface::ControlNet};
use part::Part;
use shell::Shell;
use std::{
    fmt::Write as _,
    io::{self, Write},
};

/// Decimals of coordinates, mm: rounding moves the light by some nanometres.
const DECIMALS: usize = 9;
/// Distance below which two points are the same to a CAD kernel, mm.
const UNCERTAINTY_MM: &str = "1.E-06";
/// References to a line.
const PER_LINE: usize = 12;

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

/// A number as ISO 10303-21 has it: with a point, and as few decimals as it needs.
fn real(text: &mut String, value: f64) {
    decimals(text, value, DECIMALS);
}

/// The same as a text of its own.
fn text_of(value: f64) -> String {
    let mut text = String::new();
    real(&mut text, value);
    text
}

fn decimals(text: &mut String, value: f64, decimals: usize) {
    let start = text.len();
    // Writing to a string cannot fail.
    let _ = write!(text, "{value:.decimals$}");
    let kept = text.trim_end_matches('0').len();
    text.truncate(kept.max(start));
    if &text[start..] == "-0." {
        text.replace_range(start.., "0.");
    }
}

/// A text as ISO 10303-21 has it: 7 bits, everything else as UTF-16 in hexadecimal.
fn quoted(text: &str) -> String {
    let mut out = String::from("'");
    for character in text.chars() {
        match character {
            '\'' => out.push_str("''"),
            '\\' => out.push_str("\\\\"),
            ' '..='~' => out.push(character),
            c if c.is_control() => out.push(' '),
            other => {
                out.push_str("\\X2\\");
                other.encode_utf16(&mut [0; 2]).iter().for_each(|unit| {
                    let _ = write!(out, "{unit:04X}");
                });
                out.push_str("\\X0\\");
            }
        }
    }
    out.push('\'');
    out
}

/// References, broken into lines: a line of a million of them is more than some readers take.
fn references(numbers: impl IntoIterator<Item = usize>) -> String {
    let mut text = String::new();
    for (k, number) in numbers.into_iter().enumerate() {
        if k > 0 {
            text.push_str(if k % PER_LINE == 0 { ",\n" } else { "," });
        }
        let _ = write!(text, "#{number}");
    }
    text
}

/// Multiplicities and values of distinct knots.
fn knot_lists(knots: &[f64]) -> (String, String) {
    let (mut multiplicities, mut values) = (String::new(), String::new());
    for (k, &knot) in knots.iter().enumerate() {
        if k > 0 {
            let separator = if k % PER_LINE == 0 { ",\n" } else { "," };
            multiplicities.push_str(separator);
            values.push_str(separator);
        }
        multiplicities.push(if k == 0 || k + 1 == knots.len() { '4' } else { '1' });
        real(&mut values, knot);
    }
    (multiplicities, values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_a_point_and_no_more_digits_than_they_need() {
        for (value, wanted) in
            [(0.0, "0."), (-1e-12, "0."), (12.0, "12."), (-0.5, "-0.5"), (1e-9, "0.000000001"), (100.25, "100.25")]
        {
            let mut text = "x".to_owned();
            real(&mut text, value);
            assert_eq!(text[1..], *wanted);
        }
    }

    #[test]
    fn texts_are_seven_bit() {
        assert_eq!(quoted("it's a \\ é\n"), "'it''s a \\\\ \\X2\\00E9\\X0\\ '");
    }
}
