//! ICC profiles (ICC.1:2022): what a number means as luminance, for grey, for RGB with a matrix,
//! and by tables.

mod table;
mod values;

pub(super) use table::Table;

use super::{colour::Meaning, raster::Inks};
use glam::{DMat3, DVec3};
use values::{fixed, number, tone};

/// The white of the connection space.
const D50: DVec3 = DVec3::new(0.9642, 1.0, 0.8249);

/// A profile's bytes and its tags. Every number is big-endian.
#[derive(Clone, Copy)]
struct Profile<'a> {
    bytes: &'a [u8],
}

/// What a profile says of a picture with these inks; `None` if it cannot be read or is for others.
pub(super) fn read(bytes: &[u8], inks: Inks) -> Option<Meaning> {
    let profile = Profile { bytes };
    if bytes.get(36..40)? != b"acsp" {
        return None;
    }
    let space = bytes.get(16..20)?;
    let own = match space {
        b"GRAY" => Inks::Grey,
        b"RGB " => Inks::Rgb,
        b"CMYK" => Inks::Cmyk,
        _ => return None,
    };
    // A grey picture may have the profile of the screen that it is for.
    if own != inks && !(own == Inks::Rgb && inks == Inks::Grey) {
        return None;
    }
    let tables = profile.tag(b"A2B1").or_else(|| profile.tag(b"A2B0"));
    if let Some(table) = tables {
        return Some(Meaning::Table(Box::new(Table::read(table, own.count(), bytes.get(20..24)? == b"Lab ")?)));
    }
    match own {
        Inks::Grey => Some(Meaning::of(tone(profile.tag(b"kTRC")?)?.0, [1.0, 0.0, 0.0])),
        Inks::Rgb => profile.matrix(),
        Inks::Cmyk => None,
    }
}

