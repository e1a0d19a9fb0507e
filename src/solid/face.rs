//! The faces of a block, and how the cells of its exit face are divided.

use crate::grid::Field;
use glam::DVec2;
use rayon::prelude::*;

/// One planar or structured side of the block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// The structured face, `z = h(x, y)`.
    Exit,
    /// The plane that the light enters, facing `-z`.
    Entry,
    /// The wall facing `-y`.
    South,
    /// The wall facing `+x`.
    East,
    /// The wall facing `+y`.
    North,
    /// The wall facing `-x`.
    West,
    /// The plane around the exit face, facing `+z`.
    Rim,
    /// The wall around a block that is not rectangular.
    Side,
    /// The wall between the exit face of such a block and its rim.
    Inner,
    /// The wall that cuts off a corner of the rim, facing `+x` and `+y`.
    Mark,
}

impl Face {
    /// The four walls, counter-clockwise as seen from `+z`.
    pub const WALLS: [Self; 4] = [Self::South, Self::East, Self::North, Self::West];

    /// Outward unit normal; of the exit face, that of its mean plane. Of a wall all around there is
    /// none: `Solid::normal_at` knows it.
    pub const fn normal(self) -> [f32; 3] {
        match self {
            Self::Exit => [0.0, 0.0, 1.0],
            Self::Entry => [0.0, 0.0, -1.0],
            Self::South => [0.0, -1.0, 0.0],
            Self::East => [1.0, 0.0, 0.0],
            Self::North => [0.0, 1.0, 0.0],
            Self::West => [-1.0, 0.0, 0.0],
            Self::Rim => [0.0, 0.0, 1.0],
            Self::Side | Self::Inner => [0.0; 3],
            Self::Mark => [std::f32::consts::FRAC_1_SQRT_2, std::f32::consts::FRAC_1_SQRT_2, 0.0],
        }
    }

    /// The wall that faces the other way.
    pub(super) const fn opposite(self) -> Self {
        match self {
            Self::South => Self::North,
            Self::East => Self::West,
            Self::North => Self::South,
            Self::West => Self::East,
            other => other,
        }
    }
}

/// Which corners of a cell a diagonal joins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Diagonal {
    /// From least x and y to greatest x and y.
    Rising,
    /// From greatest x and least y to least x and greatest y.
    Falling,
}

/// The diagonals of all cells, row by row: those along which the surface bends less.
///
/// The second derivatives along the two diagonals are `(h_xx + h_yy)/2 +- h_xy` (in units of the
/// cell), so that the signs of Laplacian and twist decide.
pub(super) fn diagonals(heights: &Field<f64>) -> Vec<Diagonal> {
    let (nx, ny) = (heights.nx(), heights.ny());
    let of_cell = |i: usize, j: usize| {
        // As the files have them.
        let at = |i: usize, j: usize| f64::from(heights[(i, j)] as f32);
        // Twice the second difference in the middle between nodes k and k + 1, from as many of the
        // four nodes k - 1 to k + 2 as there are.
        let bend = |k: usize, n: usize, h: &dyn Fn(usize) -> f64| {
            let left = if k > 0 { h(k - 1) - 2.0 * h(k) + h(k + 1) } else { 0.0 };
            let right = if k + 2 < n { h(k) - 2.0 * h(k + 1) + h(k + 2) } else { 0.0 };
            if k > 0 && k + 2 < n { left + right } else { 2.0 * (left + right) }
        };
        let along_x = bend(i, nx, &|i| at(i, j)) + bend(i, nx, &|i| at(i, j + 1));
        let along_y = bend(j, ny, &|j| at(i, j)) + bend(j, ny, &|j| at(i + 1, j));
        let twist = (at(i + 1, j + 1) + at(i, j)) - (at(i + 1, j) + at(i, j + 1));
        let rising_bends_more = (along_x + along_y) * twist;
        if rising_bends_more < 0.0 {
            Diagonal::Rising
        } else if rising_bends_more > 0.0 {
            Diagonal::Falling
        } else if (2 * i + 2 > nx) == (2 * j + 2 > ny) {
            Diagonal::Rising
        } else {
            Diagonal::Falling
        }
    };
    (0..(nx - 1) * (ny - 1)).into_par_iter().with_min_len(nx).map(|k| of_cell(k % (nx - 1), k / (nx - 1))).collect()
}

/// Unit normal of a face of these slopes, towards `+z`.
pub(super) fn normal_of(slope: DVec2) -> [f32; 3] {
    // `+ 0.0` turns a negative zero into a positive one.
    (-slope.extend(-1.0)).normalize().as_vec3().to_array().map(|c| c + 0.0)
}
