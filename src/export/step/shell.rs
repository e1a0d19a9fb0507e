//! The topology of the block as a CAD kernel has it: vertices, edges that two faces share, faces
//! with their loops.

use super::{
    nets::{Nets, Side},
    piece::Piece,
    trace::Trace,
};
use crate::{
    grid::{Contour, Outline},
    solid::Solid,
    surface::ControlNet,
};
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// An edge between two vertices.
#[derive(Clone, Debug)]
pub(super) struct Edge {
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) curve: Curve,
}

/// The curve of an edge.
#[derive(Clone, Debug)]
pub(super) enum Curve {
    Line,
    /// The border of a B-spline face: south, east, north, west from 0 to 3, along +x or +y.
    Border(Side, usize),
    /// Of an ellipse, in the plane of its two vertices.
    Arc(Pipe),
    /// Where the exit face meets a wall that is not a side of its rectangle, in the library's
    /// frame.
    Trace(Trace),
}

/// An upright elliptic cylinder, or the ellipse that it is above, and the part of it that is meant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pipe {
    /// In the coordinates of the files.
    pub(super) centre: DVec3,
    pub(super) semi_axes: DVec2,
    /// The angle at which a [`Piece::Arc`] begins, from `+x`, and by how much it turns.
    begin: f64,
    pub(super) turn: f64,
}

/// What a face lies in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Surface {
    Net(Side),
    /// Through `at`, with this outward normal.
    Plane {
        at: DVec3,
        normal: DVec3,
    },
    Pipe {
        pipe: Pipe,
        facing: Facing,
    },
}

/// Where a wall faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Facing {
    /// Away from the axis of the block.
    Out,
    /// Towards it.
    In,
}

/// A face and its loops: edges, each with whether it is run through forwards; the outer loop first.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Face {
    pub(super) surface: Surface,
    pub(super) loops: Vec<Vec<(usize, Sense)>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sense {
    Forwards,
    Backwards,
}

/// A closed shell.
#[derive(Clone, Debug, Default)]
pub(super) struct Shell {
    pub(super) vertices: Vec<DVec3>,
    pub(super) edges: Vec<Edge>,
    pub(super) faces: Vec<Face>,
}

impl Shell {
    /// The shell of a block with these B-spline faces, in the coordinates of its files.
    pub(super) fn new(solid: &Solid, nets: Nets<'_>) -> Self {
        let mut shell = Self::default();
        let net = nets.exit;
        let contour = solid.contour().unwrap_or_else(|| Outline::Rectangle.within(net.extent()));
        let around = Piece::around(&contour);
        let exit = if contour.is_rectangle() {
            shell.border(solid, nets, Side::Exit, &around)
        } else {
            shell.traced(solid, net, &contour, &around)
        };
        shell.face(Surface::Net(Side::Exit), &[&exit]);
        let outer = match solid.curve() {
            (curve, Some((along, reach))) => Piece::cut_off(&Piece::around(&curve), along, reach),
            (curve, None) => Piece::around(&curve),
        };
        let lower = match nets.entry {
            None => shell.ring(solid, &outer, solid.entry_z_mm()),
            Some(_) => shell.border(solid, nets, Side::Entry, &around),
        };
        let reversed: Vec<usize> = lower.iter().rev().copied().collect();
        match nets.entry {
            None => shell.plane(DVec3::NEG_Z, &[&reversed]),
            Some(_) => shell.face(Surface::Net(Side::Entry), &[&reversed]),
        }
        match solid.rim_z_mm() {
            None => shell.walls(solid, &outer, &exit, &lower, Facing::Out),
            Some(rim_z) => {
                let upper = shell.ring(solid, &outer, rim_z);
                let inner = shell.ring(solid, &around, rim_z);
                let hole: Vec<usize> = inner.iter().rev().copied().collect();
                shell.plane(DVec3::Z, &[&upper, &hole]);
                shell.walls(solid, &outer, &upper, &lower, Facing::Out);
                // Below the exit face its walls face outwards, above it inwards.
                if rim_z < shell.vertices[exit[0]].z + solid.origin_mm().z {
                    shell.walls(solid, &around, &exit, &inner, Facing::Out);
                } else {
                    shell.walls(solid, &around, &inner, &exit, Facing::In);
                }
            }
        }
        shell
    }

