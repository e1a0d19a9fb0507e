//! The verifier's own reader of pictures against light that is known by construction.

#[path = "../../tests/common/chart.rs"]
mod chart;
#[path = "../../tests/common/measured.rs"]
mod measured;

use chart::{NX, NY, cases, light};
use glasswarp_verify::{
    Image,
    reference::{
        Crop, Flip, Frame, Levels, Measure, ReadOptions, Reference, ReferenceError, Transfer, Turn, resampled,
    },
};
use measured::{at_worst, within_tenth_of};

fn options() -> ReadOptions {
    with(&ReadOptions::default(), |options| options.svg_width = NX)
}

/// The same options but for what is set.
fn with(options: &ReadOptions, set: impl FnOnce(&mut ReadOptions)) -> ReadOptions {
    let mut options = options.clone();
    set(&mut options);
    options
}

/// The light of a reading with the chart's scale.
fn scaled(read: &Reference) -> Image {
    let mean = (0..NX * NY).map(|k| light(k % NX, k / NX)).sum::<f64>() / (NX * NY) as f64;
    Image::new(read.light.nx, read.light.ny, read.light.values.iter().map(|v| mean * v).collect())
}

#[test]
fn every_format_profile_and_orientation_is_the_light_that_it_was_made_from() {
    let cases = cases();
    assert!(cases.len() > 65, "{} cases", cases.len());
    let mut wrong = Vec::new();
    for case in &cases {
        let read = match Reference::parse(&case.bytes, &options()) {
            Ok(read) => read,
            Err(error) => {
                wrong.push(format!("{}: {error}", case.name));
                continue;
            }
        };
        if (read.light.nx, read.light.ny) != (NX, NY) {
            wrong.push(format!("{}: {} x {}", case.name, read.light.nx, read.light.ny));
            continue;
        }
        let found = scaled(&read);
        let off = |k: usize| (found.values[k] - light(k % NX, k / NX)).abs();
        let worst = (0..NX * NY).max_by(|a, b| off(*a).total_cmp(&off(*b))).unwrap();
        if off(worst) > case.within {
            wrong.push(format!(
                "{}: {:.5} instead of {:.5} in column {}, row {}",
                case.name,
                found.values[worst],
                light(worst % NX, worst / NX),
                worst % NX,
                worst / NX
            ));
        }
    }
    assert!(wrong.is_empty(), "{} of {} cases:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
}

/// The exact chart, of 16 bits.
fn exact() -> Vec<u8> {
    cases().into_iter().find(|case| case.name == "png, gAMA 1").unwrap().bytes
}

fn read(options: &ReadOptions) -> Reference {
    Reference::parse(&exact(), options).unwrap()
}

fn mean_one(nx: usize, ny: usize, value: impl Fn(usize, usize) -> f64) -> Image {
    let values: Vec<f64> = (0..nx * ny).map(|k| value(k % nx, k / nx)).collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    Image::new(nx, ny, values.iter().map(|v| v / mean).collect())
}

fn same(found: &Image, expected: &Image) {
    assert_eq!((found.nx, found.ny), (expected.nx, expected.ny));
    let worst = found.values.iter().zip(&expected.values).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    at_worst(1.66e-4, worst, "light, of the mean");
}

#[test]
fn edits_do_what_the_page_says_in_its_order() {
    let crop = Crop {
        x: Measure::Share(0.5),
        y: Measure::Pixels(8.0),
        width: Measure::Pixels(20.0),
        height: Measure::Share(0.5),
    };
    let part = |x: usize, y: usize| light(x + 24, y + 8);
    let cropped = with(&options(), |options| options.crop = Some(crop));
    same(&read(&cropped).light, &mean_one(20, 16, part));
    // Clockwise: what was on the left comes to the top.
    let turned = with(&cropped, |options| options.turn = Some(Turn::Quarter));
    same(&read(&turned).light, &mean_one(16, 20, |x, y| part(y, 15 - x)));
    let flipped = with(&turned, |options| options.flip = Some(Flip::Horizontal));
    same(&read(&flipped).light, &mean_one(16, 20, |x, y| part(y, x)));

    let encode = |v: f64| if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    let decode = |v: f64| if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
    let levels = Levels { black: 0.3, white: 0.9, gamma: 1.5 };
    let graded = |x: usize, y: usize| ((encode(light(x, y)) - 0.3) / 0.6).clamp(0.0, 1.0).powf(1.0 / 1.5);
    let levelled = with(&options(), |options| options.levels = Some(levels));
    same(&read(&levelled).light, &mean_one(NX, NY, |x, y| decode(graded(x, y))));
    let inverted = with(&levelled, |options| {
        options.invert = true;
        options.offset = 0.2;
    });
    same(&read(&inverted).light, &mean_one(NX, NY, |x, y| decode(1.0 - graded(x, y)) + 0.2));
}

#[test]
fn what_is_given_goes_before_what_the_file_says() {
    let linear = with(&options(), |options| options.transfer = Some(Transfer::Linear));
    let encoded = cases().into_iter().find(|case| case.name == "png, 16 bits").unwrap().bytes;
    let encode = |v: f64| if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    same(&Reference::parse(&encoded, &linear).unwrap().light, &mean_one(NX, NY, |x, y| encode(light(x, y))));
}

#[test]
fn a_background_is_mixed_in_linear_light() {
    // White of alpha a on a ground of luminance b: a + (1 - a) b.
    let veiled = cases().into_iter().find(|case| case.name.contains("alpha")).unwrap().bytes;
    let grey = with(&options(), |options| options.background = Some([188; 3]));
    let ground = ((188.0_f64 / 255.0 + 0.055) / 1.055).powf(2.4);
    let found = Reference::parse(&veiled, &grey).unwrap().light;
    let expected = mean_one(NX, NY, |x, y| {
        let alpha = (255.0 * light(x, y)).round() / 255.0;
        alpha + (1.0 - alpha) * ground
    });
    same(&found, &expected);
}

#[test]
fn a_frame_is_dark_and_as_wide_as_it_says() {
    let framed = read(&with(&options(), |options| options.frame = Frame { margin: 0.1, vignette: None })).light;
    // 48 and 32 pixels, which stay what they are, are 0.8 of the whole.
    assert_eq!((framed.nx, framed.ny), (60, 40));
    let part = mean_one(60, 40, |x, y| {
        let inside = (6..54).contains(&x) && (4..36).contains(&y);
        if inside { light(x - 6, y - 4) } else { 0.0 }
    });
    same(&framed, &part);
}

fn refused(bytes: &[u8], options: &ReadOptions) -> ReferenceError {
    match Reference::parse(bytes, options) {
        Ok(read) => panic!("taken, with {} x {} pixels", read.light.nx, read.light.ny),
        Err(error) => error,
    }
}

#[test]
fn what_is_not_read_is_refused_by_name() {
    for (bytes, name) in [
        (&b"\0\0\0\x18ftypheic"[..], "HEIC"),
        (b"\0\0\0\x18ftypavif", "AVIF"),
        (b"%PDF-1.7", "PDF"),
        (b"8BPS\0\x01", "PSD"),
        (b"\xff\x0a\0\0", "JPEG XL"),
        (b"II*\0\x10\0\0\0CR\x02\0", "raw"),
    ] {
        let error = refused(bytes, &options());
        assert!(matches!(error, ReferenceError::Foreign { .. }) && error.to_string().contains(name), "{error}");
    }
    assert!(matches!(refused(b"Dear Sir", &options()), ReferenceError::UnknownFormat));
    assert!(matches!(refused(b"P5 70000 70000 255\n1", &options()), ReferenceError::Claims { .. }));
    assert!(matches!(refused(b"P5 2 2 255\n\x07\x07\x07\x07", &options()), ReferenceError::Flat { .. }));

    let size = (NX as u32, NY as u32);
    let rows = vec![vec![7; NX]; NY];
    for (chunk, name) in [
        (vec![1, 16, 0, 1], "PQ"),
        (vec![9, 18, 0, 1], "HLG"),
        (vec![1, 13, 1, 1], "matrix"),
        (vec![1, 13, 0, 0], "range"),
    ] {
        let error = refused(&chart::png(size, 8, 0, &rows, &[(b"cICP", chunk)]), &options());
        assert!(matches!(error, ReferenceError::Colour { .. }) && error.to_string().contains(name), "{error}");
    }
    // Black art on transparency.
    let art: Vec<Vec<u8>> = (0..NY).map(|y| (0..NX).flat_map(|x| [0, (x * y % 256) as u8]).collect()).collect();
    let art = chart::png(size, 8, 4, &art, &[]);
    assert!(refused(&art, &options()).to_string().contains("--background"));
    assert!(Reference::parse(&art, &with(&options(), |options| options.background = Some([255; 3]))).is_ok());

    let negative: Vec<u8> = (0..NX * NY).flat_map(|k| (k as f32 - 3.0).to_le_bytes()).collect();
    let floats = (339, 3, 1, vec![3, 0, 0, 0]);
    let error = refused(&chart::tiff(size, [32, 1, 1], &negative, &[floats]), &options());
    assert!(matches!(error, ReferenceError::Value { column: 0, row: 0, .. }), "{error}");
}

#[test]
fn layers_are_named_where_there_are_several() {
    use exr::prelude::{
        AnyChannel, AnyChannels, Encoding, FlatSamples, Image as Exr, Layer, LayerAttributes, WritableImage,
    };
    let values = |scale: f32| FlatSamples::F32((0..12).map(|k| scale * k as f32).collect());
    let channels = ["A.R", "A.G", "A.B", "B.R", "B.G", "B.B"].into_iter().map(|name| {
        let rising = name.starts_with('A');
        AnyChannel::new(
            name,
            if rising { values(1.0) } else { FlatSamples::F32((0..12).map(|k| 12.0 - k as f32).collect()) },
        )
    });
    let layer =
        Layer::new((4, 3), LayerAttributes::default(), Encoding::FAST_LOSSLESS, AnyChannels::sort(channels.collect()));
    let mut out = std::io::Cursor::new(Vec::new());
    Exr::from_layer(layer).write().to_buffered(&mut out).unwrap();
    let bytes = out.into_inner();
    let ReferenceError::Layers { names } = refused(&bytes, &options()) else { panic!("not told apart") };
    assert_eq!(names, ["A", "B"]);
    let first = |layer: &str| {
        let read = Reference::parse(&bytes, &with(&options(), |options| options.layer = Some(layer.into()))).unwrap();
        (read.light.values[0], read.light.values[11])
    };
    assert!(first("A").0 < first("A").1 && first("B").0 > first("B").1);
    assert!(matches!(
        refused(&bytes, &with(&options(), |options| options.layer = Some("C".into()))),
        ReferenceError::NoLayer { .. }
    ));
}

#[test]
fn pictures_that_are_too_large_are_reduced_in_light() {
    // Two rows of 40 000 pixels, every second black: a factor of 3.
    let nx = 40_000;
    let row: Vec<u8> = (0..nx).map(|x| if x < 20_000 { 255 * (x % 2) as u8 } else { 64 }).collect();
    let file = [format!("P5 {nx} 2 255\n").into_bytes(), row.clone(), row].concat();
    let read = Reference::parse(&file, &options()).unwrap();
    assert_eq!((read.reduced, read.light.nx, read.light.ny), (3, 13334, 1));
    let ratio = resampled(&read.light, 2, 1).values;
    let grey = ((64.0_f64 / 255.0 + 0.055) / 1.055).powf(2.4);
    within_tenth_of(4.48e-5, (ratio[0] / ratio[1] * grey / 0.5 - 1.0).abs(), format_args!("{ratio:?}"));
}
