//! Why a picture cannot be used, each time in one sentence with the remedy.

use std::io;

/// Why a picture cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// The file cannot be read.
    #[error("the picture cannot be read: {0}")]
    Io(io::Error),
    /// The file is empty.
    #[error("the file is empty")]
    Empty,
    /// The file is of no kind that is known.
    #[error(
        "the file is no picture of a kind that is read (PNG, JPEG, TIFF, WebP, BMP, GIF, PNM, OpenEXR, SVG): save it as PNG"
    )]
    Unknown,
    /// The file is of a kind that is known and not read.
    #[error("{kind} files are not read: convert it first, for instance with '{command}'")]
    Foreign {
        /// The kind.
        kind: &'static str,
        /// What makes a picture of it that is read.
        command: &'static str,
    },
    /// The file is broken, or of a variety that is not read.
    #[error("the {kind} file is broken or of an unusual kind: {says}")]
    Broken {
        /// What it is otherwise.
        kind: &'static str,
        /// What its decoder says.
        says: String,
    },
    /// Colours that are described by numbers without a meaning here.
    #[error("the cICP chunk of the PNG file names {what}; save it as sRGB, or say how to read it")]
    Coded {
        /// What it names.
        what: String,
    },
    /// Several layers, and none of them asked for.
    #[error("the OpenEXR file has several layers of colour, {known}: choose one")]
    Layers {
        /// The layers.
        known: String,
    },
    /// No layer of that name.
    #[error("the OpenEXR file has no layer '{asked}'; it has {known}")]
    NoLayer {
        /// What was asked for.
        asked: String,
        /// What there is.
        known: String,
    },
    /// Depth, ids and the like alone.
    #[error("the OpenEXR file has no layer of colour (R, G, B or Y); its channels are {known}: choose one")]
    NoColour {
        /// The channels.
        known: String,
    },
    /// A layer was asked for where there are none.
    #[error("the layer '{asked}' was asked for, and the picture is {kind}: only OpenEXR files have layers")]
    NotLayered {
        /// What was asked for.
        asked: String,
        /// What the picture is.
        kind: &'static str,
    },
    /// A drawing that is not drawn.
    #[error("the SVG file {what}")]
    Drawing {
        /// What it has.
        what: String,
    },
    /// A part that is not in the picture.
    #[error(
        "the part that is cut out is {width} x {height} pixels from column {x}, row {y}, and the picture has {nx} x {ny}: the part must lie within it and have at least {least} pixels along each side"
    )]
    Crop {
        /// First column.
        x: usize,
        /// First row.
        y: usize,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Columns of the picture.
        nx: usize,
        /// Rows of the picture.
        ny: usize,
        /// Least number of either.
        least: usize,
    },
    /// The same light everywhere.
    #[error("the picture is the same light everywhere, so that there is nothing to draw: {why}")]
    Flat {
        /// What made it so.
        why: String,
    },
    /// A number that is not a light.
    #[error("the pixel at column {column}, row {row} is {value}; light is finite and never negative")]
    Value {
        /// Column of the pixel.
        column: usize,
        /// Row of the pixel, 0 on top.
        row: usize,
        /// Its value.
        value: f64,
    },
    /// More memory than was allowed.
    #[error(
        "the picture has {width} x {height} pixels, which take {} MB of memory to read, and {} MB are allowed: make it smaller",
        needed.div_ceil(1 << 20), allowed >> 20
    )]
    Memory {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Bytes that it takes.
        needed: u64,
        /// Bytes that it may take.
        allowed: u64,
    },
    /// Too few or too many pixels.
    #[error("the picture has {width} x {height} pixels; it needs between {least} and {greatest} along each side")]
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Least number of either.
        least: usize,
        /// Greatest number of either.
        greatest: usize,
    },
}

impl PictureError {
    pub(super) fn broken(kind: &'static str, says: &dyn std::fmt::Display) -> Self {
        Self::Broken { kind, says: says.to_string() }
    }

    /// Whether the file itself is at fault, and not what is asked of it.
    pub fn is_of_the_file(&self) -> bool {
        matches!(
            self,
            Self::Io(_)
                | Self::Empty
                | Self::Unknown
                | Self::Foreign { .. }
                | Self::Broken { .. }
                | Self::Drawing { .. }
        )
    }
}