    /// The vertices of a B-spline face over a rectangle, at the beginnings of these sides, and the
    /// edges between them.
    fn border(&mut self, solid: &Solid, nets: Nets<'_>, side: Side, around: &[Piece]) -> Vec<usize> {
        let (net, _) = nets.of(side);
        let (right, top) = (net.points().0 - 1, net.points().1 - 1);
        // The border is exactly as high as the outermost control points.
        let heights = [(0, 0), (right, 0), (right, top), (0, top)].map(|at| net.heights_mm()[at]);
        let corners = around.iter().zip(heights);
        let corners: Vec<usize> =
            corners.map(|(piece, z)| self.vertex(piece.at(0.0).extend(z) - solid.origin_mm())).collect();
        for k in 0..corners.len() {
            let (from, to) = (corners[k], corners[(k + 1) % corners.len()]);
            let (from, to) = if k < 2 { (from, to) } else { (to, from) };
            self.edges.push(Edge { from, to, curve: Curve::Border(side, k) });
        }
        corners
    }

    /// The vertices of an exit face that an outline trims, at the beginnings of its pieces, and the
    /// edges between them.
    fn traced(&mut self, solid: &Solid, net: &ControlNet, contour: &Contour, around: &[Piece]) -> Vec<usize> {
        let place = |piece: &Piece| piece.at(0.0).extend(net.sample(piece.at(0.0)).0);
        let exit: Vec<usize> = around.iter().map(|piece| self.vertex(place(piece) - solid.origin_mm())).collect();
        for (k, piece) in around.iter().enumerate() {
            let (from, to) = (exit[k], exit[(k + 1) % exit.len()]);
            self.edges.push(Edge { from, to, curve: Curve::Trace(Trace::new(net, contour, piece)) });
        }
        exit
    }

    fn vertex(&mut self, at: DVec3) -> usize {
        self.vertices.push(at);
        self.vertices.len() - 1
    }

    /// Vertices where these pieces begin, at the height `z` of the library's frame, and the curved
    /// edges between them.
    fn ring(&mut self, solid: &Solid, pieces: &[Piece], z: f64) -> Vec<usize> {
        let origin = solid.origin_mm();
        let ring: Vec<usize> = pieces.iter().map(|piece| self.vertex(piece.at(0.0).extend(z) - origin)).collect();
        for (k, piece) in pieces.iter().enumerate() {
            if let Some(pipe) = Pipe::of(piece, z, origin) {
                let (from, to) = (ring[k], ring[(k + 1) % ring.len()]);
                self.edges.push(Edge { from, to, curve: Curve::Arc(pipe) });
            }
        }
        ring
    }

    /// Upright walls between two rings whose vertices stand where these pieces begin.
    fn walls(&mut self, solid: &Solid, pieces: &[Piece], upper: &[usize], lower: &[usize], facing: Facing) {
        for (k, piece) in pieces.iter().enumerate() {
            let next = (k + 1) % pieces.len();
            // Counter-clockwise from outside the block's axis.
            let mut around = [lower[k], lower[next], upper[next], upper[k]];
            if facing == Facing::In {
                around.reverse();
            }
            match Pipe::of(piece, solid.entry_z_mm(), solid.origin_mm()) {
                Some(pipe) => self.face(Surface::Pipe { pipe, facing }, &[&around]),
                None => {
                    let along = (self.vertices[upper[next]] - self.vertices[upper[k]]).truncate();
                    let outwards = -along.perp().normalize().extend(0.0);
                    self.plane(if facing == Facing::Out { outwards } else { -outwards }, &[&around]);
                }
            }
        }
    }

