//! A picture whose light is known by construction, and files of many kinds that hold it.
//!
//! The files are written here, byte by byte or by encoders that no reader of the project decodes
//! with, and never read back: what is right is known from the numbers of the chart alone.

// Every test binary uses its own part of this.
#![allow(dead_code)]

use image::{ExtendedColorType, ImageEncoder, codecs};
use std::io::{Cursor, Write as _};

/// Size of the chart. It has no symmetry: no turn and no mirror image of it is the same.
pub(crate) const NX: usize = 48;
pub(crate) const NY: usize = 32;

/// A letter F on the left, on the right above a wedge of six greys, below a ramp.
pub(crate) fn light(x: usize, y: usize) -> f64 {
    let letter = (4..8).contains(&x) && (4..28).contains(&y)
        || (8..20).contains(&x) && (4..8).contains(&y)
        || (8..16).contains(&x) && (14..18).contains(&y);
    match (x, y) {
        _ if letter => 1.0,
        (24..48, 0..16) => WEDGE[(x - 24) / 4],
        (24..48, 16..32) => (x - 23) as f64 / 24.0,
        _ => 0.1,
    }
}

/// The greys of the wedge, from the left.
pub(crate) const WEDGE: [f64; 6] = [0.05, 0.2, 0.35, 0.55, 0.75, 0.95];

/// A file, and how exactly it holds the chart.
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) extension: &'static str,
    pub(crate) bytes: Vec<u8>,
    /// Greatest error of any pixel that the file's own numbers leave.
    pub(crate) within: f64,
}

/// A pixel of the picture as it is stored for this orientation, by the tables of EXIF: where its
/// row 0 and column 0 are.
fn stored(orientation: u8, nx: usize, ny: usize, value: impl Fn(usize, usize) -> f64) -> (usize, usize, Vec<f64>) {
    let (columns, rows) = if orientation < 5 { (nx, ny) } else { (ny, nx) };
    let mut values = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            // Row 0 at the top, the bottom, the left or the right; column 0 likewise.
            let (x, y) = match orientation {
                1 => (column, row),
                2 => (nx - 1 - column, row),
                3 => (nx - 1 - column, ny - 1 - row),
                4 => (column, ny - 1 - row),
                5 => (row, column),
                6 => (nx - 1 - row, column),
                7 => (nx - 1 - row, ny - 1 - column),
                _ => (row, ny - 1 - column),
            };
            values.push(value(x, y));
        }
    }
    (columns, rows, values)
}

