//! Where light is gathered while a picture is decoded row by row: upright, and in as few pixels as
//! a picture may have.

use super::{
    PictureError,
    colour::{Lamp, Shown},
};
use crate::grid::Field;
use rayon::prelude::*;

/// An orientation as EXIF numbers it: where the rows and columns of the stored picture lie in the
/// upright one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Orientation(u8);

impl Orientation {
    pub(super) const UPRIGHT: Self = Self(1);

    /// Numbers out of range count as upright.
    pub(super) fn new(number: u8) -> Self {
        if (1..=8).contains(&number) { Self(number) } else { Self::UPRIGHT }
    }

    /// 1 to 8.
    pub(super) fn number(self) -> u8 {
        self.0
    }

    /// Size of the upright picture.
    pub(super) fn size(self, (nx, ny): (usize, usize)) -> (usize, usize) {
        if self.0 >= 5 { (ny, nx) } else { (nx, ny) }
    }

    /// Where a pixel of the stored picture, `nx` by `ny`, lies in the upright one.
    pub(super) fn upright(self, (i, j): (usize, usize), (nx, ny): (usize, usize)) -> (usize, usize) {
        let (right, below) = (nx - 1 - i, ny - 1 - j);
        match self.0 {
            2 => (right, j),
            3 => (right, below),
            4 => (i, below),
            5 => (j, i),
            6 => (below, i),
            7 => (below, right),
            8 => (j, right),
            _ => (i, j),
        }
    }
}

/// What transparent parts and colours were found, whatever became of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spread {
    pub(super) alpha: (f64, f64),
    /// Of colours that show at all.
    pub(super) colour: (f64, f64),
}

impl Spread {
    pub(super) const NONE: Self =
        Self { alpha: (f64::INFINITY, f64::NEG_INFINITY), colour: (f64::INFINITY, f64::NEG_INFINITY) };

    pub(super) fn add(&mut self, shown: Shown) {
        self.alpha = (self.alpha.0.min(shown.alpha), self.alpha.1.max(shown.alpha));
        if shown.alpha > 0.0 {
            self.colour = (self.colour.0.min(shown.colour), self.colour.1.max(shown.colour));
        }
    }

    fn join(self, other: Self) -> Self {
        let joined = |a: (f64, f64), b: (f64, f64)| (a.0.min(b.0), a.1.max(b.1));
        Self { alpha: joined(self.alpha, other.alpha), colour: joined(self.colour, other.colour) }
    }
}

/// Light that is being gathered.
pub(super) struct Canvas {
    stored: (usize, usize),
    orientation: Orientation,
    factor: usize,
    light: Field<f64>,
    /// Rows that were added as such.
    rows: usize,
    spread: Spread,
}

impl Canvas {
    /// For a stored picture of this size.
    pub(super) fn new(stored: (usize, usize), orientation: Orientation, greatest_side: usize) -> Self {
        let (nx, ny) = orientation.size(stored);
        let factor = Self::factor(stored, greatest_side);
        let light = Field::filled(nx.div_ceil(factor), ny.div_ceil(factor), 0.0);
        Self { stored, orientation, factor, light, rows: 0, spread: Spread::NONE }
    }

    /// Pixels along a side that become one.
    pub(super) fn factor((nx, ny): (usize, usize), greatest_side: usize) -> usize {
        nx.max(ny).div_ceil(greatest_side).max(1)
    }

    /// Adds rows of numbers, the first of which is row `top` of the stored picture.
    pub(super) fn add(&mut self, top: usize, numbers: &[f32], lamp: &Lamp) -> Result<(), PictureError> {
        let (nx, ny) = self.stored;
        let rows: Vec<(Vec<f64>, Spread)> = numbers
            .par_chunks_exact(nx * lamp.stride())
            .map(|row| {
                let mut spread = Spread::NONE;
                let light = row.chunks_exact(lamp.stride()).map(|pixel| {
                    let shown = lamp.shine(pixel);
                    spread.add(shown);
                    shown.light
                });
                (light.collect(), spread)
            })
            .collect();
        // A file may hold more rows than it says.
        for (k, (row, spread)) in rows.iter().enumerate().take_while(|(k, _)| top + k < ny) {
            self.rows += 1;
            self.spread = self.spread.join(*spread);
            for (i, light) in row.iter().enumerate() {
                self.put((i, top + k), *light)?;
            }
        }
        Ok(())
    }

    /// Adds the light of one pixel of the stored picture.
    pub(super) fn put(&mut self, at: (usize, usize), light: f64) -> Result<(), PictureError> {
        let (i, j) = self.orientation.upright(at, self.stored);
        if !(light.is_finite() && light >= 0.0) {
            return Err(PictureError::Value { column: i, row: j, value: light });
        }
        self.light[(i / self.factor, j / self.factor)] += light;
        Ok(())
    }

    /// Whether all rows were added.
    pub(super) fn is_full(&self) -> bool {
        self.rows == self.stored.1
    }

    /// What was found on the way.
    pub(super) fn spread(&mut self) -> &mut Spread {
        &mut self.spread
    }

    /// The light, averaged, how much it was reduced, and what was found.
    pub(super) fn finish(mut self) -> (Field<f64>, usize, Spread) {
        let (factor, (nx, ny)) = (self.factor, self.orientation.size(self.stored));
        if factor > 1 {
            let along = |k: usize, n: usize| factor.min(n - k * factor);
            for j in 0..self.light.ny() {
                for i in 0..self.light.nx() {
                    self.light[(i, j)] /= (along(i, nx) * along(j, ny)) as f64;
                }
            }
        }
        (self.light, factor, self.spread)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orientations_are_those_of_exif() {
        // Where EXIF says that row 0 and column 0 of the stored picture are, seen upright: a
        // picture of 3 by 2.
        let corners = [
            (1, (0, 0), (2, 0)),
            (2, (2, 0), (0, 0)),
            (3, (2, 1), (0, 1)),
            (4, (0, 1), (2, 1)),
            (5, (0, 0), (0, 2)),
            (6, (1, 0), (1, 2)),
            (7, (1, 2), (1, 0)),
            (8, (0, 2), (0, 0)),
        ];
        for (number, first, along) in corners {
            let orientation = Orientation::new(number);
            assert_eq!(orientation.upright((0, 0), (3, 2)), first, "{number}");
            assert_eq!(orientation.upright((2, 0), (3, 2)), along, "{number}");
        }
        assert_eq!(Orientation::new(0), Orientation::UPRIGHT);
        assert_eq!(Orientation::new(9), Orientation::UPRIGHT);
    }

    #[test]
    fn blocks_at_the_last_row_and_column_hold_fewer_pixels() {
        let mut canvas = Canvas::new((5, 4), Orientation::new(3), 2);
        for j in 0..4 {
            for i in 0..5 {
                // Upright, column i from the left has light i.
                canvas.put((i, j), (4 - i) as f64).unwrap();
            }
        }
        let (light, factor, _) = canvas.finish();
        assert_eq!((factor, light.nx(), light.ny()), (3, 2, 2));
        assert_eq!([light[(0, 0)], light[(1, 0)], light[(1, 1)]], [1.0, 3.5, 3.5]);
    }
}
