//! What was found out, as lines of plain text: a terminal prints them as they are.

pub(crate) mod check;
pub(crate) mod coupon;
pub(crate) mod crosscheck;
pub(crate) mod design;
pub(crate) mod judgement;
pub(crate) mod mill;
pub(crate) mod preview;
pub(crate) mod program;
pub(crate) mod sweep;
pub(crate) mod tally;

use std::path::Path;

/// Puts a line at the end of a text.
macro_rules! put {
    ($text:ident, $($words:tt)*) => {{
        $text += &format!($($words)*);
        $text.push('\n');
    }};
}
use put;

/// Files in a row.
pub(crate) fn list<P: AsRef<Path>>(paths: &[P]) -> String {
    paths.iter().map(|path| path.as_ref().display().to_string()).collect::<Vec<_>>().join(", ")
}
