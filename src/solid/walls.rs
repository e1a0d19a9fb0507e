//! Triangle strips between the border of the exit face and the coarser border of the entry face.

/// Triangles between an upper and a lower polyline over the same span, counter-clockwise for a
/// viewer who sees both run from left to right. `upper` and `lower` give the vertex of each
/// position; both are evenly spaced, and `upper` has at least as many as `lower`.
///
/// Every upper segment is joined to the lower vertex nearest to its middle.
pub(super) fn strip(upper: &[u32], lower: &[u32]) -> Vec<[u32; 3]> {
    let (n, m) = (upper.len() - 1, lower.len() - 1);
    let mut triangles = Vec::with_capacity(n + m);
    let mut at = 0;
    for k in 0..n {
        // The lower vertex nearest to (k + 1/2) / n, in integers; a tie goes to the left one.
        let nearest = ((2 * k + 1) * m + n - 1) / (2 * n);
        while at < nearest {
            triangles.push([lower[at], lower[at + 1], upper[k]]);
            at += 1;
        }
        triangles.push([upper[k], lower[at], upper[k + 1]]);
    }
    while at < m {
        triangles.push([lower[at], lower[at + 1], upper[n]]);
        at += 1;
    }
    triangles
}

/// How many equal cells the entry face gets along a side of `size_mm`, under exit borders given by
/// their heights above the entry face, mm.
///
/// Cells about as wide as the wall is high make the largest well-shaped triangles. No wall triangle
/// may turn over where the exit border is steep: the lower vertex of a segment lies at most `cell /
/// 2 + step / 2` beside its middle, so that the segment is seen from below if its slope times that
/// distance stays below its height.
pub(super) fn entry_cells<'a>(size_mm: f64, borders: impl IntoIterator<Item = &'a [f32]>) -> usize {
    let (mut lowest, mut steepest, mut segments) = (f64::INFINITY, 0.0_f64, 1);
    for border in borders {
        segments = border.len() - 1;
        for pair in border.windows(2) {
            lowest = lowest.min(f64::from(pair[0].min(pair[1])));
            steepest = steepest.max((f64::from(pair[1]) - f64::from(pair[0])).abs());
        }
    }
    let step = size_mm / segments as f64;
    let cell = lowest / (steepest / step).max(1.0);
    // With one entry vertex per node the walls are plain quads and cannot turn over, however steep
    // the border is.
    if cell < 4.0 * step { segments } else { (size_mm / cell).ceil() as usize }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_strip_uses_every_segment_once_and_never_turns_over() {
        for (n, m) in [(1, 1), (2, 1), (3, 3), (5, 2), (40, 7), (64, 64), (101, 10)] {
            let upper: Vec<u32> = (0..=n).collect();
            let lower: Vec<u32> = (1000..=1000 + m).collect();
            let triangles = strip(&upper, &lower);
            assert_eq!(triangles.len() as u32, n + m);
            let place = |v: u32| {
                if v < 1000 { (f64::from(v) / f64::from(n), 1.0) } else { (f64::from(v - 1000) / f64::from(m), 0.0) }
            };
            let area: f64 = triangles
                .iter()
                .map(|t| {
                    let [(ax, ay), (bx, by), (cx, cy)] = t.map(place);
                    let area = 0.5 * ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax));
                    assert!(area > 0.0, "{n} over {m}: {t:?}");
                    area
                })
                .sum();
            assert!((area - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn the_entry_face_is_as_coarse_as_the_walls_allow() {
        let flat = [10.0_f32; 1001];
        assert_eq!(entry_cells(100.0, [&flat[..]]), 10);
        let steep: Vec<f32> = (0..1001).map(|k| 10.0 + 0.4 * (k % 2) as f32).collect();
        assert_eq!(entry_cells(100.0, [&steep[..]]), 40);
        assert_eq!(entry_cells(100.0, [&[3.0_f32; 5][..]]), 4);
    }
}
