//! The designer and the verifier each read pictures by code of their own. Both are given the same
//! files, of any size and kind, and the same frames; what they make of them must be the same light.

#[path = "common/chart.rs"]
mod chart;

use glasswarp::irradiance::{
    self, Background, Edits, Framing, PictureOptions, Rotation, TargetIrradiance, Transfer, Vignette, to_picture_order,
};
use glasswarp_verify::{
    Image, metrics,
    reference::{self, Crop, Flip, Frame, Levels, Measure, ReadOptions, Reference, Turn},
};
use image::{ExtendedColorType, ImageEncoder, codecs};
use proptest::prelude::*;
use std::io::Cursor;

/// A kind of file.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Png8,
    Png16,
    PngBits(u8),
    PngPalette,
    Jpeg,
    WebP,
    Bmp,
    Gif,
    Pnm,
    Tiff8,
    Tiff16,
    TiffFloat,
}

/// What a file says of itself beside its numbers; PNG only, but for the orientation, which TIFF
/// tells too.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Dress {
    Plain,
    Gamma(u32),
    Primaries,
    Orientation(u8),
}

#[derive(Clone, Debug)]
struct Sample {
    kind: Kind,
    dress: Dress,
    size: (usize, usize),
    /// 1 to 4.
    channels: usize,
    seed: u64,
    transfer: Option<Transfer>,
    margin: f64,
    vignette: Option<f64>,
    offset: f64,
    /// Pixels from the left and the top, and shares of the sides in percent.
    crop: Option<([usize; 2], [u8; 2])>,
    quarters: usize,
    flip: Option<bool>,
    levels: Option<[f64; 3]>,
    invert: bool,
    background: Option<[u8; 3]>,
}

fn samples() -> impl Strategy<Value = Sample> {
    let kind = prop_oneof![
        Just(Kind::Png8),
        Just(Kind::Png16),
        prop_oneof![Just(1_u8), Just(2), Just(4)].prop_map(Kind::PngBits),
        Just(Kind::PngPalette),
        Just(Kind::Jpeg),
        Just(Kind::WebP),
        Just(Kind::Bmp),
        Just(Kind::Gif),
        Just(Kind::Pnm),
        Just(Kind::Tiff8),
        Just(Kind::Tiff16),
        Just(Kind::TiffFloat),
    ];
    let dress = prop_oneof![
        4 => Just(Dress::Plain),
        1 => (20_000..250_000_u32).prop_map(Dress::Gamma),
        1 => Just(Dress::Primaries),
        1 => (1..=8_u8).prop_map(Dress::Orientation),
    ];
    let transfer = prop_oneof![2 => Just(None), 1 => Just(Some(Transfer::Srgb)), 1 => Just(Some(Transfer::Linear))];
    let frame = (prop_oneof![Just(0.0), 0.0..0.45], proptest::option::of(0.0..1.0));
    let edits = (
        proptest::option::of(([0..4_usize, 0..4_usize], [40..50_u8, 40..50_u8])),
        0..4_usize,
        proptest::option::of(any::<bool>()),
        proptest::option::of((0.0..0.3, 0.5..1.0, 0.5..2.0).prop_map(|(black, white, gamma)| [black, white, gamma])),
        any::<bool>(),
        proptest::option::of(any::<[u8; 3]>()),
    );
    let what = (kind, dress, (20..48_usize, 20..48_usize), 1..=4_usize);
    (what, any::<u64>(), transfer, frame, 0.0..1.0, edits).prop_map(
        |(
            (kind, dress, size, channels),
            seed,
            transfer,
            (margin, vignette),
            offset,
            (crop, quarters, flip, levels, invert, background),
        )| Sample {
            kind,
            dress,
            size,
            channels,
            seed,
            transfer,
            margin,
            vignette,
            offset,
            crop,
            quarters,
            flip,
            levels,
            invert,
            background,
        },
    )
}

