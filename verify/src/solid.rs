//! Whether a mesh is the surface of a solid: closed, oriented, of positive volume.

use crate::mesh::Mesh;
use glam::DVec3;
use std::fmt;

/// What was found in a mesh. [`Soundness::is_sound`] sums it up.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Soundness {
    /// Number of triangles.
    pub triangles: usize,
    /// Number of distinct vertices that triangles use.
    pub vertices: usize,
    /// Edges with a triangle on one side only: holes.
    pub open_edges: usize,
    /// Edges with more than two triangles.
    pub crowded_edges: usize,
    /// Edges whose two triangles face opposite sides: flipped triangles.
    pub flipped_edges: usize,
    /// Triangles without area.
    pub degenerate_triangles: usize,
    /// Enclosed volume, mm³; negative if all triangles face inwards. Meaningful for a closed mesh.
    pub volume_mm3: f64,
    /// Least corner of the bounding box, mm.
    pub lower_mm: DVec3,
    /// Greatest corner of the bounding box, mm.
    pub upper_mm: DVec3,
}

impl Soundness {
    /// Closed, oriented outwards, nothing degenerate: light can be traced through it.
    pub fn is_sound(&self) -> bool {
        self.is_closed() && self.flipped_edges == 0 && self.degenerate_triangles == 0 && self.volume_mm3 > 0.0
    }

    /// Sound, but that all triangles face inwards.
    pub fn is_inside_out(&self) -> bool {
        Self { volume_mm3: -self.volume_mm3, ..*self }.is_sound()
    }

    /// Every edge has exactly two triangles.
    pub fn is_closed(&self) -> bool {
        self.triangles > 0 && self.open_edges == 0 && self.crowded_edges == 0
    }
}

impl fmt::Display for Soundness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut faults = Vec::new();
        if self.triangles == 0 {
            faults.push("it has no triangles".to_owned());
        }
        if self.open_edges > 0 {
            faults.push(format!("{} open edges (triangles are missing)", self.open_edges));
        }
        if self.crowded_edges > 0 {
            faults.push(format!("{} edges with more than two triangles", self.crowded_edges));
        }
        if self.flipped_edges > 0 {
            faults.push(format!(
                "{} edges between triangles of opposite orientation (flipped triangles)",
                self.flipped_edges
            ));
        }
        if self.degenerate_triangles > 0 {
            faults.push(format!("{} triangles without area", self.degenerate_triangles));
        }
        if self.is_closed() && self.volume_mm3 <= 0.0 {
            faults.push(format!("it is inside out (volume {:.3} mm3)", self.volume_mm3));
        }
        if faults.is_empty() {
            faults.push(format!("closed and oriented, {:.3} mm3", self.volume_mm3));
        }
        f.write_str(&faults.join("; "))
    }
}

/// Examines a mesh. Takes time and memory proportional to its size.
pub fn check(mesh: &Mesh) -> Soundness {
    let (open_edges, crowded_edges, flipped_edges) = edges(mesh);
    let degenerate_triangles = (0..mesh.triangles.len())
        .filter(|&k| {
            let [a, b, c] = mesh.triangles[k];
            let [pa, pb, pc] = mesh.corners(k);
            a == b || b == c || c == a || (pb - pa).cross(pc - pa).length_squared() == 0.0
        })
        .count();
    let mut used = vec![false; mesh.vertices.len()];
    mesh.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
    let (lower_mm, upper_mm) = mesh.bounds();
    Soundness {
        triangles: mesh.triangles.len(),
        vertices: used.iter().filter(|&&u| u).count(),
        open_edges,
        crowded_edges,
        flipped_edges,
        degenerate_triangles,
        volume_mm3: mesh.volume_mm3(),
        lower_mm,
        upper_mm,
    }
}

/// Counts open, crowded and flipped edges.
fn edges(mesh: &Mesh) -> (usize, usize, usize) {
    // Every directed edge is filed under its lesser vertex: the greater one and a bit for the
    // direction.
    let directed = || mesh.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let mut begin = vec![0usize; mesh.vertices.len() + 1];
    directed().for_each(|(a, b)| begin[a.min(b) as usize + 1] += 1);
    for v in 0..mesh.vertices.len() {
        begin[v + 1] += begin[v];
    }
    let mut next = begin.clone();
    let mut filed = vec![0u64; 3 * mesh.triangles.len()];
    for (a, b) in directed() {
        let slot = &mut next[a.min(b) as usize];
        filed[*slot] = u64::from(a.max(b)) << 1 | u64::from(a > b);
        *slot += 1;
    }
    let (mut open, mut crowded, mut flipped) = (0, 0, 0);
    for v in 0..mesh.vertices.len() {
        let star = &mut filed[begin[v]..begin[v + 1]];
        star.sort_unstable();
        for same in star.chunk_by(|a, b| a >> 1 == b >> 1) {
            match same {
                [_] => open += 1,
                [a, b] if a != b => {}
                [_, _] => flipped += 1,
                _ => crowded += 1,
            }
        }
    }
    (open, crowded, flipped)
}
