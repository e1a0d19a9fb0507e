//! Sobol's points in the plane, scrambled, in the order of their strata.
//!
//! The first 2^m points of Sobol's sequence in two dimensions (van der Corput's, and Pascal's
//! triangle modulo 2) are a (0, m, 2)-net: each of the 2^m equal boxes into which the unit square
//! can be cut by halving, however long or wide, holds one. So there is one in every stratum, and
//! besides one in every column of half the width and twice the height, and so on: light and dark
//! are counted better than by points that are independent within their strata. Every coordinate is
//! scrambled by a random lower triangular matrix over GF(2) and a random shift (Matousek 1998),
//! which keeps the net, makes every point uniform by itself, and has the variance of Owen's nested
//! scrambling (Owen 2003).
//!
//! All of this is linear over GF(2): a point is the exclusive or of what its column and what its
//! row contribute. Hence no point needs more than two of them, and they can be had in any order.

use crate::random::mix;
use glam::DVec2;

/// One sample of the unit square.
#[derive(Debug)]
pub(super) struct SobolNet {
    /// By column: what it adds to x and y, 32 bits after the point.
    columns: Vec<[u32; 2]>,
    /// By row.
    rows: Vec<[u32; 2]>,
}

/// Most bits of a column's or row's number.
const MOST_BITS: u32 = 16;

/// Bits of the numbers of columns and rows for at least `count` points in strata about as wide as
/// high, in an area `aspect` times as wide as high.
pub(super) fn strata_bits(count: u64, aspect: f64) -> (u32, u32) {
    let all = count.max(1).next_power_of_two().trailing_zeros().min(2 * MOST_BITS);
    let columns = (0.5 * (f64::from(all) + aspect.log2())).round().max(0.0) as u32;
    let columns = columns.clamp(all.saturating_sub(MOST_BITS), all.min(MOST_BITS));
    (columns, all - columns)
}

impl SobolNet {
    /// A net of `2^column_bits * 2^row_bits` points (at most 16 bits each), scrambled as the key
    /// says.
    pub(super) fn new(key: u64, column_bits: u32, row_bits: u32) -> Self {
        let directions = directions();
        let second = |index: u32| combined(&directions, index);
        // The index whose point is in column 0 and row r is solutions * r: it has to reach that row
        // by the bits which do not touch the column.
        let solutions = solutions(&directions, column_bits, row_bits);
        let top = |y: u32, bits: u32| if bits == 0 { 0 } else { y >> (32 - bits) };
        let [scramble_x, scramble_y] = [0, 1].map(|axis| Scramble::new(mix(key ^ mix(axis))));
        let linear = |index: u32| [scramble_x.linear(index.reverse_bits()), scramble_y.linear(second(index))];
        let mut columns = vec![[0; 2]; 1 << column_bits];
        for column in 0..1u32 << column_bits {
            let index = if column_bits == 0 { 0 } else { column.reverse_bits() >> (32 - column_bits) };
            let index = index ^ combined(&solutions, top(second(index), row_bits));
            let [x, y] = linear(index);
            let [x, y] = [x ^ scramble_x.shift, y ^ scramble_y.shift];
            columns[top(x, column_bits) as usize] = [x, y];
        }
        let mut rows = vec![[0; 2]; 1 << row_bits];
        for row in 0..1u32 << row_bits {
            let [x, y] = linear(combined(&solutions, row));
            // The shift is in the columns' part.
            rows[top(y ^ scramble_y.shift, row_bits) as usize] = [x, y];
        }
        Self { columns, rows }
    }

    /// The point in a stratum.
    #[inline]
    pub(super) fn point(&self, column: u32, row: u32) -> DVec2 {
        let (a, b) = (self.columns[column as usize], self.rows[row as usize]);
        let unit = |bits: u32| f64::from(bits) * 0.5f64.powi(32) + 0.5f64.powi(33);
        DVec2::new(unit(a[0] ^ b[0]), unit(a[1] ^ b[1]))
    }
}

/// What every bit of an index adds to the second coordinate of its point: rows of Pascal's triangle
/// modulo 2.
fn directions() -> [u32; 32] {
    let mut directions = [1 << 31; 32];
    for c in 1..32 {
        directions[c] = directions[c - 1] ^ (directions[c - 1] >> 1);
    }
    directions
}

