//! GIF: the first frame on its screen.

use super::{
    super::{
        colour::Meaning,
        error::ReferenceError,
        raster::{Alpha, Inks, Raster, Samples},
    },
    decoded::{Decoded, believe},
};

const NAME: &str = "GIF";
/// A code of 12 bits stands for 4096 pixels at most.
const PER_BYTE: usize = 4096;

pub(super) fn decode(bytes: &[u8]) -> Result<Decoded, ReferenceError> {
    let failed = |error: gif::DecodingError| ReferenceError::malformed(NAME, error);
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::Indexed);
    options.set_memory_limit(gif::MemoryLimit::Unlimited);
    let mut decoder = options.read_info(bytes).map_err(failed)?;
    let (nx, ny) = (usize::from(decoder.width()), usize::from(decoder.height()));
    believe(nx, ny, bytes.len(), PER_BYTE)?;
    let global = decoder.global_palette().map(<[u8]>::to_vec);
    let frame = decoder.next_frame_info().map_err(failed)?;
    let frame = frame.ok_or_else(|| ReferenceError::malformed(NAME, "it has no frame"))?;
    believe(usize::from(frame.width), usize::from(frame.height), bytes.len(), PER_BYTE)?;
    let (left, top) = (usize::from(frame.left), usize::from(frame.top));
    let (wide, transparent) = (usize::from(frame.width), frame.transparent);
    let palette = frame.palette.clone().or(global);
    let palette = palette.ok_or_else(|| ReferenceError::malformed(NAME, "it has no palette"))?;
    let mut indices = vec![0; decoder.buffer_size()];
    decoder.read_into_buffer(&mut indices).map_err(failed)?;
    // What the frame leaves free of the screen is transparent.
    let mut samples = vec![0; nx * ny * 4];
    for (line, row) in indices.chunks_exact(wide.max(1)).enumerate() {
        for (column, index) in row.iter().enumerate() {
            let (x, y) = (left + column, top + line);
            let colour = palette.get(3 * usize::from(*index)..).and_then(|rest| rest.get(..3));
            if let (true, Some(colour)) = (x < nx && y < ny && transparent != Some(*index), colour) {
                let pixel = &mut samples[4 * (y * nx + x)..][..4];
                pixel[..3].copy_from_slice(colour);
                pixel[3] = 255;
            }
        }
    }
    let raster = Raster { nx, ny, inks: Inks::Rgb, alpha: Alpha::Straight, samples: Samples::Bits8(samples) };
    Ok(Decoded::new(raster, None, Meaning::srgb()))
}
