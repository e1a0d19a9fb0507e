use std::ops::{Index, IndexMut};

/// A dense two-dimensional array, row-major: `[(i, j)]` is column `i` (along `+x`) of row `j`
/// (along `+y`).
#[derive(Clone, Debug, PartialEq)]
pub struct Field<T> {
    nx: usize,
    ny: usize,
    data: Vec<T>,
}

impl<T> Field<T> {
    /// Takes over `nx * ny` values in row-major order.
    ///
    /// # Panics
    /// If `data` has another length than `nx * ny`.
    pub fn from_vec(nx: usize, ny: usize, data: Vec<T>) -> Self {
        assert_eq!(data.len(), nx * ny, "a field of {nx} x {ny} values");
        Self { nx, ny, data }
    }

    /// Calls `f(i, j)` for every element.
    pub fn from_fn(nx: usize, ny: usize, mut f: impl FnMut(usize, usize) -> T) -> Self {
        let data = (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j))).map(|(i, j)| f(i, j)).collect();
        Self { nx, ny, data }
    }

    /// Columns.
    pub fn nx(&self) -> usize {
        self.nx
    }

    /// Rows.
    pub fn ny(&self) -> usize {
        self.ny
    }

    /// All values, row by row.
    pub fn as_slice(&self) -> &[T] {
        &self.data
    }

    /// All values, row by row.
    pub fn as_mut_slice(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// The values, row by row.
    pub fn into_vec(self) -> Vec<T> {
        self.data
    }

    /// Row `j`.
    pub fn row(&self, j: usize) -> &[T] {
        &self.data[j * self.nx..(j + 1) * self.nx]
    }

    /// The same shape with every value mapped.
    pub fn map<U>(&self, f: impl FnMut(&T) -> U) -> Field<U> {
        Field { nx: self.nx, ny: self.ny, data: self.data.iter().map(f).collect() }
    }
}

impl<T: Clone> Field<T> {
    /// A field of one value.
    pub fn filled(nx: usize, ny: usize, value: T) -> Self {
        Self { nx, ny, data: vec![value; nx * ny] }
    }
}

impl Field<f64> {
    /// Arithmetic mean, summed row by row so that rounding does not grow with the size of the
    /// field.
    pub fn mean(&self) -> f64 {
        self.data.chunks(self.nx).map(|row| row.iter().sum::<f64>()).sum::<f64>() / self.data.len() as f64
    }

    /// Least and greatest value.
    pub fn min_max(&self) -> (f64, f64) {
        self.data.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &v| (lo.min(v), hi.max(v)))
    }
}

impl<T> Index<(usize, usize)> for Field<T> {
    type Output = T;
    fn index(&self, (i, j): (usize, usize)) -> &T {
        debug_assert!(i < self.nx);
        &self.data[j * self.nx + i]
    }
}

impl<T> IndexMut<(usize, usize)> for Field<T> {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut T {
        debug_assert!(i < self.nx);
        &mut self.data[j * self.nx + i]
    }
}
