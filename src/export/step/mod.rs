//! STEP (ISO 10303-21, application protocol 214): one closed solid of a bicubic B-spline exit face and planes, as CAD and CAM
//! programs want it.
//!
//! The face is the [`ControlNet`]; its border curves are made of the net's own outermost control points, and so lie in the
//! walls and on the face exactly. Heights are written to [`DECIMALS`] decimals of a millimetre.

mod choose;
mod shell;

pub use choose::{NetFit, StepError, StepTolerance, choose_net};

use super::{Design, text::in_order};
use crate::{solid::Solid, surface::ControlNet};
use glam::DVec3;
use shell::{Curve, Face, Sense, Shell, Surface};
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
    let mut out = Part { text: String::new(), next: points.0 * points.1 + 1 };
    let brep = out.shell(&shell, net, &name);
    out.product(brep, &name, &quoted(&design.description(solid)));
    writer.write_all(out.text.as_bytes())?;
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
    let real_text = |value: f64| {
        let mut text = String::new();
        real(&mut text, value);
        text
    };
    let [x, y] = net.places_mm();
    let x: Vec<String> = x.iter().map(|v| real_text(v - origin.x)).collect();
    let y: Vec<String> = y.iter().map(|v| real_text(v - origin.y)).collect();
    let heights = net.heights_mm().as_slice();
    in_order(writer, 0..heights.len(), |text, k| {
        let z = real_text(heights[k] - origin.z);
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
    let start = text.len();
    // Writing to a string cannot fail.
    let _ = write!(text, "{value:.DECIMALS$}");
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

/// Entities after the control points.
struct Part {
    text: String,
    next: usize,
}

impl Part {
    fn add(&mut self, entity: impl AsRef<str>) -> usize {
        let number = self.next;
        self.next += 1;
        let _ = writeln!(self.text, "#{number}={};", entity.as_ref());
        number
    }

    fn triple(&mut self, kind: &str, at: DVec3) -> usize {
        let mut text = format!("{kind}('',(");
        for (k, value) in at.to_array().into_iter().enumerate() {
            if k > 0 {
                text.push(',');
            }
            real(&mut text, value);
        }
        self.add(text + "))")
    }

    fn axes(&mut self, at: DVec3, z: DVec3, x: DVec3) -> usize {
        let (at, z, x) = (self.triple("CARTESIAN_POINT", at), self.triple("DIRECTION", z), self.triple("DIRECTION", x));
        self.add(format!("AXIS2_PLACEMENT_3D('',#{at},#{z},#{x})"))
    }

    /// The solid; returns its number.
    fn shell(&mut self, shell: &Shell, net: &ControlNet, name: &str) -> usize {
        let vertices: Vec<usize> = shell
            .vertices
            .iter()
            .map(|&at| {
                let point = self.triple("CARTESIAN_POINT", at);
                self.add(format!("VERTEX_POINT('',#{point})"))
            })
            .collect();
        let edges: Vec<usize> = shell
            .edges
            .iter()
            .map(|edge| {
                let curve = match edge.curve {
                    Curve::Line => self.line(shell.vertices[edge.from], shell.vertices[edge.to]),
                    Curve::Border(side) => self.border(net, side),
                };
                self.add(format!("EDGE_CURVE('',#{},#{},#{curve},.T.)", vertices[edge.from], vertices[edge.to]))
            })
            .collect();
        let faces: Vec<usize> = shell.faces.iter().map(|face| self.face(face, net, &edges)).collect();
        let closed = self.add(format!("CLOSED_SHELL('',({}))", references(faces)));
        self.add(format!("MANIFOLD_SOLID_BREP({name},#{closed})"))
    }

    fn line(&mut self, from: DVec3, to: DVec3) -> usize {
        let (start, direction) =
            (self.triple("CARTESIAN_POINT", from), self.triple("DIRECTION", (to - from).normalize()));
        let vector = self.add(format!("VECTOR('',#{direction},1.)"));
        self.add(format!("LINE('',#{start},#{vector})"))
    }

    /// A border curve of the net, on its own control points.
    fn border(&mut self, net: &ControlNet, side: usize) -> usize {
        let (nx, ny) = net.points();
        let along = side % 2;
        let number = |i: usize, j: usize| 1 + j * nx + i;
        let points: Vec<usize> = match side {
            0 => (0..nx).map(|i| number(i, 0)).collect(),
            1 => (0..ny).map(|j| number(nx - 1, j)).collect(),
            2 => (0..nx).map(|i| number(i, ny - 1)).collect(),
            _ => (0..ny).map(|j| number(0, j)).collect(),
        };
        let (multiplicities, knots) = knot_lists(net.knots()[along]);
        self.add(format!(
            "B_SPLINE_CURVE_WITH_KNOTS('',3,({}),.UNSPECIFIED.,.F.,.F.,({multiplicities}),({knots}),.UNSPECIFIED.)",
            references(points)
        ))
    }

    fn face(&mut self, face: &Face, net: &ControlNet, edges: &[usize]) -> usize {
        let surface = match face.surface {
            Surface::Net => self.net(net),
            Surface::Plane { at, normal } => {
                // Any direction within the plane.
                let x = if normal.z == 0.0 { DVec3::Z } else { DVec3::X };
                let axes = self.axes(at, normal, x);
                self.add(format!("PLANE('',#{axes})"))
            }
        };
        let bounds: Vec<usize> = face
            .loops
            .iter()
            .enumerate()
            .map(|(k, around)| {
                let oriented: Vec<usize> = around
                    .iter()
                    .map(|&(edge, sense)| {
                        let sense = if sense == Sense::Forwards { ".T." } else { ".F." };
                        self.add(format!("ORIENTED_EDGE('',*,*,#{},{sense})", edges[edge]))
                    })
                    .collect();
                let around = self.add(format!("EDGE_LOOP('',({}))", references(oriented)));
                let kind = if k == 0 { "FACE_OUTER_BOUND" } else { "FACE_BOUND" };
                self.add(format!("{kind}('',#{around},.T.)"))
            })
            .collect();
        self.add(format!("ADVANCED_FACE('',({}),#{surface},.T.)", references(bounds)))
    }

    fn net(&mut self, net: &ControlNet) -> usize {
        let (nx, ny) = net.points();
        let mut text = String::from("B_SPLINE_SURFACE_WITH_KNOTS('exit face',3,3,(");
        for i in 0..nx {
            let column = references((0..ny).map(|j| 1 + j * nx + i));
            let _ = write!(text, "{}({column})", if i == 0 { "" } else { ",\n" });
        }
        let [x, y] = net.knots().map(knot_lists);
        let _ = write!(text, "),.UNSPECIFIED.,.F.,.F.,.F.,({}),({}),\n({}),({}),.UNSPECIFIED.)", x.0, y.0, x.1, y.1);
        self.add(text)
    }

    /// Everything around the solid: units, product, and how they belong together.
    fn product(&mut self, brep: usize, name: &str, description: &str) {
        let origin = self.axes(DVec3::ZERO, DVec3::Z, DVec3::X);
        let mm = self.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))");
        let radian = self.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))");
        let steradian = self.add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())");
        let uncertainty = self.add(format!(
            "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE({UNCERTAINTY_MM}),#{mm},'distance_accuracy_value','confusion accuracy')"
        ));
        let context = self.add(format!(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#{uncertainty}))GLOBAL_UNIT_ASSIGNED_CONTEXT((#{mm},#{radian},#{steradian}))REPRESENTATION_CONTEXT('',''))"
        ));
        let shape = self.add(format!("ADVANCED_BREP_SHAPE_REPRESENTATION({name},(#{origin},#{brep}),#{context})"));
        let application = self.add("APPLICATION_CONTEXT('core data for automotive mechanical design processes')");
        self.add(format!(
            "APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2001,#{application})"
        ));
        let product_context = self.add(format!("PRODUCT_CONTEXT('',#{application},'mechanical')"));
        let product = self.add(format!("PRODUCT({name},{name},{description},(#{product_context}))"));
        self.add(format!("PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,(#{product}))"));
        let formation = self.add(format!("PRODUCT_DEFINITION_FORMATION('','',#{product})"));
        let part = self.add(format!("PRODUCT_DEFINITION_CONTEXT('part definition',#{application},'design')"));
        let definition = self.add(format!("PRODUCT_DEFINITION('design','',#{formation},#{part})"));
        let defined = self.add(format!("PRODUCT_DEFINITION_SHAPE('','',#{definition})"));
        self.add(format!("SHAPE_DEFINITION_REPRESENTATION(#{defined},#{shape})"));
    }
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
