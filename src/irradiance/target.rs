//! Light that shall be drawn.

use super::Picture;
use crate::grid::{Field, area_resample};

/// Irradiance wanted on the cells of the receiver window, mean 1, in the
/// [frame's](crate#frame-units-signs) order: row along `+y`, column along `+x`.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetIrradiance {
    cells: Field<f64>,
}

/// Why a target cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TargetError {
    /// Nothing would be lit.
    #[error(
        "the picture is black everywhere and the offset is 0: there is no light to draw with; use a picture with some white or an offset above 0"
    )]
    Black,
    /// The constant is not usable.
    #[error(
        "the offset is {0}; it must lie between 0 and 100 (the paper's constant, added to values on a 0..1 scale; 0.1 is usual)"
    )]
    Offset(f64),
    /// A value is not a light.
    #[error("the irradiance at column {column}, row {row} is {value}; irradiance is finite and never negative")]
    Value {
        /// Column of the cell.
        column: usize,
        /// Row of the cell.
        row: usize,
        /// Its value.
        value: f64,
    },
    /// Too few cells for a picture.
    #[error("the picture has {nx} x {ny} pixels; at least {least} x {least} are needed")]
    TooSmall {
        /// Columns.
        nx: usize,
        /// Rows.
        ny: usize,
        /// Least number of either.
        least: usize,
    },
}

impl TargetIrradiance {
    /// Least number of cells along a side.
    pub const LEAST_CELLS: usize = Picture::LEAST_SIDE;

    /// Takes irradiance on cells in the frame's order, in any unit, and normalises it to the mean
    /// 1.
    ///
    /// # Errors
    /// Negative, non-finite or all-zero values, or too few cells.
    pub fn new(cells: Field<f64>) -> Result<Self, TargetError> {
        let (nx, ny) = (cells.nx(), cells.ny());
        if nx.min(ny) < Self::LEAST_CELLS {
            return Err(TargetError::TooSmall { nx, ny, least: Self::LEAST_CELLS });
        }
        if let Some(k) = cells.as_slice().iter().position(|v| !(v.is_finite() && *v >= 0.0)) {
            return Err(TargetError::Value { column: k % nx, row: k / nx, value: cells.as_slice()[k] });
        }
        let mean = cells.mean();
        if !(mean.is_finite() && mean > 0.0) {
            return Err(TargetError::Black);
        }
        Ok(Self { cells: cells.map(|v| v / mean) })
    }

    /// The light of a picture plus a constant (section 3.1 of the paper), which trades contrast for
    /// stability.
    ///
    /// # Errors
    /// A black picture without offset, or an offset out of range.
    pub fn from_picture(picture: &Picture, offset: f64) -> Result<Self, TargetError> {
        if !(0.0..=100.0).contains(&offset) {
            return Err(TargetError::Offset(offset));
        }
        let values = picture.values();
        let (nx, ny) = (values.nx(), values.ny());
        // Seen from the block's side the picture's left is +x and its top is +y: both axes turn
        // round.
        Self::new(Field::from_fn(nx, ny, |i, j| values[(nx - 1 - i, ny - 1 - j)] + offset))
    }

    /// Irradiance on the cells, mean 1.
    pub fn cells(&self) -> &Field<f64> {
        &self.cells
    }

    /// The same light on another number of cells, averaged exactly by area.
    pub fn resampled(&self, nx: usize, ny: usize) -> Self {
        Self { cells: area_resample(&self.cells, nx, ny) }
    }
}

/// Turns a field in the frame's order into the order of a picture (row 0 on top, column 0 on the
/// left), or back.
pub fn to_picture_order<T: Copy>(field: &Field<T>) -> Field<T> {
    let mut data = field.as_slice().to_vec();
    data.reverse();
    Field::from_vec(field.nx(), field.ny(), data)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_of_the_picture_lands_where_a_viewer_at_the_block_sees_it() {
        let mut values = Field::filled(6, 4, 0.0);
        values[(0, 0)] = 1.0; // top left
        let target = TargetIrradiance::from_picture(&Picture::from_values(values).unwrap(), 0.0).unwrap();
        assert!(target.cells()[(5, 3)] > 0.0, "top left is at greatest x and y");
        assert!((target.cells().mean() - 1.0).abs() < 1e-15);
        assert!(to_picture_order(target.cells())[(0, 0)] > 0.0);
    }

    #[test]
    fn black_needs_an_offset() {
        let black = Picture::from_values(Field::filled(8, 8, 0.0)).unwrap();
        assert_eq!(TargetIrradiance::from_picture(&black, 0.0), Err(TargetError::Black));
        assert!(TargetIrradiance::from_picture(&black, 0.1).is_ok());
        assert_eq!(TargetIrradiance::from_picture(&black, -1.0), Err(TargetError::Offset(-1.0)));
    }
}
