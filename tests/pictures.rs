//! Pictures of the kinds that people have, each against its light as numbers:
//! tests/pictures/list.tsv names them, tests/pictures/make.py made them and their light with other
//! encoders, from the formats' specifications.

use glasswarp::{
    grid::Field,
    irradiance::{Picture, PictureOptions, Transfer},
};
use std::{
    fs,
    path::{Path, PathBuf},
};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/pictures")
}

struct Entry {
    file: String,
    options: PictureOptions,
    outcome: String,
    tolerance: f64,
}

fn entries() -> Vec<Entry> {
    let list = fs::read_to_string(folder().join("list.tsv")).unwrap();
    let entry = |line: &str| {
        let [file, options, outcome, tolerance, _] = line.split('\t').collect::<Vec<_>>().try_into().unwrap();
        Entry {
            file: file.into(),
            options: options_of(options),
            outcome: outcome.into(),
            tolerance: tolerance.parse().unwrap(),
        }
    };
    list.lines().skip(1).map(entry).collect()
}

fn options_of(words: &str) -> PictureOptions {
    let mut options = PictureOptions::default();
    for (name, value) in words.split_whitespace().map(|word| word.split_once('=').unwrap()) {
        match name {
            "background" => options.background = Some(value.parse().unwrap()),
            "layer" => options.layer = Some(value.into()),
            "width" => options.drawing_width = value.parse().unwrap(),
            other => panic!("{other}"),
        }
    }
    options
}

fn light(name: &str) -> Field<f64> {
    let bytes = fs::read(folder().join(name)).unwrap();
    let words: Vec<[u8; 4]> = bytes.chunks_exact(4).map(|word| word.try_into().unwrap()).collect();
    let size = |k: usize| u32::from_le_bytes(words[k]) as usize;
    Field::from_vec(size(0), size(1), words[2..].iter().map(|word| f64::from(f32::from_le_bytes(*word))).collect())
}

/// The greatest difference, if the sizes are the same.
fn difference(a: &Field<f64>, b: &Field<f64>) -> f64 {
    if (a.nx(), a.ny()) != (b.nx(), b.ny()) {
        return f64::INFINITY;
    }
    a.as_slice().iter().zip(b.as_slice()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn every_kind_of_picture_is_the_light_that_its_format_says() {
    let (mut wrong, mut read, mut refused) = (Vec::new(), 0, 0);
    for entry in entries() {
        let found = entry.options.open(&folder().join(&entry.file));
        match (entry.outcome.strip_prefix("refused: "), found) {
            (Some(words), Err(error)) if error.to_string().contains(words) => refused += 1,
            (None, Ok((picture, _))) => {
                read += 1;
                let off = difference(picture.values(), &light(&entry.outcome));
                if off > entry.tolerance {
                    wrong.push(format!("{}: off by {off:.2e}, {:.0e} allowed", entry.file, entry.tolerance));
                }
            }
            (_, found) => {
                let found = found.map(|(_, understood)| understood.line()).map_err(|error| error.to_string());
                wrong.push(format!("{}: {found:?}, not {}", entry.file, entry.outcome));
            }
        }
    }
    eprintln!("{read} pictures read, {refused} refused by name");
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn what_was_not_plain_is_said() {
    for (file, words) in [
        ("turned6.jpg", "26 x 18 pixels, turned upright (EXIF orientation 6)"),
        ("turned3.tif", "26 x 18 pixels, turned upright (orientation 3)"),
        ("gama_linear.png", "26 x 18 pixels, linear light by its gAMA chunk"),
        ("icc_grey18.png", "26 x 18 pixels, by its ICC profile 'glass w'"),
        ("icc_broken.png", "26 x 18 pixels, its ICC profile is broken and was passed over"),
        ("combined.exr", "26 x 18 pixels, linear light, its brightest pixel white, layer 'ViewLayer.Combined'"),
        ("rgba8.png", "26 x 18 pixels, its transparent parts on black"),
        ("cicp_p3.png", "26 x 18 pixels, curve of sRGB, primaries of Display P3, by its cICP chunk"),
    ] {
        let (_, understood) = PictureOptions::default().open(&folder().join(file)).unwrap();
        assert_eq!(understood.line().as_deref(), Some(words), "{file}");
    }
    let (_, plain) = PictureOptions::default().open(&folder().join("rgb8.png")).unwrap();
    assert_eq!(plain.line(), None);
}

#[test]
fn a_transfer_goes_before_all_that_a_file_says() {
    let linear = Picture::open(&folder().join("grey8.png"), Some(Transfer::Linear)).unwrap();
    for file in ["grey8.png", "icc_grey18.png"] {
        let found = Picture::open(&folder().join(file), Some(Transfer::Linear)).unwrap();
        assert_eq!(found, linear, "{file}");
    }
}

#[test]
fn edits_are_done_to_the_upright_picture() {
    let edits = glasswarp::irradiance::Edits {
        crop: Some("2,1,20,12".parse().unwrap()),
        rotate: Some("90deg".parse().unwrap()),
        ..Default::default()
    };
    let options = PictureOptions::default().with_edits(edits);
    let upright = options.open(&folder().join("rgb8.png")).unwrap().0;
    for n in 1..=8 {
        for kind in ["png", "webp", "tif"] {
            let file = format!("turned{n}.{kind}");
            assert_eq!(options.open(&folder().join(&file)).unwrap().0, upright, "{file}");
        }
    }
    let whole = Picture::open(&folder().join("rgb8.png"), None).unwrap();
    let (part, whole) = (upright.values(), whole.values());
    assert_eq!((part.nx(), part.ny()), (12, 20));
    for j in 0..20 {
        for i in 0..12 {
            assert_eq!(part[(i, j)], whole[(2 + j, 1 + 11 - i)]);
        }
    }
}

#[test]
fn pictures_beyond_the_greatest_side_are_reduced_by_area() {
    // Three pixels a block along x: 16384 < 33000 <= 3 * 16384. Written row by row, so that it is
    // read so, too.
    let (nx, ny) = (33_000, 13);
    let value = |i: usize, j: usize| ((i * 7 + j * 31) % 256) as u8;
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, nx as u32, ny as u32);
    encoder.set_color(png::ColorType::Grayscale);
    let data: Vec<u8> = (0..ny).flat_map(|j| (0..nx).map(move |i| value(i, j))).collect();
    encoder.write_header().unwrap().write_image_data(&data).unwrap();
    let options = PictureOptions::default().with_memory(4 << 20);
    let (picture, understood) = options.read(std::io::Cursor::new(&bytes)).unwrap();
    assert_eq!((picture.values().nx(), picture.values().ny()), (11_000, 5));
    let said = understood.line().unwrap();
    assert!(said.contains("reduced from 33000 x 13, blocks of 3 x 3 pixels"), "{said}");
    for (i, j) in [(0, 0), (5000, 2), (10_999, 3), (10_999, 4)] {
        let columns = 3 * i..(3 * i + 3).min(nx);
        let cells: Vec<f64> = (3 * j..(3 * j + 3).min(ny))
            .flat_map(|y| columns.clone().map(move |x| Transfer::Srgb.to_linear(f64::from(value(x, y)) / 255.0)))
            .collect();
        let mean = cells.iter().sum::<f64>() / cells.len() as f64;
        assert!((picture.values()[(i, j)] - mean).abs() < 1e-12, "{i}, {j}");
    }
    let tight = PictureOptions::default().with_memory(400_000);
    let refused = tight.read(std::io::Cursor::new(&bytes)).unwrap_err().to_string();
    assert!(refused.contains("33000 x 13 pixels, which take"), "{refused}");
}
