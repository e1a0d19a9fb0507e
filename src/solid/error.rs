use super::Solid;

/// Why a surface does not make a block.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SolidError {
    /// A node without a height.
    #[error("the height of the exit face at node ({i}, {j}) is {height_mm} mm; every height must be finite")]
    NotFinite {
        /// Column of the node.
        i: usize,
        /// Row of the node.
        j: usize,
        /// What stands there, mm.
        height_mm: f64,
    },
    /// More nodes than mesh files can number.
    #[error(
        "the exit face has {nx} x {ny} nodes; mesh files hold at most {} of them: ask for fewer (--nodes)",
        Solid::MOST_NODES
    )]
    TooManyNodes {
        /// Nodes along x.
        nx: usize,
        /// Nodes along y.
        ny: usize,
    },
    /// Nodes that `f32` coordinates could not tell apart.
    #[error(
        "the nodes are {spacing_mm} mm apart on a block of {size_mm} mm; the coordinates of mesh files need at least {least_mm:.1e} mm there: ask for fewer nodes (--nodes)"
    )]
    TooFine {
        /// Distance of neighbours, mm.
        spacing_mm: f64,
        /// Size of the block in that direction, mm.
        size_mm: f64,
        /// Least distance, mm.
        least_mm: f64,
    },
    /// A thickness out of range.
    #[error("{what} is {value_mm} mm; it must lie between {least_mm} mm and {greatest_mm} mm")]
    Thickness {
        /// Which one.
        what: &'static str,
        /// Its value, mm.
        value_mm: f64,
        /// Least accepted value, mm.
        least_mm: f64,
        /// Greatest accepted value, mm.
        greatest_mm: f64,
    },
    /// The cutter would come out of the entry face, or near it.
    #[error(
        "a stock of {thickness_mm} mm leaves {thinnest_mm:.2} mm at the thinnest place, because the relief is {relief_mm:.2} mm deep; at least {least_mm} mm must remain: take a thicker stock (--thickness {enough_mm}mm), or move the receiver further away to make the relief shallower"
    )]
    TooThin {
        /// Thickness of the stock, mm.
        thickness_mm: f64,
        /// Peak to valley of the exit face, mm.
        relief_mm: f64,
        /// What remains, mm.
        thinnest_mm: f64,
        /// What must remain, mm.
        least_mm: f64,
        /// A stock that would do, mm.
        enough_mm: f64,
    },
    /// No sheet is thick enough.
    #[error(
        "the relief is {relief_mm:.2} mm deep and {least_mm} mm must remain, but the thickest standard sheet is {thickest_mm} mm: name a stock (--thickness), or move the receiver further away to make the relief shallower"
    )]
    TooDeep {
        /// Peak to valley of the exit face, mm.
        relief_mm: f64,
        /// What must remain, mm.
        least_mm: f64,
        /// The thickest standard sheet, mm.
        thickest_mm: f64,
    },
}
