//! Long texts, formatted on all cores.

use rayon::prelude::*;
use std::{
    io::{self, Write},
    ops::Range,
};

/// Formats pieces in parallel and writes them in order, so that neither the text as a whole nor more than a few MB of it is
/// ever held.
pub(super) fn in_order(
    writer: &mut impl Write,
    items: Range<usize>,
    format: impl Fn(&mut Vec<u8>, usize) + Sync,
) -> io::Result<()> {
    const PIECE: usize = 1 << 12;
    const PIECES: usize = 1 << 5;
    let formatted = |start: usize| -> Vec<Vec<u8>> {
        let piece = |k: usize| {
            let mut text = Vec::with_capacity(PIECE * 40);
            for item in start + k * PIECE..items.end.min(start + (k + 1) * PIECE) {
                format(&mut text, item);
            }
            text
        };
        (0..PIECES).into_par_iter().map(piece).collect()
    };
    let mut texts = formatted(items.start);
    let mut start = items.start;
    while start < items.end {
        start += PIECE * PIECES;
        let mut next = Vec::new();
        // The next ones are made while these are written.
        rayon::in_place_scope(|scope| {
            scope.spawn(|_| next = formatted(start));
            texts.iter().try_for_each(|text| writer.write_all(text))
        })?;
        texts = next;
    }
    Ok(())
}

/// The shortest decimal that reads back as the same number, without an exponent: not every reader takes one.
pub(super) fn plain_decimal(text: &mut Vec<u8>, value: f32) {
    let mut buffer = zmij::Buffer::new();
    let shortest = buffer.format_finite(value);
    if shortest.contains('e') {
        text.extend_from_slice(value.to_string().as_bytes());
    } else {
        text.extend_from_slice(shortest.strip_suffix(".0").unwrap_or(shortest).as_bytes());
    }
}