/// The exclusive or of those columns of a matrix that a vector's bits name.
fn combined(columns: &[u32], mut vector: u32) -> u32 {
    let mut sum = 0;
    while vector != 0 {
        sum ^= columns[vector.trailing_zeros() as usize];
        vector &= vector - 1;
    }
    sum
}

/// For every bit of a row's number the bits of an index, from `column_bits` on, that bring it about
/// and no other: Gauss and Jordan's elimination over GF(2).
fn solutions(directions: &[u32; 32], column_bits: u32, row_bits: u32) -> [u32; 32] {
    let mut solutions = [0; 32];
    let mut open: Vec<(u32, u32)> =
        (column_bits..column_bits + row_bits).map(|c| (directions[c as usize] >> (32 - row_bits), 1 << c)).collect();
    for bit in 0..row_bits as usize {
        // There is one, for the points are a net.
        let pivot = (bit..open.len()).find(|&k| open[k].0 >> bit & 1 == 1).unwrap_or(bit);
        open.swap(bit, pivot);
        let (row, index) = open[bit];
        for (k, other) in open.iter_mut().enumerate() {
            if k != bit && other.0 >> bit & 1 == 1 {
                *other = (other.0 ^ row, other.1 ^ index);
            }
        }
    }
    for (solution, (_, index)) in solutions.iter_mut().zip(open) {
        *solution = index;
    }
    solutions
}

/// A random scrambling of the bits after the point.
struct Scramble {
    /// Columns of a lower triangular matrix: a bit changes itself and lower ones at random.
    columns: [u32; 32],
    shift: u32,
}

impl Scramble {
    fn new(key: u64) -> Self {
        let random = |k: u64| mix(key.wrapping_add((k + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15))) as u32;
        let columns = std::array::from_fn(|k| (random(k as u64) & ((1 << k) - 1)) | 1 << k);
        Self { columns, shift: random(32) }
    }

    fn linear(&self, bits: u32) -> u32 {
        combined(&self.columns, bits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_box_of_every_shape_holds_one_point_and_strata_hold_their_own() {
        for (a, b) in [(0, 0), (0, 5), (6, 0), (4, 4), (7, 3), (2, 9)] {
            for key in 0..20 {
                let net = SobolNet::new(key, a, b);
                for wide in 0..=a + b {
                    let mut met = vec![false; 1 << (a + b)];
                    for row in 0..1u32 << b {
                        for column in 0..1u32 << a {
                            let p = net.point(column, row);
                            let (x, y) = (f64::from(1u32 << wide), f64::from(1u32 << (a + b - wide)));
                            let at = (p.y * y) as usize * (1 << wide) + (p.x * x) as usize;
                            assert!(!std::mem::replace(&mut met[at], true), "{a} {b} {wide}: two points in {at}");
                            let own = (p * DVec2::new(f64::from(1u32 << a), f64::from(1u32 << b))).floor();
                            assert_eq!((own.x as u32, own.y as u32), (column, row));
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_point_is_uniform_over_all_scramblings() {
        let n = 20_000;
        let (mut sum, mut squares) = (DVec2::ZERO, DVec2::ZERO);
        for key in 0..n {
            // Within its stratum.
            let p = SobolNet::new(mix(key), 3, 2).point(5, 2) * DVec2::new(8.0, 4.0) - DVec2::new(5.0, 2.0);
            assert!(p.min_element() > 0.0 && p.max_element() < 1.0);
            sum += p;
            squares += p * p;
        }
        let (mean, second) = (sum / n as f64, squares / n as f64);
        // Standard errors are sqrt(1/12) and sqrt(4/45) over sqrt(n).
        assert!((mean - 0.5).abs().max_element() < 4.0 * 0.289 / (n as f64).sqrt(), "{mean}");
        assert!((second - 1.0 / 3.0).abs().max_element() < 4.0 * 0.298 / (n as f64).sqrt(), "{second}");
    }

    #[test]
    fn strata_are_as_many_as_asked_for_and_about_as_wide_as_high() {
        assert_eq!(strata_bits(1, 1.0), (0, 0));
        assert_eq!(strata_bits(1000, 1.0), (5, 5));
        assert_eq!(strata_bits(1 << 20, 4.0), (11, 9));
        assert_eq!(strata_bits(1 << 20, 1e-9), (4, 16));
        assert_eq!(strata_bits(u64::MAX >> 1, 1.0), (16, 16));
    }
}
