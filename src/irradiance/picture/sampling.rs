//! OpenEXR channels with fewer samples than pixels, as those of luminance and chroma. The `exr`
//! crate can unpack them, but refuses the heads of such files; so it is shown a head without them.

use super::blocks;
use ::exr::{
    block::{UncompressedBlock, chunk::Chunk},
    error::Result,
    math::Vec2,
    meta::MetaData,
};

const ATTRIBUTES: usize = 8;
const CHANNEL_LIST: &[u8] = b"chlist";

/// How many pixels apart the samples of channels are, by the number of the channel in a file of one
/// part.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Sampling(Vec<Option<Vec2<usize>>>);

impl Sampling {
    /// Takes the sampling out of a file's head, so that every channel seems to have a sample for
    /// every pixel.
    pub(super) fn take(bytes: &mut [u8]) -> Self {
        Self::find(bytes).unwrap_or_default()
    }

    fn find(bytes: &mut [u8]) -> Option<Self> {
        let mut at = ATTRIBUTES;
        loop {
            let (_, kind_at) = text(bytes, at)?;
            let (kind, size_at) = text(bytes, kind_at)?;
            let is_list = kind == CHANNEL_LIST;
            let length = number(bytes, size_at)?;
            if is_list {
                return Self::of_list(bytes, size_at + 4);
            }
            at = (size_at + 4).checked_add(length)?;
        }
    }

    fn of_list(bytes: &mut [u8], mut at: usize) -> Option<Self> {
        let mut found = Vec::new();
        while *bytes.get(at)? != 0 {
            let (_, kind_at) = text(bytes, at)?;
            let sampling_at = kind_at + 8;
            let along = Vec2(number(bytes, sampling_at)?, number(bytes, sampling_at + 4)?);
            let usual = along == Vec2(1, 1);
            if !usual && along.0 > 0 && along.1 > 0 {
                for of in [sampling_at, sampling_at + 4] {
                    bytes[of..of + 4].copy_from_slice(&1_u32.to_le_bytes());
                }
                found.push(Some(along));
            } else {
                found.push(None);
            }
            at = sampling_at + 8;
        }
        Some(Self(found))
    }

    /// Puts it back into what was read of the head.
    pub(super) fn restore(&self, meta: &mut MetaData) {
        let Some(header) = meta.headers.first_mut() else { return };
        for (channel, sampling) in header.channels.list.iter_mut().zip(&self.0) {
            channel.sampling = sampling.unwrap_or(channel.sampling);
        }
    }

    /// Unpacks a chunk of a file whose head was restored.
    pub(super) fn unpack(&self, chunk: Chunk, meta: &mut MetaData) -> Result<UncompressedBlock> {
        if self.0.iter().any(Option::is_some) && chunk.layer_index == 0 {
            let header = &mut meta.headers[0];
            let block = header.get_block_data_indices(&chunk.compressed_block)?;
            let place = header.get_absolute_block_pixel_coordinates(block)?;
            let top = i64::from(header.own_attributes.layer_position.1) + i64::from(place.position.1);
            let bytes: usize = (top..top + place.size.1 as i64)
                .flat_map(|y| header.channels.list.iter().filter(move |of| y.rem_euclid(of.sampling.1 as i64) == 0))
                .map(|of| place.size.0 / of.sampling.0 * of.sample_type.bytes_per_sample())
                .sum();
            // What the crate expects a block to hold.
            header.channels.bytes_per_pixel = bytes / place.size.area().max(1);
        }
        if let Some(header) = meta.headers.get(chunk.layer_index) {
            blocks::check(&chunk, header)?;
        }
        UncompressedBlock::decompress_chunk(chunk, meta, false)
    }
}

/// A text that ends with a zero, and where what follows begins.
fn text(bytes: &[u8], at: usize) -> Option<(&[u8], usize)> {
    const MOST: usize = 256;
    let rest = bytes.get(at..)?;
    let length = rest.iter().take(MOST).position(|b| *b == 0)?;
    Some((&rest[..length], at + length + 1))
}

fn number(bytes: &[u8], at: usize) -> Option<usize> {
    let number = bytes.get(at..at.checked_add(4)?)?.first_chunk::<4>()?;
    usize::try_from(u32::from_le_bytes(*number)).ok()
}
