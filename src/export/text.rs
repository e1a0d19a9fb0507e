//! Long texts, formatted on all cores.

use rayon::prelude::*;
use std::{
    io::{self, Write},
    ops::Range,
};

/// Formats items in parallel and writes them in order, so that neither the text as a whole nor more
/// than a few MB of it is ever held.
pub(super) fn in_order(
    writer: &mut impl Write,
    items: Range<usize>,
    format: impl Fn(&mut Vec<u8>, usize) + Sync,
) -> io::Result<()> {
    in_pieces(writer, items, |text, items| items.for_each(|item| format(text, item)))
}

/// The same for what is best formatted several at a time.
pub(super) fn in_pieces(
    writer: &mut impl Write,
    items: Range<usize>,
    format: impl Fn(&mut Vec<u8>, Range<usize>) + Sync,
) -> io::Result<()> {
    const PIECE: usize = 1 << 12;
    const PIECES: usize = 1 << 5;
    let write_pieces = |texts: &mut [Vec<u8>], start: usize| {
        texts.par_iter_mut().enumerate().for_each(|(k, text)| {
            text.clear();
            format(text, start + k * PIECE..items.end.min(start + (k + 1) * PIECE));
        });
    };
    // The same memory again and again: what is new to a process takes more time than formatting.
    let room = || (0..PIECES).map(|_| Vec::with_capacity(PIECE * 64)).collect::<Vec<_>>();
    let (mut texts, mut next) = (room(), room());
    write_pieces(&mut texts, items.start);
    let mut start = items.start;
    while start < items.end {
        start += PIECE * PIECES;
        // The next ones are made while these are written.
        rayon::in_place_scope(|scope| {
            scope.spawn(|_| write_pieces(&mut next, start));
            texts.iter().try_for_each(|text| writer.write_all(text))
        })?;
        std::mem::swap(&mut texts, &mut next);
    }
    Ok(())
}

/// The shortest decimal that reads back as the same number, without an exponent: not every reader
/// takes one.
pub(super) fn plain_decimal(text: &mut Vec<u8>, value: f32) {
    let mut buffer = zmij::Buffer::new();
    let shortest = buffer.format_finite(value);
    // None of common magnitude has one.
    let may_have_one = !(1e-3..1e3).contains(&value.abs());
    if may_have_one && shortest.contains('e') {
        text.extend_from_slice(value.to_string().as_bytes());
    } else {
        text.extend_from_slice(shortest.strip_suffix(".0").unwrap_or(shortest).as_bytes());
    }
}