impl<'a> Profile<'a> {
    fn tag(self, name: &[u8; 4]) -> Option<&'a [u8]> {
        let count = number(self.bytes, 128, 4)? as usize;
        let entry = self.bytes.get(132..)?.chunks_exact(12).take(count).find(|entry| entry[..4] == *name)?;
        let (at, length) = (number(entry, 4, 4)? as usize, number(entry, 8, 4)? as usize);
        self.bytes.get(at..at.checked_add(length)?)
    }

    fn xyz(self, name: &[u8; 4]) -> Option<DVec3> {
        let tag = self.tag(name).filter(|tag| tag.starts_with(b"XYZ "))?;
        Some(DVec3::new(fixed(tag, 8)?, fixed(tag, 12)?, fixed(tag, 16)?))
    }

    /// The adaptation from the profile's own white to D50.
    fn adaptation(self) -> Option<DMat3> {
        if let Some(chad) = self.tag(b"chad").filter(|tag| tag.starts_with(b"sf32")) {
            let m = (0..9).map(|k| fixed(chad, 8 + 4 * k)).collect::<Option<Vec<_>>>()?;
            return Some(DMat3::from_cols_slice(&m).transpose());
        }
        let Some(white) = self.xyz(b"wtpt").filter(|white| white.min_element() > 0.0) else {
            return Some(DMat3::IDENTITY);
        };
        let bradford = DMat3::from_cols(
            DVec3::new(0.8951, -0.7502, 0.0389),
            DVec3::new(0.2664, 1.7135, -0.0685),
            DVec3::new(-0.1614, 0.0367, 1.0296),
        );
        let gain = (bradford * D50) / (bradford * white);
        Some(bradford.inverse() * DMat3::from_diagonal(gain) * bradford)
    }

    fn matrix(self) -> Option<Meaning> {
        let adaptation = self.adaptation()?;
        if adaptation.determinant().abs() < 1e-9 {
            return None;
        }
        let own = adaptation.inverse();
        let weights = [b"rXYZ", b"gXYZ", b"bXYZ"].map(|name| self.xyz(name).map(|xyz| (own * xyz).y));
        let tones = [b"rTRC", b"gTRC", b"bTRC"].map(|name| self.tag(name).and_then(tone).map(|(tone, _)| tone));
        let [Some(r), Some(g), Some(b)] = tones else { return None };
        let [Some(wr), Some(wg), Some(wb)] = weights else { return None };
        let white = wr * r.light(1.0) + wg * g.light(1.0) + wb * b.light(1.0);
        let sound = white.is_finite() && white > 1e-6;
        sound.then(|| Meaning::Curves { tones: Box::new([r, g, b]), weights: [wr, wg, wb].map(|w| w / white) })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::reference::tone::Tone;

    /// A profile with these tags.
    pub(in crate::reference) fn profile(
        space: &[u8; 4],
        connection: &[u8; 4],
        tags: &[(&[u8; 4], Vec<u8>)],
    ) -> Vec<u8> {
        let mut bytes = vec![0; 128];
        bytes[16..20].copy_from_slice(space);
        bytes[20..24].copy_from_slice(connection);
        bytes[36..40].copy_from_slice(b"acsp");
        bytes.extend((tags.len() as u32).to_be_bytes());
        let mut at = 132 + 12 * tags.len();
        for (name, data) in tags {
            bytes.extend(*name);
            bytes.extend((at as u32).to_be_bytes());
            bytes.extend((data.len() as u32).to_be_bytes());
            at += data.len();
        }
        for (_, data) in tags {
            bytes.extend(data);
        }
        bytes
    }

    pub(in crate::reference) fn fixed_tag(name: &[u8; 4], values: &[f64]) -> Vec<u8> {
        let mut tag = [&name[..], &[0; 4]].concat();
        for value in values {
            tag.extend(((value * 65536.0).round() as i32).to_be_bytes());
        }
        tag
    }

    fn para(kind: u16, values: &[f64]) -> Vec<u8> {
        let mut tag = fixed_tag(b"para", values);
        tag.splice(8..8, [kind.to_be_bytes(), [0; 2]].concat());
        tag
    }

    /// sRGB as the ICC publishes it: colours adapted to D50, and the curve as parameters.
    #[test]
    fn the_profile_of_srgb_means_what_no_profile_means() {
        let curve = para(3, &[2.4, 1.0 / 1.055, 0.055 / 1.055, 1.0 / 12.92, 0.04045]);
        let chad =
            [1.047_882, 0.022_919, -0.050_201, 0.029_587, 0.990_479, -0.017_059, -0.009_247, 0.015_076, 0.751_678];
        let bytes = profile(
            b"RGB ",
            b"XYZ ",
            &[
                (b"rXYZ", fixed_tag(b"XYZ ", &[0.436_066, 0.222_488, 0.013_916])),
                (b"gXYZ", fixed_tag(b"XYZ ", &[0.385_147, 0.716_873, 0.097_076])),
                (b"bXYZ", fixed_tag(b"XYZ ", &[0.143_066, 0.060_608, 0.714_096])),
                (b"chad", fixed_tag(b"sf32", &chad)),
                (b"rTRC", curve.clone()),
                (b"gTRC", curve.clone()),
                (b"bTRC", curve),
            ],
        );
        let Some(Meaning::Curves { tones, weights }) = read(&bytes, Inks::Rgb) else { panic!("not read") };
        assert!(
            weights.iter().zip(crate::reference::colour::REC_709).all(|(a, b)| (a - b).abs() < 2e-4),
            "{weights:?}"
        );
        for v in [0.0, 0.02, 0.3, 1.0] {
            assert!((tones[1].light(v) - Tone::Srgb.light(v)).abs() < 2e-5);
        }
        assert!(read(&bytes, Inks::Grey).is_some(), "grey pictures for a screen");
        assert!(read(&bytes, Inks::Cmyk).is_none());
        for length in (0..bytes.len()).step_by(7) {
            let _ = read(&bytes[..length], Inks::Rgb);
        }
    }

    #[test]
    fn parametric_curves_of_all_five_kinds() {
        let of = |kind, values: &[f64], v: f64| tone(&para(kind, values)).unwrap().0.light(v);
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-4, "{a} is not {b}");
        near(of(0, &[2.0], 0.5), 0.25);
        near(of(1, &[2.0, 2.0, -0.5], 0.75), 1.0);
        near(of(1, &[2.0, 2.0, -0.5], 0.2), 0.0);
        near(of(2, &[2.0, 2.0, -0.5, 0.1], 0.2), 0.1);
        near(of(3, &[2.0, 1.0, 0.0, 0.5, 0.5], 0.4), 0.2);
        near(of(4, &[2.0, 1.0, 0.0, 0.5, 0.5, 0.1, 0.05], 0.6), 0.46);
        near(of(4, &[2.0, 1.0, 0.0, 0.5, 0.5, 0.1, 0.05], 0.4), 0.25);
        assert!(tone(&para(1, &[2.0, 0.0, 1.0])).is_none(), "it divides by 0");
    }
}
