//! The edges and faces of a solid, sampled.

use super::{
    conic::Conic,
    fault::malformed,
    part21::{Entities, Value},
    values::{GAP_MM, degree, knots, odd, reference, references, truth},
};
use crate::{
    load::{assemble::Allowance, error::LoadError, plane},
    mesh::TrimmedFace,
};
use glam::{DMat3, DVec3};
use std::collections::HashMap;

/// How near the chords between samples of a curve are to it, seen from above, mm, and the most of
/// them to a span.
const SAGITTA_MM: f64 = 1e-5;
const MOST_PIECES: f64 = 256.0;
/// A solid while it is read.
pub(super) struct SolidBuilder<'a> {
    pub(super) entities: Entities<'a>,
    pub(super) scale: f64,
    /// Turns what is read.
    pub(super) turn: DMat3,
    pub(super) allowance: Allowance,
    pub(super) vertices: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Vertex of every VERTEX_POINT, vertices along every EDGE_CURVE.
    pub(super) corners: HashMap<u64, u32>,
    pub(super) edges: HashMap<u64, Vec<u32>>,
    /// B-spline faces towards the receiver that their edges trim.
    pub(super) trimmed: Vec<TrimmedFace>,
    /// Level planes that face the receiver, mm.
    pub(super) levels: Vec<f64>,
}

