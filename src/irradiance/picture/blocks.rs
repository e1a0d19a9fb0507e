//! What the blocks of an OpenEXR promise. The `exr` crate makes room for it, whatever that is, and a
//! program that is refused memory ends.

use ::exr::{
    block::chunk::{Chunk, CompressedBlock},
    compression::Compression,
    error::{Error, Result},
    meta::{BlockDescription, MetaData, header::Header},
};

/// Deflate packs no further.
const PER_BYTE: u64 = 1032;
/// What is not asked about, bytes: 256 lines of 8192 pixels, three channels of four bytes.
const SMALL: u64 = 24 << 20;

/// Checks that a file of so many bytes can hold one of its blocks.
///
/// # Errors
/// If it cannot.
pub(super) fn check_size(meta: &MetaData, length: usize) -> Result<()> {
    let most = SMALL.max(PER_BYTE.saturating_mul(length as u64));
    for header in &meta.headers {
        let (nx, ny) = match &header.blocks {
            BlockDescription::Tiles(tiles) => (tiles.tile_size.0, tiles.tile_size.1),
            BlockDescription::ScanLines => (header.layer_size.0, header.compression.scan_lines_per_block()),
        };
        let size = (nx as u64).saturating_mul(ny as u64).saturating_mul(header.channels.bytes_per_pixel as u64);
        if size > most {
            return Err(Error::Invalid(
                format!("its blocks are of {nx} x {ny} pixels, more than {length} bytes can hold").into(),
            ));
        }
    }
    Ok(())
}

/// Bytes of one of the counters that a block begins with, little-endian.
const COUNTER: usize = 8;
/// Where they tell, in bytes or in coefficients of two bytes, what is to be unpacked: channels as
/// they are, runs packed and unpacked, coefficients, and means of 8 x 8 (the struct
/// `DataSizesSingle` of OpenEXR's library).
const SIZES: [usize; 5] = [1, 6, 7, 8, 9];

/// Checks that a block does not promise more than twice what its samples take in whole squares of
/// 8 x 8, as floats.
///
/// # Errors
/// If it does.
pub(super) fn check(chunk: &Chunk, header: &Header) -> Result<()> {
    let (Compression::DWAA(_) | Compression::DWAB(_)) = header.compression else { return Ok(()) };
    let bytes = match &chunk.compressed_block {
        CompressedBlock::ScanLine(lines) => &lines.compressed_pixels_le,
        CompressedBlock::Tile(tile) => &tile.compressed_pixels_le,
        _ => return Ok(()),
    };
    let place = header.get_absolute_block_pixel_coordinates(header.get_block_data_indices(&chunk.compressed_block)?)?;
    let (nx, ny) = (place.size.0 as u64, place.size.1 as u64);
    // A block that does not become smaller is stored as it is.
    if bytes.len() as u64 == nx.saturating_mul(ny).saturating_mul(header.channels.bytes_per_pixel as u64) {
        return Ok(());
    }
    let samples =
        (nx.div_ceil(8) * 8).saturating_mul(ny.div_ceil(8) * 8).saturating_mul(header.channels.list.len() as u64);
    let most = samples.saturating_mul(2 * size_of::<f32>() as u64);
    let told = |k: &usize| Some(u64::from_le_bytes(*bytes.get(k * COUNTER..)?.first_chunk::<COUNTER>()?));
    match SIZES.iter().filter_map(told).find(|size| *size > most) {
        None => Ok(()),
        Some(size) => {
            Err(Error::Invalid(format!("a block promises {size} values, its pixels take no more than {most}").into()))
        }
    }
}