fn srgb(light: f64) -> f64 {
    if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

/// The chart on a curve, as bytes of grey.
fn bytes_of(orientation: u8, curve: impl Fn(f64) -> f64) -> (u32, u32, Vec<u8>) {
    let (nx, ny, values) = stored(orientation, NX, NY, light);
    (nx as u32, ny as u32, values.iter().map(|v| (255.0 * curve(*v)).round() as u8).collect())
}

/// The same as words.
fn words_of(curve: impl Fn(f64) -> f64) -> Vec<u16> {
    stored(1, NX, NY, light).2.iter().map(|v| (65535.0 * curve(*v)).round() as u16).collect()
}

fn rgb(grey: &[u8]) -> Vec<u8> {
    grey.iter().flat_map(|v| [*v; 3]).collect()
}

/// EXIF with nothing but an orientation.
fn exif(orientation: u8, big_endian: bool) -> Vec<u8> {
    if big_endian {
        [&b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0"[..], &[orientation], &[0; 6]].concat()
    } else {
        [&b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0"[..], &[orientation], &[0; 7]].concat()
    }
}

/// A PNG with these chunks in front of its pixels.
pub(crate) fn png(size: (u32, u32), depth: u8, kind: u8, rows: &[Vec<u8>], chunks: &[(&[u8; 4], Vec<u8>)]) -> Vec<u8> {
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut chunk = |name: &[u8; 4], data: &[u8]| {
        file.extend((data.len() as u32).to_be_bytes());
        let body = [&name[..], data].concat();
        file.extend(&body);
        file.extend(crc32(&body).to_be_bytes());
    };
    let head = [&size.0.to_be_bytes()[..], &size.1.to_be_bytes(), &[depth, kind, 0, 0, 0]].concat();
    chunk(b"IHDR", &head);
    chunks.iter().for_each(|(name, data)| chunk(name, data));
    let raw: Vec<u8> = rows.iter().flat_map(|row| std::iter::once(0).chain(row.iter().copied())).collect();
    chunk(b"IDAT", &zlib(&raw));
    chunk(b"IEND", &[]);
    file
}

/// Bytes as a stream of zlib whose blocks are stored as they are.
fn zlib(raw: &[u8]) -> Vec<u8> {
    let mut stream = vec![0x78, 0x01];
    let mut blocks = raw.chunks(65535).peekable();
    while let Some(block) = blocks.next() {
        stream.push(u8::from(blocks.peek().is_none()));
        stream.extend((block.len() as u16).to_le_bytes());
        stream.extend((!(block.len() as u16)).to_le_bytes());
        stream.extend(block);
    }
    let (a, b) = raw.iter().fold((1_u32, 0_u32), |(a, b), v| {
        let a = (a + u32::from(*v)) % 65521;
        (a, (a + b) % 65521)
    });
    stream.extend((b << 16 | a).to_be_bytes());
    stream
}

fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, byte: &u8| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
    };
    !bytes.iter().fold(!0, step)
}

fn grey_png(depth: u8, chunks: &[(&[u8; 4], Vec<u8>)], curve: impl Fn(f64) -> f64) -> Vec<u8> {
    let rows: Vec<Vec<u8>> = match depth {
        16 => words_of(curve).chunks(NX).map(|row| row.iter().flat_map(|v| v.to_be_bytes()).collect()).collect(),
        _ => bytes_of(1, curve).2.chunks(NX).map(<[u8]>::to_vec).collect(),
    };
    png((NX as u32, NY as u32), depth, 0, &rows, chunks)
}

/// A TIFF of one strip; `tags` are further ones of one number each, as type, count and value or
/// place.
pub(crate) fn tiff(
    (nx, ny): (u32, u32),
    [bits, samples, photometric]: [u16; 3],
    data: &[u8],
    tags: &[(u16, u16, u32, Vec<u8>)],
) -> Vec<u8> {
    let short = |v: u16| [&v.to_le_bytes()[..], &[0; 2]].concat();
    let long = |v: u32| v.to_le_bytes().to_vec();
    let each: Vec<u8> = (0..samples).flat_map(|_| bits.to_le_bytes()).collect();
    let mut entries = vec![
        (256, 4, 1, long(nx)),
        (257, 4, 1, long(ny)),
        (258, 3, u32::from(samples), each),
        (259, 3, 1, short(1)),
        (262, 3, 1, short(photometric)),
        (273, 4, 1, long(0)),
        (277, 3, 1, short(samples)),
        (278, 4, 1, long(ny)),
        (279, 4, 1, long(data.len() as u32)),
    ];
    entries.extend(tags.iter().cloned());
    entries.sort_by_key(|entry| entry.0);
    let directory = 8 + 2 + 12 * entries.len() + 4;
    let mut beyond = Vec::new();
    let mut file = b"II*\0\x08\0\0\0".to_vec();
    file.extend((entries.len() as u16).to_le_bytes());
    let outside: usize =
        entries.iter().map(|(.., data)| if data.len() > 4 { data.len().next_multiple_of(2) } else { 0 }).sum();
    for (tag, kind, count, value) in &entries {
        file.extend(tag.to_le_bytes());
        file.extend(kind.to_le_bytes());
        file.extend(count.to_le_bytes());
        if *tag == 273 {
            file.extend(((directory + outside) as u32).to_le_bytes());
        } else if value.len() > 4 {
            file.extend(((directory + beyond.len()) as u32).to_le_bytes());
            beyond.extend(value);
            beyond.resize(beyond.len().next_multiple_of(2), 0);
        } else {
            file.extend(value);
            file.resize(file.len() + 4 - value.len(), 0);
        }
    }
    file.extend([0; 4]);
    file.extend(beyond);
    file.extend(data);
    file
}

/// A profile with these tags; each is a name and its data.
pub(crate) fn profile(space: &[u8; 4], tags: &[(&[u8; 4], Vec<u8>)]) -> Vec<u8> {
    let mut bytes = vec![0; 128];
    bytes[8..12].copy_from_slice(&[4, 0x30, 0, 0]);
    bytes[12..16].copy_from_slice(b"mntr");
    bytes[16..20].copy_from_slice(space);
    bytes[20..24].copy_from_slice(b"XYZ ");
    bytes[36..40].copy_from_slice(b"acsp");
    // The illuminant: D50.
    for (at, v) in [(68, 0.9642), (72, 1.0), (76, 0.8249)] {
        bytes[at..at + 4].copy_from_slice(&fixed(v));
    }
    bytes.extend((tags.len() as u32).to_be_bytes());
    let mut at = 132 + 12 * tags.len();
    for (name, data) in tags {
        bytes.extend(*name);
        bytes.extend((at as u32).to_be_bytes());
        bytes.extend((data.len() as u32).to_be_bytes());
        at += data.len();
    }
    tags.iter().for_each(|(_, data)| bytes.extend(data));
    let length = bytes.len() as u32;
    bytes[..4].copy_from_slice(&length.to_be_bytes());
    bytes
}

fn fixed(v: f64) -> [u8; 4] {
    ((v * 65536.0).round() as i32).to_be_bytes()
}

fn numbers(kind: &[u8; 4], values: &[f64]) -> Vec<u8> {
    let mut tag = [&kind[..], &[0; 4]].concat();
    values.iter().for_each(|v| tag.extend(fixed(*v)));
    tag
}

/// A curve of one power.
fn power(gamma: f64) -> Vec<u8> {
    [&b"para\0\0\0\0\0\0\0\0"[..], &fixed(gamma)].concat()
}

/// A curve of 1024 samples.
fn samples(light: impl Fn(f64) -> f64) -> Vec<u8> {
    let mut tag = [&b"curv\0\0\0\0"[..], &1024_u32.to_be_bytes()].concat();
    (0..1024).for_each(|k| tag.extend(((65535.0 * light(f64::from(k) / 1023.0)).round() as u16).to_be_bytes()));
    tag
}

pub(crate) fn grey_profile(curve: Vec<u8>) -> Vec<u8> {
    profile(b"GRAY", &[(b"wtpt", numbers(b"XYZ ", &[0.9642, 1.0, 0.8249])), (b"kTRC", curve)])
}

/// Primaries of Adobe RGB (1998), adapted to D50 as Adobe prints them, with its curve.
pub(crate) fn rgb_profile(curve: &[u8]) -> Vec<u8> {
    profile(
        b"RGB ",
        &[
            (b"wtpt", numbers(b"XYZ ", &[0.9642, 1.0, 0.8249])),
            (b"rXYZ", numbers(b"XYZ ", &[0.60974, 0.31111, 0.01947])),
            (b"gXYZ", numbers(b"XYZ ", &[0.20528, 0.62567, 0.06087])),
            (b"bXYZ", numbers(b"XYZ ", &[0.14919, 0.06322, 0.74457])),
            (b"rTRC", curve.to_vec()),
            (b"gTRC", curve.to_vec()),
            (b"bTRC", curve.to_vec()),
        ],
    )
}

/// The profile as PNG holds it.
fn iccp(profile: &[u8]) -> Vec<u8> {
    [&b"profile\0\0"[..], &zlib(profile)].concat()
}

fn encode(write: impl FnOnce(&mut Cursor<Vec<u8>>) -> image::ImageResult<()>) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    write(&mut out).unwrap();
    out.into_inner()
}

