use super::{Shape, SolidError, Stock};
use crate::grid::Extent;

/// What a block is made from, and what it shall have around its optical face.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Blank {
    /// How thick the sheet is.
    pub stock: Stock,
    /// Rim, mark, skirt and origin.
    pub shape: Shape,
}

impl Blank {
    /// A block of this stock, with nothing around its optical face.
    pub fn new(stock: Stock) -> Self {
        Self { stock, shape: Shape::default() }
    }

    /// The same with this around its optical face.
    #[must_use]
    pub fn with_shape(self, shape: Shape) -> Self {
        Self { shape, ..self }
    }

    /// Refuses what no block of this size can have, before a surface is solved for.
    ///
    /// # Errors
    /// Those of [`Stock::check`] and [`Shape::check`].
    pub fn check(&self, face: Extent) -> Result<(), SolidError> {
        self.stock.check()?;
        self.shape.check(face)
    }
}

impl From<Stock> for Blank {
    fn from(stock: Stock) -> Self {
        Self::new(stock)
    }
}
