//! The topology of the block as a CAD kernel has it: vertices, edges that two faces share, faces with their loops.

use crate::{solid::Solid, surface::ControlNet};
use glam::{DVec2, DVec3};

/// An edge between two vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Edge {
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) curve: Curve,
}

/// The curve of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Curve {
    Line,
    /// The border of the exit face: south, east, north, west from 0 to 3, along +x or +y.
    Border(usize),
}

/// What a face lies in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Surface {
    Net,
    /// Through `at`, with this outward normal.
    Plane {
        at: DVec3,
        normal: DVec3,
    },
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
    /// The shell of a block whose exit face is `net`, in the coordinates of its files.
    pub(super) fn new(solid: &Solid, net: &ControlNet) -> Self {
        let mut shell = Self::default();
        let (right, top) = (net.points().0 - 1, net.points().1 - 1);
        let half = 0.5 * net.extent().as_vec();
        // Corners of the exit face, counter-clockwise from the least x and y.
        let around = [(-half.x, -half.y), (half.x, -half.y), (half.x, half.y), (-half.x, half.y)];
        let heights = [(0, 0), (right, 0), (right, top), (0, top)].map(|at| net.heights_mm()[at]);
        let place = |at: DVec2, z: f64| at.extend(z) - solid.origin_mm();
        let exit: Vec<usize> = (0..4).map(|k| shell.vertex(place(DVec2::from(around[k]), heights[k]))).collect();
        for (k, (from, to)) in [(0, 1), (1, 2), (3, 2), (0, 3)].into_iter().enumerate() {
            shell.edges.push(Edge { from: exit[from], to: exit[to], curve: Curve::Border(k) });
        }
        shell.face(Surface::Net, &[&exit]);
        let outline = solid.shape().outline(net.extent());
        let ring = |shell: &mut Self, z: f64, corners: &[DVec2]| -> Vec<usize> {
            corners.iter().map(|&at| shell.vertex(place(at, z))).collect()
        };
        let lower = ring(&mut shell, solid.entry_z_mm(), &outline);
        let reversed: Vec<usize> = lower.iter().rev().copied().collect();
        shell.plane(DVec3::NEG_Z, &[&reversed]);
        match solid.rim_z_mm() {
            None => shell.walls(&exit, &lower),
            Some(rim_z) => {
                let upper = ring(&mut shell, rim_z, &outline);
                let inner = ring(&mut shell, rim_z, &around.map(DVec2::from));
                let hole: Vec<usize> = inner.iter().rev().copied().collect();
                shell.plane(DVec3::Z, &[&upper, &hole]);
                shell.walls(&upper, &lower);
                // Below the exit face its walls face outwards, above it inwards.
                if rim_z < heights[0] {
                    shell.walls(&exit, &inner);
                } else {
                    let turned = |ring: &[usize]| -> Vec<usize> { ring.iter().rev().copied().collect() };
                    shell.walls(&turned(&inner), &turned(&exit));
                }
            }
        }
        shell
    }

    fn vertex(&mut self, at: DVec3) -> usize {
        self.vertices.push(at);
        self.vertices.len() - 1
    }

    /// Upright planes between two rings of as many vertices. The glass is to the left of those who walk along them.
    fn walls(&mut self, upper: &[usize], lower: &[usize]) {
        for k in 0..upper.len() {
            let next = (k + 1) % upper.len();
            let along = (self.vertices[upper[next]] - self.vertices[upper[k]]).truncate();
            let outwards = -along.perp().normalize().extend(0.0);
            self.plane(outwards, &[&[lower[k], lower[next], upper[next], upper[k]]]);
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

    /// The edge between two vertices, which a neighbour may have made already.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        grid::{Extent, Field},
        solid::{Origin, Rim, Shape, Stock},
        surface::HeightField,
    };

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
            let shell = Shell::new(&solid, &ControlNet::fitted(&surface, (6, 7)));
            assert_eq!((shell.faces.len(), shell.edges.len()), (faces, edges), "{rim:?}");
            for k in 0..edges {
                let uses: Vec<Sense> = shell
                    .faces
                    .iter()
                    .flat_map(|f| f.loops.iter().flatten())
                    .filter(|u| u.0 == k)
                    .map(|u| u.1)
                    .collect();
                assert!(uses == [Sense::Forwards, Sense::Backwards] || uses == [Sense::Backwards, Sense::Forwards]);
            }
            // Euler and Poincaré for genus 0: one ring more for every hole.
            let holes: usize = shell.faces.iter().map(|f| f.loops.len() - 1).sum();
            assert_eq!(shell.vertices.len() + faces, edges + 2 + holes);
            // Every plane's loops lie in it, and turn around its normal.
            for face in &shell.faces {
                let Surface::Plane { at, normal } = face.surface else { continue };
                let ends = |&(k, sense): &(usize, Sense)| {
                    let edge = shell.edges[k];
                    if sense == Sense::Forwards { [edge.from, edge.to] } else { [edge.to, edge.from] }
                };
                for (n, around) in face.loops.iter().enumerate() {
                    let mut area = DVec3::ZERO;
                    for [a, b] in around.iter().map(ends) {
                        let (a, b) = (shell.vertices[a], shell.vertices[b]);
                        assert!((a - at).dot(normal).abs() < 1e-12);
                        area += 0.5 * (a - at).cross(b - at);
                    }
                    assert!(if n == 0 { area.dot(normal) > 1.0 } else { area.dot(normal) < -1.0 }, "{face:?}");
                }
            }
        }
    }
}
