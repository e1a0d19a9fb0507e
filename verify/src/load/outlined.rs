//! A height map whose block is no rectangle: its nodes within the outline, and a ring of triangles
//! between them and the curve.

use crate::{mesh::Mesh, spline::Bicubic};
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// Nodes nearer to the outline than this part of their spacing are left out.
const LEAST_DISTANCE: f64 = 0.25;

/// A rectangle centred on the axis whose corners are quarters of ellipses.
#[derive(Clone, Copy, Debug)]
pub(super) struct Curve {
    /// Half of the rectangle, mm.
    pub(super) half: DVec2,
    /// Semi-axes of the corners, mm.
    pub(super) radius: DVec2,
}

impl Curve {
    fn contains(&self, at: DVec2) -> bool {
        let beyond = at.abs() - (self.half - self.radius);
        let corner = beyond.cmpgt(DVec2::ZERO).all();
        if corner { (beyond / self.radius).length_squared() <= 1.0 } else { beyond.cmple(self.radius).all() }
    }

    /// The point of the curve straight out from a point within: from a side, or from the centre of
    /// a corner.
    fn foot(&self, at: DVec2) -> DVec2 {
        let core = self.half - self.radius;
        let centre = at.clamp(-core, core);
        let out = at - centre;
        if out.cmpne(DVec2::ZERO).all() {
            return centre + out / (out / self.radius).length();
        }
        let to_side = self.half - at.abs();
        if out.x != 0.0 || (out.y == 0.0 && to_side.x < to_side.y) {
            DVec2::new(self.half.x.copysign(at.x), at.y)
        } else {
            DVec2::new(at.x, self.half.y.copysign(at.y))
        }
    }
}

