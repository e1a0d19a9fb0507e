//! Numbers from the buffers of a glTF file, none of whose counts are believed.

use super::{buffers::Buffers, fault::malformed};
use crate::load::error::LoadError;
use gltf::{
    Accessor,
    accessor::{DataType, Dimensions, sparse::IndexType},
    buffer::View,
};

/// The vectors of an accessor, quantised ones as the numbers that they stand for.
pub(super) fn values<const N: usize>(
    accessor: &Accessor<'_>,
    buffers: &Buffers<'_>,
    types: &[DataType],
) -> Result<Vec<[f64; N]>, LoadError> {
    let (kind, shape) = (accessor.data_type(), accessor.dimensions());
    let expected = if N == 1 { Dimensions::Scalar } else { Dimensions::Vec3 };
    if shape != expected || !types.contains(&kind) {
        return Err(malformed(format!(
            "accessor {} holds {shape:?} of {kind:?} where others belong",
            accessor.index()
        )));
    }
    let scale = if accessor.normalized() { step(kind) } else { 1.0 };
    let vector = |bytes: &[u8]| -> [f64; N] {
        std::array::from_fn(|k| {
            let value = scale * number(kind, &bytes[k * kind.size()..]);
            if accessor.normalized() { value.max(-1.0) } else { value }
        })
    };
    let outside = || malformed(format!("accessor {} does not fit into the file", accessor.index()));
    let (count, size) = (accessor.count(), accessor.size());
    let mut found = match accessor.view() {
        Some(view) => {
            let items = Items::of(&view, accessor.offset(), count, size, buffers).ok_or_else(outside)?;
            items.iter().map(vector).collect()
        }
        // The reader's allowance has been asked for so many.
        None => vec![[0.0; N]; count],
    };
    if let Some(sparse) = accessor.sparse() {
        let (places, replaced) = (sparse.indices(), sparse.values());
        let kind = match places.index_type() {
            IndexType::U8 => DataType::U8,
            IndexType::U16 => DataType::U16,
            IndexType::U32 => DataType::U32,
        };
        let at =
            Items::of(&places.view(), places.offset(), sparse.count(), kind.size(), buffers).ok_or_else(outside)?;
        let of = Items::of(&replaced.view(), replaced.offset(), sparse.count(), size, buffers).ok_or_else(outside)?;
        for (at, of) in at.iter().zip(of.iter()) {
            *found.get_mut(number(kind, at) as usize).ok_or_else(outside)? = vector(of);
        }
    }
    Ok(found)
}

/// What one step of a normalised whole number stands for.
fn step(kind: DataType) -> f64 {
    match kind {
        DataType::I8 => 1.0 / 127.0,
        DataType::U8 => 1.0 / 255.0,
        DataType::I16 => 1.0 / 32_767.0,
        DataType::U16 => 1.0 / 65_535.0,
        DataType::U32 | DataType::F32 => 1.0,
    }
}

fn number(kind: DataType, bytes: &[u8]) -> f64 {
    match (kind, bytes) {
        (DataType::I8, &[a, ..]) => i8::from_le_bytes([a]).into(),
        (DataType::U8, &[a, ..]) => a.into(),
        (DataType::I16, &[a, b, ..]) => i16::from_le_bytes([a, b]).into(),
        (DataType::U16, &[a, b, ..]) => u16::from_le_bytes([a, b]).into(),
        (DataType::U32, &[a, b, c, d, ..]) => u32::from_le_bytes([a, b, c, d]).into(),
        (DataType::F32, &[a, b, c, d, ..]) => f32::from_le_bytes([a, b, c, d]).into(),
        _ => f64::NAN,
    }
}

/// Items of equal size in a part of a buffer.
struct Items<'a> {
    bytes: &'a [u8],
    count: usize,
    size: usize,
    stride: usize,
}

impl<'a> Items<'a> {
    /// `None` if they are not all there.
    fn of(view: &View<'_>, offset: usize, count: usize, size: usize, buffers: &'a Buffers<'_>) -> Option<Self> {
        let buffer = buffers.get(view.buffer().index())?;
        let bytes = buffer.get(view.offset()..view.offset().checked_add(view.length())?)?.get(offset..)?;
        let stride = view.stride().unwrap_or(size);
        let last = count.checked_sub(1)?.checked_mul(stride)?;
        let fits = stride >= size && last.checked_add(size)? <= bytes.len();
        fits.then_some(Self { bytes, count, size, stride })
    }

    fn iter(&self) -> impl Iterator<Item = &'a [u8]> {
        let (bytes, size, stride) = (self.bytes, self.size, self.stride);
        (0..self.count).map(move |k| &bytes[k * stride..k * stride + size])
    }
}
