//! The entities of the solid after its control points.

use super::{
    nets::{Nets, Side},
    shell::{Curve, Face, Facing, Pipe, Sense, Shell, Surface},
    text::{UNCERTAINTY_MM, decimals, knot_lists, real, references, text_of},
    trace::Trace,
};
use crate::solid::Solid;
use glam::{DVec2, DVec3};
use std::fmt::Write as _;

/// Decimals of angles, rad: no less exact than coordinates on a cylinder of a metre.
const ANGLE_DECIMALS: usize = 12;

/// Entities with their numbers.
pub(super) struct Part<'a> {
    text: String,
    next: usize,
    nets: Nets<'a>,
    /// Of the coordinates of the file.
    origin: DVec3,
    /// The context of curves in the parameters of surfaces, once there is one.
    plane_context: Option<usize>,
}

impl<'a> Part<'a> {
    /// Numbers go on after `last`.
    pub(super) fn after(last: usize, solid: &Solid, nets: Nets<'a>) -> Self {
        Self { text: String::new(), next: last + 1, nets, origin: solid.origin_mm(), plane_context: None }
    }

    pub(super) fn text(&self) -> &str {
        &self.text
    }

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
    pub(super) fn shell(&mut self, shell: &Shell, name: &str) -> usize {
        let surfaces: Vec<usize> = shell.faces.iter().map(|face| self.surface(&face.surface)).collect();
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
            .enumerate()
            .map(|(k, edge)| {
                let curve = match &edge.curve {
                    Curve::Line => self.line(shell.vertices[edge.from], shell.vertices[edge.to]),
                    Curve::Border(of, side) => self.border(*of, *side),
                    Curve::Arc(pipe) => self.ellipse(pipe),
                    Curve::Trace(trace) => {
                        let of_edge = |face: &Face| face.loops.iter().flatten().any(|used| used.0 == k);
                        let faces = shell.faces.iter().zip(&surfaces).filter(|(face, _)| of_edge(face));
                        let faces: Vec<(Surface, usize)> = faces.map(|(face, &at)| (face.surface, at)).collect();
                        self.trace(trace, &faces)
                    }
                };
                self.add(format!("EDGE_CURVE('',#{},#{},#{curve},.T.)", vertices[edge.from], vertices[edge.to]))
            })
            .collect();
        let faces: Vec<usize> =
            shell.faces.iter().zip(&surfaces).map(|(face, &surface)| self.face(face, surface, &edges)).collect();
        let closed = self.add(format!("CLOSED_SHELL('',({}))", references(faces)));
        self.add(format!("MANIFOLD_SOLID_BREP({name},#{closed})"))
    }

    fn line(&mut self, from: DVec3, to: DVec3) -> usize {
        let start = self.triple("CARTESIAN_POINT", from);
        let vector = self.vector((to - from).normalize());
        self.add(format!("LINE('',#{start},#{vector})"))
    }

    fn vector(&mut self, direction: DVec3) -> usize {
        let direction = self.triple("DIRECTION", direction);
        self.add(format!("VECTOR('',#{direction},1.)"))
    }

    /// A circle or an ellipse, with the greater semi-axis first: kernels want it so.
    fn ellipse(&mut self, pipe: &Pipe) -> usize {
        let (greater, along, lesser) = pipe.axes();
        let axes = self.axes(pipe.centre, DVec3::Z, along);
        if greater == lesser {
            let radius = text_of(greater);
            return self.add(format!("CIRCLE('',#{axes},{radius})"));
        }
        let (greater, lesser) = (text_of(greater), text_of(lesser));
        self.add(format!("ELLIPSE('',#{axes},{greater},{lesser})"))
    }

    /// A border curve of a net, on its own control points.
    fn border(&mut self, of: Side, side: usize) -> usize {
        let (net, before) = self.nets.of(of);
        let (nx, ny) = net.points();
        let along = side % 2;
        let number = |i: usize, j: usize| 1 + before + j * nx + i;
        let points: Vec<usize> = match side {
            0 => (0..nx).map(|i| number(i, 0)).collect(),
            1 => (0..ny).map(|j| number(nx - 1, j)).collect(),
            2 => (0..nx).map(|i| number(i, ny - 1)).collect(),
            _ => (0..ny).map(|j| number(0, j)).collect(),
        };
        self.spline(&points, net.knots()[along])
    }

    /// A clamped cubic B-spline curve through these points.
    fn spline(&mut self, points: &[usize], knots: &[f64]) -> usize {
        let (multiplicities, knots) = knot_lists(knots);
        self.add(format!(
            "B_SPLINE_CURVE_WITH_KNOTS('',3,({}),.UNSPECIFIED.,.F.,.F.,({multiplicities}),({knots}),.UNSPECIFIED.)",
            references(points.iter().copied())
        ))
    }