/// The block under heights (mm, rows along `+y`) within a curve. `None` if no cell is.
pub(super) fn block(heights: &[f64], (nx, ny): (usize, usize), curve: Curve, entry_z: f64) -> Option<Mesh> {
    let half = curve.half;
    let spacing = 2.0 * half / DVec2::new((nx - 1) as f64, (ny - 1) as f64);
    let place = |k: usize| DVec2::new((k % nx) as f64, (k / nx) as f64) * spacing - half;
    let margin = LEAST_DISTANCE * spacing.min_element();
    let inner = Curve { half: half - margin, radius: (curve.radius - margin).max(DVec2::splat(1e-12)) };
    let kept: Vec<bool> = (0..nx * ny).map(|k| inner.contains(place(k))).collect();
    let corners = |i: usize, j: usize| [j * nx + i, j * nx + i + 1, (j + 1) * nx + i + 1, (j + 1) * nx + i];
    let is_cell = |i: usize, j: usize| i + 1 < nx && j + 1 < ny && corners(i, j).iter().all(|&k| kept[k]);
    let cells: Vec<[usize; 4]> = (0..ny - 1)
        .flat_map(|j| (0..nx - 1).map(move |i| (i, j)))
        .filter(|&(i, j)| is_cell(i, j))
        .map(|(i, j)| corners(i, j))
        .collect();
    let mut number = vec![u32::MAX; nx * ny];
    cells.iter().flatten().for_each(|&node| number[node] = 0);
    let mut mesh = Mesh::default();
    for node in (0..nx * ny).filter(|&node| number[node] == 0).collect::<Vec<_>>() {
        number[node] = mesh.vertices.len() as u32;
        mesh.vertices.push(place(node).extend(heights[node]));
    }
    // From every node around the whole cells to the next, counter-clockwise.
    let mut next = BTreeMap::new();
    for &nodes in &cells {
        let [a, b, c, d] = nodes.map(|node| number[node]);
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
        let (i, j) = (nodes[0] % nx, nodes[0] / nx);
        let beside = [(i, j.wrapping_sub(1)), (i + 1, j), (i, j + 1), (i.wrapping_sub(1), j)];
        for (side, (i, j)) in beside.into_iter().enumerate() {
            if i == usize::MAX || j == usize::MAX || !is_cell(i, j) {
                next.insert(nodes[side], nodes[(side + 1) % 4]);
            }
        }
    }
    let (&first, _) = next.first_key_value()?;
    let mut around = vec![first];
    while let Some(&following) = next.get(&around[around.len() - 1]).filter(|&&node| node != first) {
        if around.len() > next.len() {
            return None;
        }
        around.push(following);
    }
    let spline = Bicubic::through(heights, nx, ny, (-half).to_array(), half.to_array());
    let begin = mesh.vertices.len() as u32;
    let mut outer: Vec<u32> = Vec::with_capacity(around.len());
    for &node in &around {
        let foot = curve.foot(place(node));
        // On the way straight away from the curve neighbours have the same foot.
        let same = |v: &u32| mesh.vertices[*v as usize].truncate().distance(foot) < 1e-9 * half.max_element();
        let known = [outer.last(), outer.first()].into_iter().flatten().copied().find(same);
        outer.push(known.unwrap_or(mesh.vertices.len() as u32));
        if known.is_none() {
            mesh.vertices.push(foot.extend(spline.jet(foot.x, foot.y).z));
        }
    }
    let plan = |[a, b, c]: [u32; 3]| {
        let [a, b, c] = [a, b, c].map(|v| mesh.vertices[v as usize].truncate());
        (b - a).perp_dot(c - a)
    };
    let mut ring = Vec::with_capacity(2 * around.len());
    for k in 0..around.len() {
        let following = (k + 1) % around.len();
        let (a, b, c, d) = (number[around[k]], outer[k], outer[following], number[around[following]]);
        if b == c {
            ring.push([a, c, d]);
            continue;
        }
        // Across the corner that leaves the larger triangles.
        let cuts = [[[a, b, c], [a, c, d]], [[a, b, d], [b, c, d]]];
        let least = cuts.map(|[one, other]| plan(one).min(plan(other)));
        ring.extend(cuts[usize::from(least[1] > least[0])]);
    }
    mesh.triangles.extend(ring);
    let (count, below) = (mesh.vertices.len() as u32 - begin, mesh.vertices.len() as u32);
    let floor: Vec<DVec3> = mesh.vertices[begin as usize..].iter().map(|p| p.truncate().extend(entry_z)).collect();
    mesh.vertices.extend(floor);
    mesh.vertices.push(DVec3::new(0.0, 0.0, entry_z));
    for k in 0..count {
        let (a, b, next) = (begin + k, below + k, (k + 1) % count);
        let (c, d) = (below + next, begin + next);
        mesh.triangles.extend([[b, c, d], [b, d, a], [below + count, c, b]]);
    }
    Some(mesh)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::at_worst;
    use crate::{block::Block, solid};

    #[test]
    fn blocks_within_curves_are_sound_and_known_with_their_face() {
        let f = |p: DVec2| 0.3 * (0.2 * p.x).sin() * (0.15 * p.y + 0.3).cos();
        for (half, radius) in [
            (DVec2::new(20.0, 20.0), DVec2::new(20.0, 20.0)),
            (DVec2::new(30.0, 15.0), DVec2::new(30.0, 15.0)),
            (DVec2::new(20.0, 15.0), DVec2::splat(6.0)),
            (DVec2::new(20.0, 15.0), DVec2::splat(0.3)),
        ] {
            for (nx, ny) in [(41, 31), (64, 51), (121, 100)] {
                let size = DVec2::new((nx - 1) as f64, (ny - 1) as f64);
                let place = |k: usize| DVec2::new((k % nx) as f64, (k / nx) as f64) / size * 2.0 * half - half;
                let heights: Vec<f64> = (0..nx * ny).map(|k| f(place(k))).collect();
                let mesh = block(&heights, (nx, ny), Curve { half, radius }, -5.0).unwrap();
                let report = solid::check(&mesh);
                assert!(report.is_sound(), "{half} {radius} {nx} x {ny}: {report}");
                let block = Block::from_mesh(&mesh).unwrap();
                assert!(!block.is_rectangular());
                assert_eq!(block.nodes(), (nx, ny), "{half} {radius}");
                for point in block.outline().unwrap() {
                    at_worst(3.7e-5, (point.z - f(point.truncate())).abs(), point);
                }
            }
        }
    }
}