impl Sample {
    /// Numbers from 0 to 1 that look like noise, with a slope across them: no turn and no mirror
    /// image is alike.
    fn number(&self, x: usize, y: usize, channel: usize) -> f64 {
        let mut word = self.seed ^ ((x * 8191 + y * 131 + channel) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        word = (word ^ word >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let noise = (word >> 40) as f64 / f64::from(1 << 24);
        let slope = x as f64 / self.size.0 as f64 + 0.5 * y as f64 / self.size.1 as f64;
        (0.4 * noise + 0.4 * slope).min(1.0)
    }

    /// Rows of numbers of this many channels, as they are stored.
    fn rows<T>(&self, channels: usize, store: impl Fn(f64) -> T) -> Vec<Vec<T>> {
        let (nx, ny) = self.size;
        let row = |y| (0..nx * channels).map(|k| store(self.number(k / channels, y, k % channels))).collect();
        (0..ny).map(row).collect()
    }

    fn bytes(&self, channels: usize) -> Vec<u8> {
        self.rows(channels, |v| (255.0 * v).round() as u8).concat()
    }

    /// Channels that a kind of file can have.
    fn channels(&self) -> usize {
        match self.kind {
            Kind::PngBits(_) | Kind::PngPalette | Kind::TiffFloat => 1,
            Kind::Jpeg | Kind::Pnm if self.channels < 3 => 1,
            Kind::Jpeg | Kind::Pnm => 3,
            Kind::Gif => 4,
            Kind::WebP | Kind::Bmp => self.channels.max(3),
            Kind::Tiff8 | Kind::Tiff16 if self.channels.is_multiple_of(2) => self.channels - 1,
            _ => self.channels,
        }
    }

    fn png(&self, depth: u8, kind: u8, rows: &[Vec<u8>], palette: Option<Vec<u8>>) -> Vec<u8> {
        let mut chunks = Vec::new();
        match self.dress {
            Dress::Plain => {}
            Dress::Gamma(gamma) => chunks.push((b"gAMA", gamma.to_be_bytes().to_vec())),
            Dress::Primaries => {
                // Of a display with wide colours, and its white.
                let numbers = [31_270, 32_900, 68_000, 32_000, 26_500, 69_000, 15_000, 6_000_u32];
                chunks.push((b"cHRM", numbers.iter().flat_map(|v| v.to_be_bytes()).collect()));
            }
            Dress::Orientation(orientation) => chunks.push((
                b"eXIf",
                [&b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0"[..], &[orientation], &[0; 6]].concat(),
            )),
        }
        chunks.extend(palette.map(|palette| (b"PLTE", palette)));
        chart::png((self.size.0 as u32, self.size.1 as u32), depth, kind, rows, &chunks)
    }

    fn file(&self) -> Vec<u8> {
        let (nx, ny) = (self.size.0 as u32, self.size.1 as u32);
        let channels = self.channels();
        let of_png = [0, 4, 2, 6][channels - 1];
        let kind = [ExtendedColorType::L8, ExtendedColorType::La8, ExtendedColorType::Rgb8, ExtendedColorType::Rgba8]
            [channels - 1];
        let bytes = self.bytes(channels);
        let mut out = Cursor::new(Vec::new());
        let orientation = match self.dress {
            Dress::Orientation(orientation) => vec![(274, 3, 1, vec![orientation, 0, 0, 0])],
            _ => Vec::new(),
        };
        let photometric = if channels < 3 { 1 } else { 2 };
        match self.kind {
            Kind::Png8 => self.png(8, of_png, &self.rows(channels, |v| (255.0 * v).round() as u8), None),
            Kind::Png16 => {
                let rows = self.rows(channels, |v| ((65535.0 * v).round() as u16).to_be_bytes());
                self.png(16, of_png, &rows.iter().map(|row| row.concat()).collect::<Vec<_>>(), None)
            }
            Kind::PngBits(depth) => {
                let most = f64::from((1_u32 << depth) - 1);
                let rows = self.rows(1, |v| (most * v).round() as u8);
                let packed = |row: &Vec<u8>| {
                    let in_byte = usize::from(8 / depth);
                    let byte = |part: &[u8]| {
                        (0..in_byte).fold(0, |sum: u8, k| sum << depth | part.get(k).copied().unwrap_or(0))
                    };
                    row.chunks(in_byte).map(byte).collect()
                };
                self.png(depth, 0, &rows.iter().map(packed).collect::<Vec<_>>(), None)
            }
            Kind::PngPalette => {
                let palette = (0..=255_u8).flat_map(|v| [v, v / 2 + 60, 255 - v / 3]).collect();
                self.png(8, 3, &self.rows(1, |v| (255.0 * v).round() as u8), Some(palette))
            }
            Kind::Jpeg => {
                codecs::jpeg::JpegEncoder::new_with_quality(&mut out, 90).write_image(&bytes, nx, ny, kind).unwrap();
                out.into_inner()
            }
            Kind::WebP => {
                codecs::webp::WebPEncoder::new_lossless(&mut out).write_image(&bytes, nx, ny, kind).unwrap();
                out.into_inner()
            }
            Kind::Bmp => {
                codecs::bmp::BmpEncoder::new(&mut out).encode(&bytes, nx, ny, kind).unwrap();
                out.into_inner()
            }
            Kind::Gif => {
                let mut out = Vec::new();
                codecs::gif::GifEncoder::new(&mut out).encode(&bytes, nx, ny, kind).unwrap();
                out
            }
            Kind::Pnm => {
                let header = format!("P{} {nx} {ny} 255\n", if channels == 1 { 5 } else { 6 });
                [header.into_bytes(), bytes].concat()
            }
            Kind::Tiff8 => chart::tiff((nx, ny), [8, channels as u16, photometric], &bytes, &orientation),
            Kind::Tiff16 => {
                let words = self.rows(channels, |v| ((65535.0 * v).round() as u16).to_le_bytes());
                chart::tiff((nx, ny), [16, channels as u16, photometric], words.concat().as_flattened(), &orientation)
            }
            Kind::TiffFloat => {
                let floats = self.rows(1, |v| (v as f32).to_le_bytes());
                let tags = [orientation, vec![(339, 3, 1, vec![3, 0, 0, 0])]].concat();
                chart::tiff((nx, ny), [32, 1, 1], floats.concat().as_flattened(), &tags)
            }
        }
    }

    /// The designer's reading.
    fn by_the_designer(&self, file: &[u8]) -> Result<Image, String> {
        let options = PictureOptions::default()
            .with_transfer(self.transfer)
            .with_background(self.background.map(Background::of))
            .with_edits(Edits {
                crop: self.crop.map(|([x, y], [w, h])| format!("{x},{y},{w}%,{h}%").parse().unwrap()),
                rotate: [None, Some(Rotation::Right), Some(Rotation::Half), Some(Rotation::Left)][self.quarters],
                flip: self.flip.map(|up| if up { irradiance::Flip::Vertical } else { irradiance::Flip::Horizontal }),
                levels: self.levels.map(|[black, white, gamma]| format!("{black},{white},{gamma}").parse().unwrap()),
                invert: self.invert,
            });
        let (picture, _) = options.read(Cursor::new(file)).map_err(|error| error.to_string())?;
        let vignette = self.vignette.map_or(Vignette::None, |soft| Vignette::Circle { soft });
        let framing = Framing::new(self.margin, vignette).map_err(|error| error.to_string())?;
        let framed = framing.apply(&picture).map_err(|error| error.to_string())?;
        let light = TargetIrradiance::from_picture(&framed, self.offset).map_err(|error| error.to_string())?;
        let cells = to_picture_order(light.cells());
        Ok(Image::new(cells.nx(), cells.ny(), cells.into_vec()))
    }

    /// The verifier's reading.
    fn by_the_verifier(&self, file: &[u8]) -> Result<Reference, String> {
        let mut options = ReadOptions::default();
        options.transfer = self.transfer.map(|transfer| match transfer {
            Transfer::Srgb => reference::Transfer::Srgb,
            Transfer::Linear => reference::Transfer::Linear,
        });
        options.frame = Frame { margin: self.margin, vignette: self.vignette };
        options.offset = self.offset;
        options.background = self.background;
        options.crop = self.crop.map(|([x, y], [w, h])| Crop {
            x: Measure::Pixels(x as f64),
            y: Measure::Pixels(y as f64),
            width: Measure::Share(f64::from(w) / 100.0),
            height: Measure::Share(f64::from(h) / 100.0),
        });
        options.turn = [None, Some(Turn::Quarter), Some(Turn::Half), Some(Turn::ThreeQuarters)][self.quarters];
        options.flip = self.flip.map(|up| if up { Flip::Vertical } else { Flip::Horizontal });
        options.levels = self.levels.map(|[black, white, gamma]| Levels { black, white, gamma });
        options.invert = self.invert;
        Reference::parse(file, &options).map_err(|error| error.to_string())
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    #[test]
    fn both_readers_see_the_same_light(sample in samples()) {
        let file = sample.file();
        let (theirs, own) = (sample.by_the_designer(&file), sample.by_the_verifier(&file));
        let (theirs, own) = match (theirs, own) {
            (Ok(theirs), Ok(own)) => (theirs, own),
            (Err(_), Err(_)) => return Ok(()),
            // The designer refuses what became flat later, where it knows what made it so.
            (Ok(_), Err(error)) if error.contains("the same light everywhere") => return Ok(()),
            (theirs, own) => return Err(TestCaseError::fail(format!(
                "the designer: {:?}; the verifier: {:?}", theirs.err(), own.err()
            ))),
        };
        prop_assert_eq!((own.light.nx, own.light.ny), (theirs.nx, theirs.ny));
        let apart = metrics::rel_rms(&own.light, &theirs).unwrap();
        prop_assert!(apart <= own.tolerance, "they are {apart} apart, {} is left to rounding", own.tolerance);
    }
}
