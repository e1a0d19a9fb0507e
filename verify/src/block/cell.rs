//! A cell of the grid under an exit face, and its two triangles.

/// The diagonal along which a cell of the grid is cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Diagonal {
    /// From the corner of least x and y to that of greatest x and y.
    Rising,
    /// The other one.
    Falling,
}

/// Three of the corners of a cell, numbered as [`corners`] lists them; counter-clockwise as seen
/// from the receiver.
pub(crate) type Half = [usize; 3];

/// The nodes (column, row) of the corners of a cell, going round.
#[inline]
pub(crate) fn corners(i: usize, j: usize) -> [(usize, usize); 4] {
    [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
}

/// The two triangles of a cell.
#[inline]
pub(crate) fn halves(diagonal: Diagonal) -> [Half; 2] {
    match diagonal {
        Diagonal::Rising => [[0, 1, 2], [0, 2, 3]],
        Diagonal::Falling => [[0, 1, 3], [1, 2, 3]],
    }
}