/// Every case: formats, depths, kinds of colour, profiles, and all orientations of the formats that
/// have them.
pub(crate) fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    // Half a step of sRGB is 0.0045 where it is steepest; a step of 65535 is nothing.
    let mut add =
        |name: &str, extension, bytes, within| cases.push(Case { name: name.into(), extension, bytes, within });
    let (nx, ny, grey) = bytes_of(1, srgb);
    let colour = rgb(&grey);
    let (step, fine) = (0.0046, 2e-5);

    add("png, 8 bits", "png", grey_png(8, &[], srgb), step);
    add("png, 16 bits", "png", grey_png(16, &[], srgb), fine);
    let rows: Vec<Vec<u8>> = colour.chunks(3 * NX).map(<[u8]>::to_vec).collect();
    add("png, colours", "png", png((nx, ny), 8, 2, &rows, &[]), step);
    let palette: Vec<u8> = (0..=255).flat_map(|v| [v; 3]).collect();
    let rows: Vec<Vec<u8>> = grey.chunks(NX).map(<[u8]>::to_vec).collect();
    add("png, palette", "png", png((nx, ny), 8, 3, &rows, &[(b"PLTE", palette)]), step);
    // Light by alpha alone, on black: white, as much of it as there shall be light. Half a step is
    // 0.002, also of the ground that makes most of the mean.
    let veiled: Vec<Vec<u8>> = stored(1, NX, NY, light)
        .2
        .chunks(NX)
        .map(|row| row.iter().flat_map(|v| [255, (255.0 * v).round() as u8]).collect())
        .collect();
    add("png, white of different alpha", "png", png((nx, ny), 8, 4, &veiled, &[]), 0.004);

    let gamma = |v: u32| (b"gAMA", v.to_be_bytes().to_vec());
    add("png, gAMA 1", "png", grey_png(16, &[gamma(100_000)], |v| v), fine);
    add("png, gAMA 1/2.2", "png", grey_png(16, &[gamma(45455)], |v| v.powf(0.45455)), fine);
    add("png, sRGB beside gAMA", "png", grey_png(16, &[gamma(100_000), (b"sRGB", vec![0])], srgb), fine);
    add("png, cICP linear", "png", grey_png(16, &[(b"cICP", vec![1, 8, 0, 1])], |v| v), fine);
    let rec_709 = |v: f64| if v < 0.018_053_97 { 4.5 * v } else { 1.099_296_8 * v.powf(0.45) - 0.099_296_8 };
    add("png, cICP Rec. 709", "png", grey_png(16, &[(b"cICP", vec![1, 1, 0, 1])], rec_709), fine);
    let linear = iccp(&grey_profile(power(1.0)));
    add("png, linear grey profile", "png", grey_png(16, &[(b"iCCP", linear)], |v| v), fine);
    let sampled = iccp(&grey_profile(samples(|v| v * v)));
    add("png, sampled grey profile", "png", grey_png(16, &[(b"iCCP", sampled)], f64::sqrt), fine);
    let adobe = iccp(&rgb_profile(&power(2.2)));
    let (.., wide) = bytes_of(1, |v| v.powf(1.0 / 2.2));
    let rows: Vec<Vec<u8>> = rgb(&wide).chunks(3 * NX).map(<[u8]>::to_vec).collect();
    add("png, Adobe RGB", "png", png((nx, ny), 8, 2, &rows, &[(b"iCCP", adobe)]), step);

    let jpeg = |bytes: &[u8], kind, exif: Option<Vec<u8>>, icc: Option<Vec<u8>>, size: (u32, u32)| {
        encode(|out| {
            let mut encoder = codecs::jpeg::JpegEncoder::new_with_quality(out, 100);
            exif.map(|exif| encoder.set_exif_metadata(exif)).transpose().unwrap();
            icc.map(|icc| encoder.set_icc_profile(icc)).transpose().unwrap();
            encoder.write_image(bytes, size.0, size.1, kind)
        })
    };
    // Quality 100 rounds once more than 8 bits do.
    add("jpeg, grey", "jpg", jpeg(&grey, ExtendedColorType::L8, None, None, (nx, ny)), 0.02);
    add("jpeg, colours", "jpg", jpeg(&colour, ExtendedColorType::Rgb8, None, None, (nx, ny)), 0.02);
    let profile = grey_profile(power(1.8));
    let (.., curved) = bytes_of(1, |v| v.powf(1.0 / 1.8));
    add("jpeg, grey profile", "jpg", jpeg(&curved, ExtendedColorType::L8, None, Some(profile), (nx, ny)), 0.02);

    let webp = |bytes: &[u8], exif: Option<Vec<u8>>, size: (u32, u32)| {
        encode(|out| {
            let mut encoder = codecs::webp::WebPEncoder::new_lossless(out);
            exif.map(|exif| encoder.set_exif_metadata(exif)).transpose().unwrap();
            encoder.write_image(bytes, size.0, size.1, ExtendedColorType::Rgb8)
        })
    };
    add("webp", "webp", webp(&colour, None, (nx, ny)), step);
    add(
        "bmp",
        "bmp",
        encode(|out| codecs::bmp::BmpEncoder::new(out).encode(&colour, nx, ny, ExtendedColorType::Rgb8)),
        step,
    );
    add(
        "bmp, grey",
        "bmp",
        encode(|out| codecs::bmp::BmpEncoder::new(out).encode(&grey, nx, ny, ExtendedColorType::L8)),
        step,
    );
    let mut gif = Vec::new();
    codecs::gif::GifEncoder::new(&mut gif).encode(&colour, nx, ny, ExtendedColorType::Rgb8).unwrap();
    add("gif", "gif", gif, step);

    let header = |kind: &str, most: u32| format!("{kind}\n# a chart\n{NX} {NY}\n{most}\n").into_bytes();
    let text = |numbers: &[u8]| numbers.iter().map(|v| format!("{v}\n")).collect::<String>().into_bytes();
    let words: Vec<u8> = words_of(srgb).iter().flat_map(|v| v.to_be_bytes()).collect();
    add("pgm", "pgm", [header("P5", 255), grey.clone()].concat(), step);
    add("pgm, 16 bits", "pgm", [header("P5", 65535), words].concat(), fine);
    add("pgm, text", "pgm", [header("P2", 255), text(&grey)].concat(), step);
    add("ppm", "ppm", [header("P6", 255), colour.clone()].concat(), step);

    let word = |v: u16| (3, 1, [&v.to_le_bytes()[..], &[0; 2]].concat());
    let tag = |tag: u16, v: u16| {
        let (kind, count, data) = word(v);
        (tag, kind, count, data)
    };
    add("tiff, grey", "tif", tiff((nx, ny), [8, 1, 1], &grey, &[]), step);
    add("tiff, colours", "tif", tiff((nx, ny), [8, 3, 2], &colour, &[]), step);
    let inverted: Vec<u8> = grey.iter().map(|v| 255 - v).collect();
    add("tiff, white is zero", "tif", tiff((nx, ny), [8, 1, 0], &inverted, &[]), step);
    let floats: Vec<u8> = stored(1, NX, NY, light).2.iter().flat_map(|v| (*v as f32).to_le_bytes()).collect();
    add("tiff, floats", "tif", tiff((nx, ny), [32, 1, 1], &floats, &[tag(339, 3)]), 1e-6);
    let profile = grey_profile(power(1.0));
    let raw: Vec<u8> = words_of(|v| v).iter().flat_map(|v| v.to_le_bytes()).collect();
    let icc = (34675, 7, profile.len() as u32, profile);
    add("tiff, linear profile", "tif", tiff((nx, ny), [16, 1, 1], &raw, &[icc]), fine);
    let inks: Vec<u8> = grey.iter().flat_map(|v| [0, 0, 0, 255 - v]).collect();
    add("tiff, black ink of four", "tif", tiff((nx, ny), [8, 4, 5], &inks, &[]), step);

    // White is 4 here, and nothing is on a curve; the brightest pixel, of the letter, is what
    // counts.
    let exr = |names: &[&str]| {
        use exr::prelude::{
            AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, WritableImage,
        };
        let values: Vec<f32> = stored(1, NX, NY, light).2.iter().map(|v| 4.0 * *v as f32).collect();
        let channels = names.iter().map(|name| {
            let flat = if name.ends_with('A') {
                vec![1.0; NX * NY]
            } else if name.ends_with('Z') {
                vec![5.0; NX * NY]
            } else {
                values.clone()
            };
            AnyChannel::new(*name, FlatSamples::F32(flat))
        });
        let layer = Layer::new(
            (NX, NY),
            LayerAttributes::default(),
            Encoding::FAST_LOSSLESS,
            AnyChannels::sort(channels.collect()),
        );
        let mut out = Cursor::new(Vec::new());
        Image::from_layer(layer).write().to_buffered(&mut out).unwrap();
        out.into_inner()
    };
    add("exr", "exr", exr(&["R", "G", "B"]), 1e-6);
    add("exr, Y", "exr", exr(&["Y"]), 1e-6);
    add(
        "exr, a layer beside depth",
        "exr",
        exr(&["View.Combined.R", "View.Combined.G", "View.Combined.B", "View.Combined.A", "View.Depth.Z"]),
        1e-6,
    );

    let mut svg = Vec::new();
    write!(svg, "<?xml version=\"1.0\"?><svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {NX} {NY}\" shape-rendering=\"crispEdges\">").unwrap();
    // Rectangles of one grey: equal rows, and in them equal pixels.
    let mut y = 0;
    for rows in grey.chunks(NX).collect::<Vec<_>>().chunk_by(|one, next| one == next) {
        let mut x = 0;
        for run in rows[0].chunk_by(|one, next| one == next) {
            let (v, across, down) = (run[0], run.len(), rows.len());
            write!(svg, "<path fill=\"rgb({v},{v},{v})\" d=\"M{x} {y}h{across}v{down}h-{across}z\"/>").unwrap();
            x += across;
        }
        y += rows.len();
    }
    write!(svg, "</svg>").unwrap();
    add("svg", "svg", svg, step);

    for orientation in 1..=8 {
        let (nx, ny, grey) = bytes_of(orientation, srgb);
        let colour = rgb(&grey);
        let exif = |big| exif(orientation, big);
        add(
            &format!("jpeg, orientation {orientation}"),
            "jpg",
            jpeg(&grey, ExtendedColorType::L8, Some(exif(true)), None, (nx, ny)),
            0.02,
        );
        add(&format!("webp, orientation {orientation}"), "webp", webp(&colour, Some(exif(false)), (nx, ny)), step);
        let rows: Vec<Vec<u8>> = grey.chunks(nx as usize).map(<[u8]>::to_vec).collect();
        add(
            &format!("png, orientation {orientation}"),
            "png",
            png((nx, ny), 8, 0, &rows, &[(b"eXIf", exif(true))]),
            step,
        );
        add(
            &format!("tiff, orientation {orientation}"),
            "tif",
            tiff((nx, ny), [8, 1, 1], &grey, &[tag(274, u16::from(orientation))]),
            step,
        );
    }
    cases
}

/// Gives every chunk of a PNG its checksum.
pub(crate) fn mend_png(file: &mut [u8]) {
    let mut at = 8;
    while let Some(length) = file.get(at..at + 4).map(|b| u32::from_be_bytes([b[0], b[1], b[2], b[3]]) as usize) {
        let Some(end) = (at + 8).checked_add(length).filter(|end| end + 4 <= file.len()) else { return };
        let crc = crc32(&file[at + 4..end]).to_be_bytes();
        file[end..end + 4].copy_from_slice(&crc);
        at = end + 4;
    }
}