    /// The curve between the exit face and a wall; on a curved one with its images in the
    /// parameters of both.
    fn trace(&mut self, trace: &Trace, faces: &[(Surface, usize)]) -> usize {
        let points: Vec<usize> =
            trace.points.iter().map(|&at| self.triple("CARTESIAN_POINT", at - self.origin)).collect();
        let curve = self.spline(&points, &trace.knots);
        if !faces.iter().any(|(surface, _)| matches!(surface, Surface::Pipe { .. })) {
            return curve;
        }
        let images: Vec<usize> = faces
            .iter()
            .map(|(surface, number)| {
                let image = match surface {
                    Surface::Pipe { pipe, .. } => self.on_pipe(trace, pipe),
                    _ => self.on_net(trace),
                };
                self.parameter_curve(&image, &trace.knots, *number)
            })
            .collect();
        self.add(format!("SURFACE_CURVE('',#{curve},({}),.CURVE_3D.)", references(images)))
    }

    /// Parameters of the net are counted in intervals from its lower corner, and `x` and `y` are
    /// linear in them.
    fn on_net(&self, trace: &Trace) -> Vec<DVec2> {
        let extent = self.nets.exit.extent();
        let intervals = self.nets.exit.knots().map(|knots| knots[knots.len() - 1]);
        let per_mm = DVec2::from(intervals) / extent.as_vec();
        trace.points.iter().map(|at| (at.truncate() - extent.lower()) * per_mm).collect()
    }

    /// Parameters of a wall are the angle and the height above its placement. Along the curve the
    /// angle is linear.
    fn on_pipe(&self, trace: &Trace, pipe: &Pipe) -> Vec<DVec2> {
        let angles = trace.shares().into_iter().map(|share| pipe.begin() + share * pipe.turn);
        let heights = trace.points.iter().map(|at| at.z - self.origin.z - pipe.centre.z);
        angles.zip(heights).map(DVec2::from).collect()
    }

    fn parameter_curve(&mut self, points: &[DVec2], knots: &[f64], surface: usize) -> usize {
        let points: Vec<usize> = points
            .iter()
            .map(|at| {
                let mut text = String::from("CARTESIAN_POINT('',(");
                decimals(&mut text, at.x, ANGLE_DECIMALS);
                text.push(',');
                decimals(&mut text, at.y, ANGLE_DECIMALS);
                self.add(text + "))")
            })
            .collect();
        let curve = self.spline(&points, knots);
        let context = match self.plane_context {
            Some(number) => number,
            None => self.add(
                "(GEOMETRIC_REPRESENTATION_CONTEXT(2)PARAMETRIC_REPRESENTATION_CONTEXT()REPRESENTATION_CONTEXT('2D SPACE',''))",
            ),
        };
        self.plane_context = Some(context);
        let representation = self.add(format!("DEFINITIONAL_REPRESENTATION('',(#{curve}),#{context})"));
        self.add(format!("PCURVE('',#{surface},#{representation})"))
    }

    fn surface(&mut self, surface: &Surface) -> usize {
        match surface {
            Surface::Net(side) => self.net(*side),
            Surface::Plane { at, normal } => {
                // Any direction within the plane.
                let x = if normal.z == 0.0 { DVec3::Z } else { DVec3::X };
                let axes = self.axes(*at, *normal, x);
                self.add(format!("PLANE('',#{axes})"))
            }
            Surface::Pipe { pipe, .. } => {
                let (greater, along, lesser) = pipe.axes();
                if greater == lesser {
                    let axes = self.axes(pipe.centre, DVec3::Z, along);
                    let radius = text_of(greater);
                    return self.add(format!("CYLINDRICAL_SURFACE('',#{axes},{radius})"));
                }
                let (ellipse, vector) = (self.ellipse(pipe), self.vector(DVec3::Z));
                self.add(format!("SURFACE_OF_LINEAR_EXTRUSION('',#{ellipse},#{vector})"))
            }
        }
    }

    fn face(&mut self, face: &Face, surface: usize, edges: &[usize]) -> usize {
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
        // Normals of planes point out of the block already; those of cylinders away from their
        // axes, and those of nets up.
        let turned = matches!(face.surface, Surface::Pipe { facing: Facing::In, .. } | Surface::Net(Side::Entry));
        let same = if turned { ".F." } else { ".T." };
        self.add(format!("ADVANCED_FACE('',({}),#{surface},{same})", references(bounds)))
    }

    fn net(&mut self, side: Side) -> usize {
        let (net, before) = self.nets.of(side);
        let (nx, ny) = net.points();
        let name = if side == Side::Exit { "exit face" } else { "entry face" };
        let mut text = format!("B_SPLINE_SURFACE_WITH_KNOTS('{name}',3,3,(");
        for i in 0..nx {
            let column = references((0..ny).map(|j| 1 + before + j * nx + i));
            let _ = write!(text, "{}({column})", if i == 0 { "" } else { ",\n" });
        }
        let [x, y] = net.knots().map(knot_lists);
        let _ = write!(text, "),.UNSPECIFIED.,.F.,.F.,.F.,({}),({}),\n({}),({}),.UNSPECIFIED.)", x.0, y.0, x.1, y.1);
        self.add(text)
    }

    /// Everything around the solid: units, product, and how they belong together.
    pub(super) fn product(&mut self, brep: usize, name: &str, description: &str) {
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