impl SolidBuilder<'_> {
    fn triple(&self, number: u64, kind: &str) -> Result<DVec3, LoadError> {
        let values = self.entities.expect(number, kind)?;
        match values.get(1).and_then(Value::numbers).as_deref() {
            Some(&[x, y, z]) if [x, y, z].iter().all(|v| v.is_finite()) => Ok(DVec3::new(x, y, z)),
            _ => Err(odd(number)),
        }
    }

    pub(super) fn point(&self, number: u64) -> Result<DVec3, LoadError> {
        Ok(self.turn * (self.scale * self.triple(number, "CARTESIAN_POINT")?))
    }

    pub(super) fn direction(&self, number: u64) -> Result<DVec3, LoadError> {
        Ok(self.turn * self.triple(number, "DIRECTION")?)
    }

    /// The axes of a placement.
    pub(super) fn frame(&self, number: u64) -> Result<DMat3, LoadError> {
        let axes = self.entities.expect(number, "AXIS2_PLACEMENT_3D")?;
        let direction = |at: usize, default: DVec3| match axes.get(at) {
            None | Some(Value::Nothing) => Ok(self.turn * default),
            Some(value) => self.direction(value.reference().ok_or_else(|| odd(number))?),
        };
        let frame = direction(2, DVec3::Z)?.try_normalize().zip(Some(direction(3, DVec3::X)?)).and_then(|(z, x)| {
            let x = (x - x.dot(z) * z).try_normalize()?;
            Some(DMat3::from_cols(x, z.cross(x), z))
        });
        frame.ok_or_else(|| malformed(format!("the axes of #{number} are no frame")))
    }

    pub(super) fn vertex(&mut self, at: DVec3) -> Result<u32, LoadError> {
        let index = u32::try_from(self.vertices.len()).map_err(|_| LoadError::TooLarge)?;
        self.vertices.push(at);
        Ok(index)
    }

    pub(super) fn corner(&mut self, number: u64) -> Result<u32, LoadError> {
        if let Some(&vertex) = self.corners.get(&number) {
            return Ok(vertex);
        }
        let point = reference(&self.entities.expect(number, "VERTEX_POINT")?, 1, number)?;
        let vertex = self.vertex(self.point(point)?)?;
        self.corners.insert(number, vertex);
        Ok(vertex)
    }

    /// Vertices along an edge, from its first to its last.
    pub(super) fn edge(&mut self, number: u64) -> Result<Vec<u32>, LoadError> {
        if let Some(along) = self.edges.get(&number) {
            return Ok(along.clone());
        }
        let values = self.entities.expect(number, "EDGE_CURVE")?;
        let (from, to) = (self.corner(reference(&values, 1, number)?)?, self.corner(reference(&values, 2, number)?)?);
        let forwards = truth(&values, 4, number)?;
        let (begin, end) = if forwards { (from, to) } else { (to, from) };
        let ends = [begin, end].map(|v| self.vertices[v as usize]);
        let mut inner = self.curve(reference(&values, 3, number)?, ends)?;
        if !forwards {
            inner.reverse();
        }
        if let [first, .., last] = inner[..] {
            let gap = first.distance(self.vertices[from as usize]).max(last.distance(self.vertices[to as usize]));
            if gap > GAP_MM {
                return Err(malformed(format!("the curve of #{number} ends {gap:.1e} mm from its vertices")));
            }
        }
        let mut along = vec![from];
        for &at in inner.get(1..inner.len().saturating_sub(1)).unwrap_or_default() {
            along.push(self.vertex(at)?);
        }
        along.push(to);
        self.edges.insert(number, along.clone());
        Ok(along)
    }

    /// Samples of a curve from end to end, which vertices cut out of a circle; none of a line.
    pub(super) fn curve(&mut self, number: u64, ends: [DVec3; 2]) -> Result<Vec<DVec3>, LoadError> {
        let (kind, values) = self.entities.get(number)?;
        match kind {
            "LINE" => Ok(Vec::new()),
            // A curve with its images in the surfaces: once, or it could refer to itself.
            "SURFACE_CURVE" | "SEAM_CURVE" => {
                let inner = reference(&values, 1, number)?;
                match self.entities.get(inner)?.0 {
                    "SURFACE_CURVE" | "SEAM_CURVE" => Err(odd(number)),
                    _ => self.curve(inner, ends),
                }
            }
            "B_SPLINE_CURVE_WITH_KNOTS" => {
                let degree = degree(&values, 1, number)?;
                let points = references(&values, 2, number)?;
                let knots = knots(degree, &values, (6, 7), points.len(), number)?;
                let points: Vec<DVec3> = points.into_iter().map(|p| self.point(p)).collect::<Result<_, _>>()?;
                let at = |place: f64| -> DVec3 {
                    let (first, weights) = knots.weights(place);
                    (0..=degree).map(|l| weights[l] * points[first + l]).sum()
                };
                let places = knots.places();
                self.allowance.take(places.len(), "STEP")?;
                let mut samples = vec![at(places[0])];
                for pair in places.windows(2) {
                    let (begin, end) = (samples[samples.len() - 1], at(pair[1]));
                    // Seen from above, chords stay near the curve; a side of a rectangle is one.
                    let middle = at(0.5 * (pair[0] + pair[1]));
                    let sagitta = (middle - 0.5 * (begin + end)).truncate().length();
                    let pieces = (sagitta / SAGITTA_MM).sqrt().ceil().clamp(1.0, MOST_PIECES);
                    self.allowance.take(pieces as usize - 1, "STEP")?;
                    let between = (1..pieces as usize).map(|k| at(pair[0] + (pair[1] - pair[0]) * k as f64 / pieces));
                    samples.extend(between.chain([end]));
                }
                Ok(samples)
            }
            "CIRCLE" | "ELLIPSE" => {
                let conic = self.conic(kind, &values, number)?;
                self.allowance.take(Conic::MOST, "STEP")?;
                Ok(conic.samples(ends[0], ends[1]))
            }
            other => Err(malformed(format!("#{number} is a curve of a kind that is not understood: {other}"))),
        }
    }

    pub(super) fn face(&mut self, number: u64) -> Result<(), LoadError> {
        let values = self.entities.expect(number, "ADVANCED_FACE")?;
        let surface = reference(&values, 2, number)?;
        let same_sense = truth(&values, 3, number)?;
        let mut loops = Vec::new();
        for bound in references(&values, 1, number)? {
            let (kind, values) = self.entities.get(bound)?;
            let around = self.around(reference(&values, 1, bound)?)?;
            let turned = !truth(&values, 2, bound)?;
            let around = if turned { around.into_iter().rev().collect() } else { around };
            // The outer loop goes first.
            loops.insert(if kind == "FACE_OUTER_BOUND" { 0 } else { loops.len() }, around);
        }
        let (kind, values) = self.entities.get(surface)?;
        match kind {
            "PLANE" => self.plane(&loops, number),
            "B_SPLINE_SURFACE_WITH_KNOTS" => match &loops[..] {
                [around] => self.net(&values, surface, around, same_sense),
                _ => Err(malformed(format!("the B-spline face #{number} has not exactly one loop"))),
            },
            "CYLINDRICAL_SURFACE" | "SURFACE_OF_LINEAR_EXTRUSION" => {
                let conic = self.wall(kind, &values, surface)?;
                self.unroll(&conic, &loops, number)
            }
            other => Err(malformed(format!("#{surface} is a surface of a kind that is not understood: {other}"))),
        }
    }

    /// Vertices once around a loop, each once.
    pub(super) fn around(&mut self, number: u64) -> Result<Vec<u32>, LoadError> {
        let mut around = Vec::new();
        let oriented = references(&self.entities.expect(number, "EDGE_LOOP")?, 1, number)?;
        for edge in oriented {
            let values = self.entities.expect(edge, "ORIENTED_EDGE")?;
            let mut along = self.edge(reference(&values, 3, edge)?)?;
            // An edge may be named any number of times.
            self.allowance.take(along.len(), "STEP")?;
            if !truth(&values, 4, edge)? {
                along.reverse();
            }
            match around.last() {
                Some(last) if along.first() != Some(last) => {
                    return Err(malformed(format!("the edges of loop #{number} do not join")));
                }
                Some(_) => around.extend(&along[1..]),
                None => around = along,
            }
        }
        let closed = around.len() > 3 && around.first() == around.last();
        around.pop();
        if closed { Ok(around) } else { Err(malformed(format!("loop #{number} is not closed"))) }
    }

    pub(super) fn plane(&mut self, loops: &[Vec<u32>], number: u64) -> Result<(), LoadError> {
        let triangles = plane::triangles(&self.vertices, loops)
            .ok_or_else(|| malformed(format!("the loops of face #{number} bound no plane area")))?;
        let heights = || loops.iter().flatten().map(|&v| self.vertices[v as usize].z);
        let (low, high) = (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
        let faces_up = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| self.vertices[v as usize]);
            (b - a).cross(c - a).z > 0.0
        };
        if high - low <= GAP_MM && triangles.first().is_some_and(faces_up) {
            self.levels.push(low);
        }
        self.triangles.extend(triangles);
        Ok(())
    }
}
