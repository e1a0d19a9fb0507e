//! Directories of tags, as TIFF files have them and EXIF borrows them.

/// The first directory of a TIFF structure: of a file, or of the EXIF in another.
pub(super) struct Directory<'a> {
    bytes: &'a [u8],
    little_endian: bool,
    /// BigTIFF: counts and offsets of eight bytes.
    big: bool,
    entries_at: usize,
    entries: usize,
}

/// `Orientation`.
pub(super) const ORIENTATION: u16 = 274;
/// An ICC profile.
pub(super) const PROFILE: u16 = 34675;

impl<'a> Directory<'a> {
    /// `None` if there is none, or it lies beyond the end.
    pub(super) fn first(bytes: &'a [u8]) -> Option<Self> {
        let little_endian = match bytes.get(..2)? {
            b"II" => true,
            b"MM" => false,
            _ => return None,
        };
        let mut found = Self { bytes, little_endian, big: false, entries_at: 0, entries: 0 };
        found.big = match found.number(2, 2)? {
            42 => false,
            43 => true,
            _ => return None,
        };
        let at = if found.big { found.number(8, 8)? } else { found.number(4, 4)? };
        let at = usize::try_from(at).ok()?;
        let counter = if found.big { 8 } else { 2 };
        found.entries = usize::try_from(found.number(at, counter)?).ok()?.min(bytes.len() / found.entry_length());
        found.entries_at = at.checked_add(counter)?;
        Some(found)
    }

    fn entry_length(&self) -> usize {
        if self.big { 20 } else { 12 }
    }

    /// An unsigned number of so many bytes.
    fn number(&self, at: usize, bytes: usize) -> Option<u64> {
        let raw = self.bytes.get(at..at.checked_add(bytes)?)?;
        let fold = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
        Some(if self.little_endian { raw.iter().rev().fold(0, fold) } else { raw.iter().fold(0, fold) })
    }

    /// Where the values of a tag lie, their size in bytes, and how many there are.
    fn find(&self, tag: u16) -> Option<(usize, usize, usize)> {
        let wide = if self.big { 8 } else { 4 };
        for k in 0..self.entries {
            let at = self.entries_at.checked_add(k * self.entry_length())?;
            if self.number(at, 2)? != u64::from(tag) {
                continue;
            }
            let size = match self.number(at + 2, 2)? {
                1 | 2 | 6 | 7 => 1,
                3 | 8 => 2,
                4 | 9 | 11 | 13 => 4,
                5 | 10 | 12 | 16 | 17 | 18 => 8,
                _ => return None,
            };
            let count = usize::try_from(self.number(at + 4, wide)?).ok()?;
            let inline = at + 4 + wide;
            let place = if count.checked_mul(size)? <= wide {
                inline
            } else {
                usize::try_from(self.number(inline, wide)?).ok()?
            };
            return Some((place, size, count));
        }
        None
    }

    /// A tag of one unsigned number, or the first of several.
    pub(super) fn value(&self, tag: u16) -> Option<u64> {
        let (at, size, count) = self.find(tag)?;
        if count == 0 { None } else { self.number(at, size) }
    }

    /// All unsigned numbers of a tag.
    pub(super) fn values(&self, tag: u16) -> Option<Vec<u64>> {
        let (at, size, count) = self.find(tag)?;
        // No more than the file has room for.
        self.bytes.get(at..at.checked_add(size.checked_mul(count)?)?)?;
        (0..count).map(|k| self.number(at + k * size, size)).collect()
    }

    /// The raw bytes of a tag.
    pub(super) fn raw(&self, tag: u16) -> Option<&'a [u8]> {
        let (at, size, count) = self.find(tag)?;
        self.bytes.get(at..at.checked_add(size.checked_mul(count)?)?)
    }

    /// How the stored picture is turned and mirrored, 1 to 8; a value out of range counts as 1.
    pub(super) fn orientation(&self) -> u8 {
        self.value(ORIENTATION).and_then(|value| u8::try_from(value).ok()).filter(|o| (1..=8).contains(o)).unwrap_or(1)
    }
}

/// The orientation that an EXIF block tells, 1 if it tells none. Some programs leave JPEG's
/// `Exif\0\0` in front.
pub(super) fn orientation_of_exif(exif: &[u8]) -> u8 {
    let exif = exif.strip_prefix(b"Exif\0\0").unwrap_or(exif);
    Directory::first(exif).map_or(1, |directory| directory.orientation())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exif(big_endian: bool, kind: u16, value: u32) -> Vec<u8> {
        let two = |n: u16| if big_endian { n.to_be_bytes() } else { n.to_le_bytes() };
        let four = |n: u32| if big_endian { n.to_be_bytes() } else { n.to_le_bytes() };
        let mut bytes = if big_endian { b"MM".to_vec() } else { b"II".to_vec() };
        bytes.extend(two(42));
        bytes.extend(four(8));
        bytes.extend(two(2));
        for (tag, value) in [(256_u16, 7), (ORIENTATION, value)] {
            bytes.extend(two(tag));
            bytes.extend(two(kind));
            bytes.extend(four(1));
            match kind {
                3 => {
                    bytes.extend(two(value as u16));
                    bytes.extend([0; 2]);
                }
                _ => bytes.extend(four(value)),
            }
        }
        bytes
    }

    #[test]
    fn orientations_are_found_in_both_byte_orders() {
        for value in 1..=8 {
            for (big_endian, kind) in [(true, 3), (false, 3), (true, 4), (false, 4)] {
                assert_eq!(u32::from(orientation_of_exif(&exif(big_endian, kind, value))), value);
            }
        }
        let led = [b"Exif\0\0".to_vec(), exif(true, 3, 6)].concat();
        assert_eq!(orientation_of_exif(&led), 6);
    }

    #[test]
    fn what_is_out_of_range_or_damaged_counts_as_upright() {
        for value in [0, 9, 65535] {
            assert_eq!(orientation_of_exif(&exif(false, 3, value)), 1);
        }
        let whole = exif(true, 3, 6);
        for length in 0..whole.len() {
            let _ = orientation_of_exif(&whole[..length]);
        }
        assert_eq!(orientation_of_exif(b""), 1);
    }
}
