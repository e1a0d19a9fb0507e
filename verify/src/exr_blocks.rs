//! What the blocks of an OpenEXR claim, asked before a library makes room for it.

use exr::{
    block::chunk::{Chunk, CompressedBlock},
    compression::Compression,
    error::{Error, UnitResult},
    math::Vec2,
    meta::{BlockDescription, header::Header},
};
use std::io::Cursor;

/// No packing of OpenEXR makes more of a byte than deflate does.
pub(crate) const MOST_PACKING: usize = 1032;

/// Blocks up to this size are believed of any file, bytes: 256 lines of 8192 pixels in three
/// channels of 32 bits.
const BELIEVED: usize = 24 << 20;

/// Refuses blocks that are larger than the file can hold, and blocks in DWA compression whose
/// counters promise more than their pixels can need: a library that makes room for what is promised
/// would end the program.
pub(crate) fn check(bytes: &[u8]) -> UnitResult {
    let reader = exr::block::read(Cursor::new(bytes), false)?;
    let headers = reader.headers().to_vec();
    let most = MOST_PACKING.saturating_mul(bytes.len()).max(BELIEVED);
    if headers.iter().any(|header| block_bytes(header) > most) {
        return Err(Error::Invalid("its blocks are larger than the file can hold".into()));
    }
    if !headers.iter().any(|header| matches!(header.compression, Compression::DWAA(_) | Compression::DWAB(_))) {
        return Ok(());
    }
    // What cannot be read is told of by whoever reads the file.
    let whole = Vec2(0, 0);
    for chunk in reader.filter_chunks(false, |_, tile, _| tile.level_index == whole)?.flatten() {
        let header = headers.get(chunk.layer_index);
        if header.is_some_and(|header| promises_too_much(&chunk, header).unwrap_or(false)) {
            return Err(Error::Invalid("a DWA block promises more than its pixels can need".into()));
        }
    }
    Ok(())
}

/// The bytes of an unpacked block, for which the library makes room before it sees one.
fn block_bytes(header: &Header) -> usize {
    let (nx, ny) = match header.blocks {
        BlockDescription::Tiles(tiles) => (tiles.tile_size.0, tiles.tile_size.1),
        BlockDescription::ScanLines => (header.layer_size.0, header.compression.scan_lines_per_block()),
    };
    nx.saturating_mul(ny).saturating_mul(header.channels.bytes_per_pixel)
}

/// Whether a DWA block does; nothing if that cannot be told.
///
/// It begins with eleven counters of eight bytes, little-endian, unless it is as it was unpacked.
/// Some are the sizes of what is unpacked, in bytes or in coefficients of two bytes
/// (`internal_dwa_compressor.h` of OpenEXR): none is above the bytes of its pixels in whole blocks
/// of 8 x 8 by more than runs cost that are shorter than their mark.
fn promises_too_much(chunk: &Chunk, header: &Header) -> Option<bool> {
    const UNPACKED: [usize; 5] = [1, 6, 7, 8, 9];
    let (Compression::DWAA(_) | Compression::DWAB(_)) = header.compression else { return None };
    let packed = match &chunk.compressed_block {
        CompressedBlock::ScanLine(block) => &block.compressed_pixels_le,
        CompressedBlock::Tile(block) => &block.compressed_pixels_le,
        _ => return None,
    };
    let tile = header.get_block_data_indices(&chunk.compressed_block).ok()?;
    let size = header.get_absolute_block_pixel_coordinates(tile).ok()?.size;
    if packed.len() == size.area().checked_mul(header.channels.bytes_per_pixel)? {
        return None;
    }
    let in_blocks = |n: usize| n.checked_next_multiple_of(8);
    let samples = in_blocks(size.0)?.checked_mul(in_blocks(size.1)?)?.checked_mul(header.channels.list.len())?;
    let most = samples.checked_mul(2 * size_of::<f32>())? as u64;
    let counters = packed.as_chunks::<8>().0;
    Some(UNPACKED.iter().filter_map(|k| counters.get(*k)).any(|counter| u64::from_le_bytes(*counter) > most))
}
