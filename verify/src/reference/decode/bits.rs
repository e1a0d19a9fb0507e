//! Numbers in bytes.

use super::super::error::ReferenceError;

/// Bytes of which numbers are taken one after the other.
pub(super) struct Reader<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) at: usize,
    format: &'static str,
}

impl<'a> Reader<'a> {
    pub(super) fn new(bytes: &'a [u8], format: &'static str) -> Self {
        Self { bytes, at: 0, format }
    }

    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8], ReferenceError> {
        let taken = self.at.checked_add(count).and_then(|end| self.bytes.get(self.at..end));
        let taken = taken.ok_or_else(|| ReferenceError::malformed(self.format, "it ends too early"))?;
        self.at += count;
        Ok(taken)
    }

    pub(super) fn u8(&mut self) -> Result<u8, ReferenceError> {
        Ok(self.take(1)?[0])
    }

    pub(super) fn u16_le(&mut self) -> Result<u16, ReferenceError> {
        let b = self.take(2)?;
        Ok(u16::from_le_bytes([b[0], b[1]]))
    }

    pub(super) fn u32_le(&mut self) -> Result<u32, ReferenceError> {
        let b = self.take(4)?;
        Ok(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    }
}

/// The `k`-th of numbers of so many bits (1 to 16), packed from the highest bit of each byte on; 0
/// beyond the end.
pub(super) fn packed(row: &[u8], k: usize, bits: usize) -> u32 {
    let byte = |at: usize| u32::from(row.get(at).copied().unwrap_or(0));
    match bits {
        8 => byte(k),
        16 => byte(2 * k) << 8 | byte(2 * k + 1),
        _ => {
            let from = k * bits;
            let three = byte(from / 8) << 16 | byte(from / 8 + 1) << 8 | byte(from / 8 + 2);
            three >> (24 - from % 8 - bits) & ((1 << bits) - 1)
        }
    }
}

/// A number of so many bits as one of all bits of `T`'s: equal parts of the greatest.
pub(super) fn widened(value: u32, most: u32, full: u32) -> u32 {
    ((u64::from(value.min(most)) * u64::from(full) + u64::from(most) / 2) / u64::from(most)) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_numbers_of_any_width() {
        let row = [0b1011_0010, 0b0111_1000, 0xf0];
        assert_eq!((0..4).map(|k| packed(&row, k, 1)).collect::<Vec<_>>(), [1, 0, 1, 1]);
        assert_eq!((0..4).map(|k| packed(&row, k, 2)).collect::<Vec<_>>(), [2, 3, 0, 2]);
        assert_eq!((0..2).map(|k| packed(&row, k, 12)).collect::<Vec<_>>(), [0b1011_0010_0111, 0b1000_1111_0000]);
        assert_eq!(
            (packed(&row, 1, 8), packed(&row, 0, 16), packed(&row, 9, 8)),
            (0b0111_1000, 0b1011_0010_0111_1000, 0)
        );
        assert_eq!((widened(1, 3, 255), widened(31, 31, 255), widened(16, 31, 255)), (85, 255, 132));
    }
}
