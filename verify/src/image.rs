//! A picture of irradiance: the one type that light, film, metrics and pictures share.

/// Irradiance in picture order: row 0 is the top of the picture (greatest y), column 0 its left
/// (greatest x).
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Columns.
    pub nx: usize,
    /// Rows.
    pub ny: usize,
    /// Row-major values.
    pub values: Vec<f64>,
}

impl Image {
    /// Takes over `nx * ny` values, row by row.
    ///
    /// # Panics
    /// If there is another number of values.
    pub fn new(nx: usize, ny: usize, values: Vec<f64>) -> Self {
        assert_eq!(values.len(), nx * ny, "an image of {nx} x {ny} values");
        Self { nx, ny, values }
    }

    /// Mean of all values.
    pub fn mean(&self) -> f64 {
        // Row by row, so that rounding does not grow with the size of the image.
        self.values.chunks(self.nx.max(1)).map(|row| row.iter().sum::<f64>()).sum::<f64>() / self.values.len() as f64
    }
}
