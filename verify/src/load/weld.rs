//! Giving equal positions one index.

use glam::DVec3;
use std::cmp::Ordering;

/// Gives equal positions one index, in the order of their first appearance.
///
/// Neighbouring triangles share corners, and rows of triangles meet a row of vertices once more:
/// most positions that are known are found among those of late. What is not found there is sorted
/// in the end. No choice of positions makes that slow.
pub(super) struct Welder {
    /// Some of them more than once.
    vertices: Vec<DVec3>,
    /// The last few indices given.
    recent: [u32; RECENT],
    /// Where the next will be written.
    oldest: usize,
    /// What follows the last index that was met again after a while.
    next: u32,
    /// Indices given of late, each at a place that its position decides.
    late: Box<[u32; LATE]>,
}

/// Indices kept at hand: the corners of two triangles.
const RECENT: usize = 4;
/// Indices kept by position: more than two rows of vertices, and no more than a cache holds.
const LATE: usize = 1 << 14;

/// Indices that turned out to be the same: for every index its final one.
pub(super) struct Renumbered(Option<Vec<u32>>);

impl Renumbered {
    pub(super) fn apply(&self, triangles: &mut [[u32; 3]]) {
        if let Self(Some(numbers)) = self {
            triangles.as_flattened_mut().iter_mut().for_each(|index| *index = numbers[*index as usize]);
        }
    }
}

impl Welder {
    pub(super) fn with_expected(vertices: usize) -> Self {
        Self {
            vertices: Vec::with_capacity(vertices),
            recent: [0; RECENT],
            oldest: 0,
            next: 0,
            late: Box::new([0; LATE]),
        }
    }

    /// An index of this position, until [`finish`](Self::finish) renumbers them. `None` once 2³² -
    /// 1 are given.
    pub(super) fn index(&mut self, position: DVec3) -> Option<u32> {
        // Adding zero turns -0 into +0, which is the same place.
        let position = position + DVec3::ZERO;
        let is_at = |k: u32| self.vertices.get(k as usize) == Some(&position);
        if let Some(&known) = self.recent.iter().find(|&&k| is_at(k)) {
            return Some(known);
        }
        let index = if is_at(self.next) { self.next } else { self.index_of_few(position)? };
        if index as usize + 1 < self.vertices.len() {
            self.next = index + 1;
        }
        self.recent[self.oldest] = index;
        self.oldest = (self.oldest + 1) % RECENT;
        Some(index)
    }

    /// The same for a position that few others are equal to, in no order that is known: not all
    /// that could be found at once is.
    pub(super) fn index_of_few(&mut self, position: DVec3) -> Option<u32> {
        let position = position + DVec3::ZERO;
        let late = &mut self.late[place(position)];
        if self.vertices.get(*late as usize) != Some(&position) {
            *late = u32::try_from(self.vertices.len()).ok().filter(|&i| i != u32::MAX)?;
            self.vertices.push(position);
        }
        Some(*late)
    }

    /// Distinct positions, and how indices change.
    pub(super) fn finish(mut self) -> (Vec<DVec3>, Renumbered) {
        // Both ways are stable. Files that list vertices row by row are in order but for a few;
        // others had better be moved as they are compared.
        let descents = self.vertices.windows(2).filter(|pair| along_rows(&pair[0], &pair[1]).is_gt()).count();
        let mut numbers: Vec<u32> = Vec::new();
        let mut same = |first: u32, second: u32| {
            if numbers.is_empty() {
                numbers.extend(0..self.vertices.len() as u32);
            }
            numbers[second as usize] = numbers[first as usize];
        };
        if descents < self.vertices.len() / 16 {
            let mut sorted: Vec<u32> = (0..self.vertices.len() as u32).collect();
            let at = |k: u32| self.vertices[k as usize];
            sorted.sort_by(|&a, &b| along_rows(&at(a), &at(b)));
            sorted.windows(2).filter(|pair| at(pair[0]) == at(pair[1])).for_each(|pair| same(pair[0], pair[1]));
        } else {
            let mut sorted: Vec<(DVec3, u32)> = self.vertices.iter().copied().zip(0..).collect();
            sorted.sort_by(|(a, _), (b, _)| along_rows(a, b));
            sorted.windows(2).filter(|pair| pair[0].0 == pair[1].0).for_each(|pair| same(pair[0].1, pair[1].1));
        }
        if numbers.is_empty() {
            return (self.vertices, Renumbered(None));
        }
        let mut kept = 0;
        for k in 0..numbers.len() {
            if numbers[k] as usize == k {
                self.vertices[kept] = self.vertices[k];
                numbers[k] = kept as u32;
                kept += 1;
            } else {
                // The first of those that are the same, whose number is known by now.
                numbers[k] = numbers[numbers[k] as usize];
            }
        }
        self.vertices.truncate(kept);
        (self.vertices, Renumbered(Some(numbers)))
    }
}