    fn plane(&mut self, normal: DVec3, loops: &[&[usize]]) {
        let at = self.vertices[loops[0][0]];
        self.face(Surface::Plane { at, normal }, loops);
    }

    /// A face with loops through these vertices, counter-clockwise as seen from outside.
    fn face(&mut self, surface: Surface, loops: &[&[usize]]) {
        let loops = loops
            .iter()
            .map(|corners| {
                (0..corners.len()).map(|k| self.edge(corners[k], corners[(k + 1) % corners.len()])).collect()
            })
            .collect();
        self.faces.push(Face { surface, loops });
    }

    /// The edge between two vertices, which a ring or a neighbour may have made already; a line
    /// else.
    fn edge(&mut self, from: usize, to: usize) -> (usize, Sense) {
        let same = |edge: &Edge| (edge.from, edge.to) == (from, to);
        let turned = |edge: &Edge| (edge.from, edge.to) == (to, from);
        if let Some(k) = self.edges.iter().position(same) {
            return (k, Sense::Forwards);
        }
        if let Some(k) = self.edges.iter().position(turned) {
            return (k, Sense::Backwards);
        }
        self.edges.push(Edge { from, to, curve: Curve::Line });
        (self.edges.len() - 1, Sense::Forwards)
    }
}

impl Pipe {
    /// The wall of a piece, centred at the height `z` of the library's frame; none of a straight
    /// one.
    fn of(piece: &Piece, z: f64, origin: DVec3) -> Option<Self> {
        match *piece {
            Piece::Straight { .. } => None,
            Piece::Arc { centre, semi_axes, begin, end } => {
                Some(Self { centre: centre.extend(z) - origin, semi_axes, begin, turn: end - begin })
            }
        }
    }

    /// Greater semi-axis and its direction, and the other semi-axis.
    pub(super) fn axes(&self) -> (f64, DVec3, f64) {
        let DVec2 { x, y } = self.semi_axes;
        if x >= y { (x, DVec3::X, y) } else { (y, DVec3::Y, x) }
    }

