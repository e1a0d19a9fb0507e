//! Rows of numbers of a picture whose head has been read.

use super::{
    PictureError,
    canvas::Orientation,
    colour::{Alpha, Says},
    curve::Model,
};

/// Most rows, and numbers, that are turned into light together.
const STRIP: usize = 64;

const NUMBERS: usize = 1 << 20;

/// Takes rows: the number of the first, and theirs numbers, 0 to 1 where they are integers.
pub(super) type Sink<'a> = &'a mut dyn FnMut(usize, &[f32]) -> Result<(), PictureError>;

pub(super) type Rows<'a> = Box<dyn FnOnce(Sink<'_>) -> Result<(), PictureError> + 'a>;

/// A picture whose head has been read.
pub(super) struct Sheet<'a> {
    pub(super) size: (usize, usize),
    pub(super) model: Model,
    pub(super) alpha: Alpha,
    /// Numbers from pixel to pixel.
    pub(super) stride: usize,
    /// The integer that stands for 1, where numbers are integers of at most 16 bits.
    pub(super) greatest: Option<u16>,
    pub(super) orientation: Orientation,
    pub(super) says: Says,
    /// Bytes that decoding takes besides the file and the light.
    pub(super) needs: u64,
    pub(super) rows: Rows<'a>,
}

/// Gives away numbers that lie in memory, in strips.
pub(super) fn emit<T>(
    numbers: &[T],
    per_row: usize,
    top: usize,
    number: impl Fn(&T) -> f32,
    sink: Sink<'_>,
) -> Result<(), PictureError> {
    let together = rows_together(per_row);
    let mut strip = Vec::with_capacity(per_row * together.min(numbers.len().div_ceil(per_row)));
    for (k, rows) in numbers.chunks(per_row * together).enumerate() {
        strip.clear();
        strip.extend(rows.iter().map(&number));
        sink(top + k * together, &strip)?;
    }
    Ok(())
}

/// Rows that are turned into light together: enough for many threads, few enough for little memory.
pub(super) fn rows_together(per_row: usize) -> usize {
    (NUMBERS / per_row.max(1)).clamp(1, STRIP)
}

pub(super) fn of_u8(value: &u8) -> f32 {
    f32::from(*value) / 255.0
}

pub(super) fn of_u16(value: &u16) -> f32 {
    f32::from(*value) / 65535.0
}
