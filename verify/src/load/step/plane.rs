//! Cutting plane faces into triangles.

use glam::{DVec2, DVec3};

/// Triangles of a plane face that use every vertex of its loops, the outer one first and anticlockwise around the outward
/// normal. `None` if it has no area.
pub(super) fn triangles(vertices: &[DVec3], loops: &[Vec<u32>]) -> Option<Vec<[u32; 3]>> {
    let outer = loops.first()?;
    let at = |v: u32| vertices[v as usize];
    let origin = at(outer[0]);
    // Newell's normal: twice the area.
    let normal: DVec3 =
        (0..outer.len()).map(|k| (at(outer[k]) - origin).cross(at(outer[(k + 1) % outer.len()]) - origin)).sum();
    let normal = normal.try_normalize()?;
    let along = normal.any_orthonormal_vector();
    // Upright planes are looked at with the horizon level, so that walls are monotone along it.
    let along = if normal.z.abs() < 1e-9 { DVec3::Z.cross(normal).normalize() } else { along };
    let up = normal.cross(along);
    let flat = |v: u32| DVec2::new((at(v) - origin).dot(along), (at(v) - origin).dot(up));
    if loops.len() == 1 {
        let points: Vec<DVec2> = outer.iter().map(|&v| flat(v)).collect();
        if let Some(cut) = monotone(&points) {
            return Some(cut.into_iter().map(|t| t.map(|k| outer[k])).collect());
        }
    }
    let all: Vec<u32> = loops.concat();
    let points = all.iter().map(|&v| flat(v).to_array());
    let mut holes: Vec<usize> = Vec::new();
    loops[..loops.len() - 1].iter().fold(0, |start, around| {
        holes.push(start + around.len());
        start + around.len()
    });
    let mut cut: Vec<usize> = Vec::new();
    earcut::Earcut::new().earcut(points, &holes, &mut cut);
    let (triples, _) = cut.as_chunks::<3>();
    Some(
        triples
            .iter()
            .map(|&[a, b, c]| {
                let [p, q, r] = [a, b, c].map(|k| flat(all[k]));
                let [a, b, c] = [a, b, c].map(|k| all[k]);
                if (q - p).perp_dot(r - p) > 0.0 { [a, b, c] } else { [a, c, b] }
            })
            .collect(),
    )
}

/// Cuts an anticlockwise polygon whose border goes once from its least to its greatest x and once back; `None` for another.
/// Vertices on straight borders are used too, which general algorithms pass over.
fn monotone(points: &[DVec2]) -> Option<Vec<[usize; 3]>> {
    let n = points.len();
    // A total order: along x, and on an upright border from below.
    let order = |a: usize, b: usize| points[a].x.total_cmp(&points[b].x).then(points[a].y.total_cmp(&points[b].y));
    let first = (0..n).min_by(|&a, &b| order(a, b))?;
    let last = (0..n).max_by(|&a, &b| order(a, b))?;
    let lower: Vec<usize> = chain(first, last, n, |k| (k + 1) % n);
    let upper: Vec<usize> = chain(first, last, n, |k| (k + n - 1) % n);
    let rises = |chain: &[usize]| chain.windows(2).all(|pair| order(pair[0], pair[1]).is_lt());
    if !rises(&lower) || !rises(&upper) {
        return None;
    }
    let mut sorted: Vec<(usize, bool)> = lower[1..].iter().map(|&k| (k, false)).collect();
    sorted.extend(upper[1..upper.len() - 1].iter().map(|&k| (k, true)));
    sorted.sort_by(|a, b| order(a.0, b.0));
    let area = |a: usize, b: usize, c: usize| (points[b] - points[a]).perp_dot(points[c] - points[a]);
    let mut triangles = Vec::with_capacity(n - 2);
    let mut stack: Vec<(usize, bool)> = vec![(first, sorted[0].1), sorted[0]];
    for (index, &(k, above)) in sorted.iter().enumerate().skip(1) {
        let ends = index + 1 == sorted.len();
        let top = stack[stack.len() - 1];
        if ends || top.1 != above {
            // It sees the whole stack, which lies on the other side.
            let other = if ends { top.1 } else { !above };
            for pair in stack.windows(2) {
                let (a, b) = (pair[0].0, pair[1].0);
                triangles.push(if other { [k, b, a] } else { [a, b, k] });
            }
            stack = vec![top, (k, above)];
        } else {
            while let [.., (a, _), (b, _)] = stack[..] {
                let turn = if above { area(k, b, a) } else { area(a, b, k) };
                if turn <= 0.0 {
                    break;
                }
                triangles.push(if above { [k, b, a] } else { [a, b, k] });
                stack.pop();
            }
            stack.push((k, above));
        }
    }
    Some(triangles)
}

fn chain(first: usize, last: usize, n: usize, step: impl Fn(usize) -> usize) -> Vec<usize> {
    let mut chain = vec![first];
    let mut at = first;
    while at != last && chain.len() <= n {
        at = step(at);
        chain.push(at);
    }
    chain
}

#[cfg(test)]
mod tests {
    use super::*;

    fn areas(vertices: &[DVec3], loops: &[Vec<u32>], normal: DVec3) -> (usize, f64) {
        let cut = triangles(vertices, loops).unwrap();
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| vertices[v as usize]);
            let area = 0.5 * (b - a).cross(c - a).dot(normal);
            assert!(area > 0.0, "{t:?} has the area {area}");
            area
        };
        (cut.len(), cut.iter().map(area).sum())
    }

    #[test]
    fn a_wall_under_a_curve_uses_every_vertex_even_on_a_straight_border() {
        for height in
            [|_: f64| 2.0, |x: f64| 2.0 + (9.0 * x).sin(), |x: f64| 0.1 + 3.0 * x * x, |x: f64| 3.1 - 3.0 * x * x]
        {
            let n = 60u32;
            let mut vertices = vec![DVec3::new(0.0, 5.0, 0.0), DVec3::new(1.0, 5.0, 0.0)];
            let x = |k: u32| f64::from(k) / f64::from(n);
            vertices.extend((0..=n).map(|k| DVec3::new(x(k), 5.0, height(x(k)))));
            // Seen from -y, left to right, and back along the top.
            let mut around = vec![0, 1];
            around.extend((2..n + 3).rev());
            let (count, area) = areas(&vertices, &[around], DVec3::NEG_Y);
            let wanted: f64 = (0..n).map(|k| 0.5 * (height(x(k)) + height(x(k + 1))) / f64::from(n)).sum();
            assert_eq!(count, n as usize + 1);
            assert!((area - wanted).abs() < 1e-12);
        }
    }

    #[test]
    fn a_plane_with_a_hole_is_cut() {
        let square = |r: f64| [(-r, -r), (r, -r), (r, r), (-r, r)].map(|(x, y)| DVec3::new(x, y, 1.0));
        let vertices = [square(2.0), square(1.0)].concat();
        assert_eq!(areas(&vertices, &[vec![0, 1, 2, 3], vec![7, 6, 5, 4]], DVec3::Z), (8, 12.0));
    }
}
