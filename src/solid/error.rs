/// Most nodes of an exit face: twice as many triangles still have 32-bit numbers.
pub(super) const MOST_NODES: usize = 1 << 30;

/// Why a surface does not make a block.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolidError {
    /// A node without a height.
    #[error("the height of the {face} face at node ({i}, {j}) is {height_mm} mm; every height must be finite")]
    NotFinite {
        /// Which face, exit or entry.
        face: &'static str,
        /// Column of the node.
        i: usize,
        /// Row of the node.
        j: usize,
        /// What stands there, mm.
        height_mm: f64,
    },
    /// More nodes than mesh files can number.
    #[error("the exit face has {nx} x {ny} nodes; mesh files hold at most {} of them: ask for fewer", MOST_NODES)]
    TooManyNodes {
        /// Nodes along x.
        nx: usize,
        /// Nodes along y.
        ny: usize,
    },
    /// Nodes that `f32` coordinates could not tell apart.
    #[error(
        "the nodes are {spacing_mm} mm apart on a block of {size_mm} mm; the coordinates of mesh files need at least {least_mm:.1e} mm there: ask for fewer nodes"
    )]
    TooFine {
        /// Distance of neighbours, mm.
        spacing_mm: f64,
        /// Size of the block in that direction, mm.
        size_mm: f64,
        /// Least distance, mm.
        least_mm: f64,
    },
    /// An entry face that is not planar, below a block that has a rim or another outline.
    #[error(
        "an entry face that is not planar is made for rectangular blocks without a rim only: leave `outline` and `rim` out, or take a planar entry face"
    )]
    EntryOutline,
    /// An entry face on other nodes than the exit face.
    #[error(
        "the entry face has {} x {} nodes over {} x {} mm, the exit face {} x {} over {} x {} mm: both must be the same",
        nodes[0], nodes[1], size_mm[0], size_mm[1], wanted[0], wanted[1], wanted_mm[0], wanted_mm[1]
    )]
    EntryGrid {
        /// Nodes of the entry face along x and y.
        nodes: [usize; 2],
        /// Its size, mm.
        size_mm: [f64; 2],
        /// Nodes of the exit face with its skirt.
        wanted: [usize; 2],
        /// Its size, mm.
        wanted_mm: [f64; 2],
    },
    /// A skirt that is none, or larger than the face.
    #[error("the skirt around the exit face is {width_mm} mm wide; it must lie between 0 and {greatest_mm} mm")]
    Skirt {
        /// Its width, mm.
        width_mm: f64,
        /// Greatest accepted width, mm.
        greatest_mm: f64,
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
        "a stock of {thickness_mm} mm leaves {thinnest_mm:.2} mm at the thinnest place, because the relief is {relief_mm:.2} mm deep; at least {least_mm} mm must remain: take a stock of {enough_mm} mm, or move the receiver further away to make the relief shallower"
    )]
    TooThin {
        /// Thickness of the stock, mm.
        thickness_mm: f64,
        /// Peak to valley of the exit face, mm, with what an entry face that is not planar takes.
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
        "the relief is {relief_mm:.2} mm deep and {least_mm} mm must remain, but the thickest standard sheet is {thickest_mm} mm: name a stock, or move the receiver further away to make the relief shallower"
    )]
    TooDeep {
        /// Peak to valley of the exit face, mm, with what an entry face that is not planar takes.
        relief_mm: f64,
        /// What must remain, mm.
        least_mm: f64,
        /// The thickest standard sheet, mm.
        thickest_mm: f64,
    },
    /// A facing that no sheet needs.
    #[error("{value_mm} mm shall be faced off the sheet; it must lie between 0 mm and {greatest_mm} mm")]
    Facing {
        /// What was asked for, mm.
        value_mm: f64,
        /// Greatest accepted one, mm.
        greatest_mm: f64,
    },
    /// A rim too narrow to hold, or wider than the exit face.
    #[error(
        "the rim is {width_mm} mm wide; it must lie between {least_mm} mm and {greatest_mm} mm, the shorter side of the exit face"
    )]
    RimWidth {
        /// Its width, mm.
        width_mm: f64,
        /// Least accepted width, mm.
        least_mm: f64,
        /// Greatest accepted width, mm.
        greatest_mm: f64,
    },
    /// A rim whose plane cuts the border of the exit face, or a flange without thickness.
    #[error(
        "the plane of the rim lies {rise_mm} mm above the highest point of the exit face, and would meet the border of the face or the entry face: take at least {raised_mm:.2} mm for a rim that stands above the face, or {lowered_mm:.2} mm to {lowest_mm:.2} mm for a flange below it"
    )]
    RimHeight {
        /// Its plane above the highest point, mm.
        rise_mm: f64,
        /// Least height of a raised rim, mm.
        raised_mm: f64,
        /// Greatest height of a flange, mm.
        lowered_mm: f64,
        /// Least height of a flange, mm.
        lowest_mm: f64,
    },
    /// A mark that the rim cannot hold.
    #[error(
        "the mark cuts {mark_mm} mm off the corner of the rim; it must lie between {least_mm} mm and {greatest_mm} mm, the width of the rim"
    )]
    Mark {
        /// Its length, mm.
        mark_mm: f64,
        /// Least accepted length, mm.
        least_mm: f64,
        /// Greatest accepted length, mm.
        greatest_mm: f64,
    },
}
