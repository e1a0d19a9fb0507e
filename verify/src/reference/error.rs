//! Why a picture is no reference.

use std::path::PathBuf;

/// Why a picture cannot be judged by.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReferenceError {
    /// The file system refused.
    #[error("{} cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The content is that of no known kind of picture.
    #[error(
        "the verifier knows no such kind of picture: it reads PNG, JPEG, TIFF, WebP, BMP, GIF, PNM, OpenEXR and SVG; save it as one of them"
    )]
    UnknownFormat,
    /// A kind of picture that is not read.
    #[error("{format} is not read; convert it first: {remedy}")]
    Foreign {
        /// Name of the format.
        format: &'static str,
        /// A command that converts it.
        remedy: &'static str,
    },
    /// The file is damaged, or of a dialect that is not read.
    #[error("the verifier cannot read this {format}: {reason}; save it anew as an 8-bit or 16-bit sRGB PNG")]
    Malformed {
        /// Name of the format.
        format: &'static str,
        /// What is wrong.
        reason: String,
    },
    /// More pixels than a file of this length can hold.
    #[error(
        "the picture claims {width} x {height} pixels, more than a file of {length} bytes can hold (at most {most}): it is damaged; save it anew"
    )]
    Claims {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Length of the file, bytes.
        length: usize,
        /// Most pixels.
        most: usize,
    },
    /// No pixels.
    #[error("the picture has {width} x {height} pixels; at least one is needed")]
    Empty {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// Colour that is told in a way that is not read.
    #[error(
        "the picture's colour is told by {what}, which the verifier cannot judge by itself; convert it to sRGB first"
    )]
    Colour {
        /// What tells it.
        what: String,
    },
    /// Several layers hold colour.
    #[error("the picture has colour in several layers ({}); name one with --layer", names.join(", "))]
    Layers {
        /// Their names.
        names: Vec<String>,
    },
    /// The layer is not there.
    #[error("the picture has no colour in a layer '{name}'; it has it in {}", if names.is_empty() { "none".into() } else { names.join(", ") })]
    NoLayer {
        /// As asked for.
        name: String,
        /// The layers with colour.
        names: Vec<String>,
    },
    /// A value that is no light.
    #[error("the picture holds {value} in column {column}, row {row}; light is finite and not negative: mend the file")]
    Value {
        /// The value.
        value: f64,
        /// Column of the upright picture.
        column: usize,
        /// Row of the upright picture.
        row: usize,
    },
    /// Edges of the crop beyond the picture.
    #[error(
        "the crop {x},{y},{width},{height} (pixels) does not lie within the picture of {nx} x {ny} pixels; make it smaller (--crop)"
    )]
    Crop {
        /// Left edge.
        x: usize,
        /// Top edge.
        y: usize,
        /// Width.
        width: usize,
        /// Height.
        height: usize,
        /// Columns of the picture.
        nx: usize,
        /// Rows of the picture.
        ny: usize,
    },
    /// An option out of its range.
    #[error("{what} is {value}; it must be {must} ({flag})")]
    Option {
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Its range.
        must: &'static str,
        /// The flag to change.
        flag: &'static str,
    },
    /// The same light everywhere.
    #[error("the picture holds the same light everywhere ({cause}); there is nothing to draw: {remedy}")]
    Flat {
        /// What made it so.
        cause: &'static str,
        /// What to do.
        remedy: &'static str,
    },
}

impl ReferenceError {
    pub(super) fn malformed(format: &'static str, reason: impl ToString) -> Self {
        Self::Malformed { format, reason: reason.to_string() }
    }

    /// Whether the file could not be read at all, by its content or by the disk.
    pub fn is_unreadable(&self) -> bool {
        matches!(self, Self::Read { .. } | Self::UnknownFormat | Self::Malformed { .. } | Self::Claims { .. })
    }
}