    /// The angle at which it begins, counted from the greater semi-axis, rad; it ends at 2 pi at
    /// most.
    pub(super) fn begin(&self) -> f64 {
        let from = if self.semi_axes.x >= self.semi_axes.y { 0.0 } else { FRAC_PI_2 };
        // Arcs begin on an axis at the earliest, and rounding makes no turn of it.
        if self.begin < from - 1e-9 { self.begin - from + TAU } else { (self.begin - from).max(0.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        grid::{Extent, Field},
        solid::{Origin, Rim, Shape, Stock},
        surface::HeightField,
    };

    /// The directed ends of an edge in a loop.
    fn ends(shell: &Shell, (k, sense): (usize, Sense)) -> [usize; 2] {
        let edge = &shell.edges[k];
        if sense == Sense::Forwards { [edge.from, edge.to] } else { [edge.to, edge.from] }
    }

    fn examine(shell: &Shell) {
        for k in 0..shell.edges.len() {
            let uses: Vec<Sense> =
                shell.faces.iter().flat_map(|f| f.loops.iter().flatten()).filter(|u| u.0 == k).map(|u| u.1).collect();
            assert!(uses == [Sense::Forwards, Sense::Backwards] || uses == [Sense::Backwards, Sense::Forwards]);
        }
        // Euler and Poincaré for genus 0: one ring more for every hole.
        let holes: usize = shell.faces.iter().map(|f| f.loops.len() - 1).sum();
        assert_eq!(shell.vertices.len() + shell.faces.len(), shell.edges.len() + 2 + holes);
        for face in &shell.faces {
            match face.surface {
                Surface::Net(_) => {}
                // Every plane's loops lie in it, and turn around its normal.
                Surface::Plane { at, normal } => {
                    for (n, around) in face.loops.iter().enumerate() {
                        let mut area = DVec3::ZERO;
                        for [a, b] in around.iter().map(|&used| ends(shell, used)) {
                            let (a, b) = (shell.vertices[a], shell.vertices[b]);
                            assert!((a - at).dot(normal).abs() < 1e-12);
                            area += 0.5 * (a - at).cross(b - at);
                        }
                        assert!(if n == 0 { area.dot(normal) > 1.0 } else { area.dot(normal) < -1.0 }, "{face:?}");
                    }
                }
                Surface::Pipe { pipe, facing } => {
                    let mut area = DVec3::ZERO;
                    for [a, b] in face.loops[0].iter().map(|&used| ends(shell, used)) {
                        let (a, b) = (shell.vertices[a] - pipe.centre, shell.vertices[b] - pipe.centre);
                        assert!(((a.truncate() / pipe.semi_axes).length() - 1.0).abs() < 1e-12);
                        area += 0.5 * a.cross(b);
                    }
                    let middle = DVec2::from_angle(pipe.begin + 0.5 * pipe.turn);
                    let turn = area.dot(middle.extend(0.0));
                    assert!(if facing == Facing::Out { turn > 0.1 } else { turn < -0.1 }, "{face:?}");
                }
            }
        }
    }

    #[test]
    fn every_edge_has_two_faces_that_run_along_it_in_opposite_directions() {
        let extent = Extent::new(20.0, 30.0);
        let surface = HeightField::new(extent, Field::from_fn(9, 9, |i, j| 0.01 * (i * i + 3 * j) as f64));
        for (rim, faces, edges) in [
            (None, 6, 12),
            (Some(Rim { width_mm: 5.0, rise_mm: 1.0, mark_mm: None }), 11, 24),
            (Some(Rim { width_mm: 5.0, rise_mm: -2.0, mark_mm: Some(3.0) }), 12, 27),
        ] {
            let shape = Shape { rim, origin: Origin::Corner, ..Shape::default() };
            let solid = Solid::shaped(&surface, Stock::of_thickness(10.0), shape).unwrap();
            let shell = Shell::new(&solid, Nets { exit: &ControlNet::fitted(&surface, (6, 7)), entry: None });
            assert_eq!((shell.faces.len(), shell.edges.len()), (faces, edges), "{rim:?}");
            examine(&shell);
        }
    }

    #[test]
    fn walls_of_other_outlines_are_pieces_of_cylinders_and_planes() {
        let extent = Extent::new(20.0, 30.0);
        let heights = Field::from_fn(41, 61, |i, j| 0.01 * (0.1 * (i * i) as f64).sin() + 0.002 * j as f64);
        let raised = Some(Rim { width_mm: 4.0, rise_mm: 0.5, mark_mm: None });
        let flange = Some(Rim { width_mm: 4.0, rise_mm: -2.0, mark_mm: Some(2.0) });
        for (outline, rim, faces, edges) in [
            (Outline::Circle, None, 6, 12),
            (Outline::Rounded { radius_mm: 4.0 }, None, 10, 24),
            (Outline::Rounded { radius_mm: 10.0 }, None, 8, 18),
            (Outline::Circle, raised, 11, 24),
            (Outline::Circle, flange, 13, 30),
            (Outline::Rounded { radius_mm: 4.0 }, raised, 19, 48),
            (Outline::Rounded { radius_mm: 4.0 }, flange, 21, 54),
        ] {
            let surface = HeightField::outlined(extent, outline, heights.clone());
            let shape = Shape { origin: Origin::Corner, rim, ..Shape::default() };
            let solid = Solid::shaped(&surface, Stock::of_thickness(10.0), shape).unwrap();
            let shell = Shell::new(&solid, Nets { exit: &ControlNet::interpolating(&surface), entry: None });
            assert_eq!((shell.faces.len(), shell.edges.len()), (faces, edges), "{outline:?} {rim:?}");
            examine(&shell);
        }
    }
}