/// The order of positions along rows.
fn along_rows(a: &DVec3, b: &DVec3) -> Ordering {
    let order = |a: f64, b: f64| a.partial_cmp(&b).unwrap_or(Ordering::Equal);
    order(a.y, b.y).then_with(|| order(a.x, b.x)).then_with(|| order(a.z, b.z))
}

/// Where the index of a position is kept.
fn place(position: DVec3) -> usize {
    let mix = |hash: u64, value: f64| (hash.rotate_left(32) ^ value.to_bits()).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let hash = mix(mix(mix(0, position.x), position.y), position.z);
    (hash >> (u64::BITS - LATE.trailing_zeros())) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn welding_keeps_first_appearance_order_and_merges_signed_zeros() {
        let mut welder = Welder::with_expected(0);
        let points = (0..5001).map(|k| DVec3::new(f64::from(k % 1000), -0.5, 0.25));
        let mut triangles: Vec<[u32; 3]> = points.map(|p| [welder.index(p).unwrap(); 3]).collect();
        triangles.push([welder.index(DVec3::new(-0.0, -0.5, 0.25)).unwrap(); 3]);
        let (vertices, renumbered) = welder.finish();
        renumbered.apply(&mut triangles);
        assert_eq!(vertices.len(), 1000);
        assert!((0..5001).all(|k| triangles[k] == [(k % 1000) as u32; 3]) && triangles[5001] == [0; 3]);
    }

    #[test]
    fn triangles_in_any_order_are_welded_alike() {
        // Corners of the cells of a grid, whose nodes are numbered by their first appearance.
        let n = 40;
        let mut cells: Vec<usize> = (0..n * n).collect();
        for stride in [1, 7, 799, 1599] {
            cells.sort_by_key(|k| k * stride % (n * n));
            let mut welder = Welder::with_expected(0);
            let corner = |k: usize, c: usize| (k % n + c % 2, k / n + c / 2);
            let mut triangles: Vec<[u32; 3]> = Vec::new();
            let mut wanted: Vec<(usize, usize)> = Vec::new();
            for &k in &cells {
                for half in [[0, 1, 3], [0, 3, 2]] {
                    let at = half.map(|c| corner(k, c));
                    let position = |(i, j)| DVec3::new(i as f64, j as f64, (i * j % 5) as f64);
                    triangles.push(at.map(|node| welder.index(position(node)).unwrap()));
                    at.iter().for_each(|node| {
                        if !wanted.contains(node) {
                            wanted.push(*node);
                        }
                    });
                }
            }
            let (vertices, renumbered) = welder.finish();
            renumbered.apply(&mut triangles);
            assert_eq!(vertices.len(), (n + 1) * (n + 1));
            assert!(vertices.iter().zip(&wanted).all(|(v, &(i, j))| (v.x, v.y) == (i as f64, j as f64)), "{stride}");
            assert!(triangles.iter().flatten().all(|&v| (v as usize) < vertices.len()));
            let first = triangles[0].map(|v| wanted[v as usize]);
            assert_eq!(first, [0, 1, 3].map(|c| corner(cells[0], c)));
        }
    }
}
