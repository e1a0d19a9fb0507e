//! The picture itself.

use super::error::PictureError;
use crate::grid::Field;

/// A grey-scale picture of linear light on a 0..1 scale, row 0 on top, as a viewer sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    values: Field<f64>,
}

impl Picture {
    /// Least number of pixels along a side.
    pub const LEAST_SIDE: usize = 4;
    /// Greatest number of pixels along a side; pictures with more are reduced as they are read.
    pub const GREATEST_SIDE: usize = 16_384;
    /// Memory that reading takes at most unless told otherwise, bytes: enough for the greatest
    /// picture with 8 bits per colour and alpha.
    pub const MEMORY: u64 = 4 << 30;

    /// Takes linear light on a 0..1 scale, row 0 on top.
    ///
    /// # Errors
    /// Values that are negative or not finite, or a picture too small or too large.
    pub fn from_values(values: Field<f64>) -> Result<Self, PictureError> {
        let (width, height) = (values.nx(), values.ny());
        let (least, greatest) = (Self::LEAST_SIDE, Self::GREATEST_SIDE);
        if width.min(height) < least || width.max(height) > greatest {
            return Err(PictureError::Size { width, height, least, greatest });
        }
        match values.as_slice().iter().position(|v| !(v.is_finite() && *v >= 0.0)) {
            Some(k) => Err(PictureError::Value { column: k % width, row: k / width, value: values.as_slice()[k] }),
            None => Ok(Self { values }),
        }
    }

    /// Linear light on a 0..1 scale, row 0 on top.
    pub fn values(&self) -> &Field<f64> {
        &self.values
    }
}
