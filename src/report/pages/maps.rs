//! The pictures of a check, of tolerances and of milling.

use crate::{
    fabricate::{Cutter, FaceShape},
    report::{
        axes::FROM_ABOVE,
        pictures::{Exposure, difference_picture, irradiance_picture},
        sheet::{Captioned, ON_THE_WALL, Row, contact_sheet, map as map_of, stacked, table_of_pictures},
        svg::Svg,
    },
    study::{
        check::Makeable,
        judge,
        mill::{MillStep, MillStudy},
        program::ProgramStudy,
        tolerance::{ToleranceCase, ToleranceStudy},
        workpiece::Workpiece,
    },
};
use glasswarp_verify::Image;
use image::{GrayImage, imageops};

/// Where the face is hollow, steep and thin, and, if they were looked at, what tolerances do to its
/// light.
pub(crate) fn check_sheet(
    cutter: Cutter,
    subject: &Makeable,
    shape: &FaceShape,
    traced: Option<(&ToleranceStudy, Exposure)>,
) -> GrayImage {
    let maps = contact(&maps(cutter, subject, shape));
    match traced {
        None => maps,
        Some((study, exposure)) => stacked(&[maps, tolerances(study, exposure, WIDTH_PX)]),
    }
}

/// Width of the sheet of a check, pixels.
const WIDTH_PX: u32 = 1400;
/// Width of a face on it, pixels: three of them with their axes fill it.
const MAP_PX: u32 = 366;

fn contact(maps: &[(String, Svg)]) -> GrayImage {
    let pictures: Vec<Captioned> =
        maps.iter().map(|(caption, map)| Captioned { caption: caption.clone(), picture: map.raster() }).collect();
    contact_sheet(&pictures, 3, pictures.first().map_or(1, |one| one.picture.width()))
}

fn maps(cutter: Cutter, subject: &Makeable, shape: &FaceShape) -> [(String, Svg); 3] {
    let extent = subject.surface.extent();
    let (sharpest, (steep_at, steepest)) = (shape.sharpest(), shape.steepest());
    let least = cutter.corner_mm().max(1e-3);
    let (low, high) = subject.surface.range_mm();
    let map = |field, range, at| map_of(field, extent, range, at, MAP_PX);
    let hollows = map(shape.hollow_per_mm(), (0.0, 1.0 / least), Some(sharpest.at));
    let slope = map(shape.slope(), (0.0, steepest.max(1e-9)), Some(steep_at));
    let thickness = map(&subject.surface.heights_within(high), (high, low), None);
    [
        (
            format!(
                "hollows, {FROM_ABOVE}: white flat, black {least} mm radius\nsharpest, in the ring: {:.2} mm",
                sharpest.radius_mm
            ),
            hollows,
        ),
        (
            format!(
                "slope, {FROM_ABOVE}: white level\nsteepest, black and in the ring: {:.2} degrees",
                steepest.atan().to_degrees()
            ),
            slope,
        ),
        (
            format!(
                "thickness, {FROM_ABOVE}:\nwhite {:.3} mm, black {:.3} mm",
                subject.thinnest_mm + high - low,
                subject.thinnest_mm
            ),
            thickness,
        ),
    ]
}

/// The light of every tolerance with its figures, what moves it most first.
fn tolerances(study: &ToleranceStudy, exposure: Exposure, width_px: u32) -> GrayImage {
    let designed = judge::field_of(&study.designed.image);
    let as_designed = Row {
        words: vec![
            "as designed".to_owned(),
            format!("relative RMS {:.4}, SSIM {:.3}", study.designed.metrics.rel_rms, study.designed.metrics.ssim),
            "beside every other picture: its difference".to_owned(),
            "from this one × 4, white where they agree".to_owned(),
        ],
        pictures: vec![irradiance_picture(&designed, exposure)],
    };
    let row = |case: &ToleranceCase| {
        let aside = case.place.in_words().split("   ").filter(|part| !part.is_empty()).map(str::to_owned).collect();
        let Some((view, moved)) = &case.view else {
            let words = vec![case.name.clone(), "none of the light falls into the window".to_owned()];
            return Row { words: [words, aside].concat(), pictures: Vec::new() };
        };
        let light = judge::field_of(&view.image);
        let words = vec![
            case.name.clone(),
            format!("relative RMS {:.4}, SSIM {:.3}", view.metrics.rel_rms, view.metrics.ssim),
            format!("moves the light by {moved:.4}"),
        ];
        let pictures = vec![irradiance_picture(&light, exposure), difference_picture(&designed, &light, exposure)];
        Row { words: [words, aside].concat(), pictures }
    };
    let moved = |case: &&ToleranceCase| case.view.as_ref().map_or(f64::INFINITY, |(_, moved)| *moved);
    let mut cases: Vec<&ToleranceCase> = study.cases.iter().collect();
    cases.sort_by(|a, b| moved(b).total_cmp(&moved(a)));
    let rows = std::iter::once(as_designed).chain(cases.into_iter().map(row)).collect();
    let title = format!("What tolerances do to the light, {ON_THE_WALL}, the worst first");
    table_of_pictures(&title, rows, 2, width_px)
}

/// Side of the piece of the light that is shown pixel by pixel, pixels of the light.
const PIECE: u32 = 64;
/// Rows of the cutter that lie nearer to each other than so many pixels beat with them.
const BEATING: f64 = 3.0;

/// The light after a step, with its figures.
fn seen(step: &MillStep, exposure: Exposure) -> Captioned {
    let metrics = &step.view.metrics;
    let caption = format!("{}\nrelative RMS {:.4}, SSIM {:.4}", step.name, metrics.rel_rms, metrics.ssim);
    Captioned { caption, picture: irradiance_picture(&judge::field_of(&step.view.image), exposure) }
}

/// What a program cuts, as a sheet: the light after every step, and how far the face lies off its
/// design.
pub(crate) fn program(piece: &Workpiece, study: &ProgramStudy, exposure: Exposure) -> GrayImage {
    const WIDTH: u32 = 420;
    let target = piece.examiner.target().into_iter().map(|target| Captioned {
        caption: format!("target, {ON_THE_WALL}"),
        picture: irradiance_picture(&judge::field_of(target), exposure),
    });
    let off = &study.deviation;
    let most = off.range_um.0.abs().max(off.range_um.1.abs());
    let (greatest, at) = off.greatest;
    let map = map_of(&off.map, off.extent, (-most, most), Some(at), MAP_PX);
    let caption = format!(
        "cut less designed, {FROM_ABOVE}:\nwhite {:.3} um, black {most:+.3} um (glass is left)\nthe greatest, in the ring: {greatest:+.3} um",
        -most
    );
    let map = Captioned { caption, picture: map.raster() };
    let pictures: Vec<Captioned> =
        target.chain(study.steps.iter().map(|step| seen(step, exposure))).chain([map]).collect();
    contact_sheet(&pictures, 3, WIDTH)
}

/// The light after every step of milling, as a sheet.
pub(crate) fn milling(piece: &Workpiece, study: &MillStudy, exposure: Exposure) -> GrayImage {
    const WIDTH: u32 = 420;
    let picture = |image: &Image| irradiance_picture(&judge::field_of(image), exposure);
    let target = piece
        .examiner
        .target()
        .into_iter()
        .map(|target| Captioned { caption: format!("target, {ON_THE_WALL}"), picture: picture(target) });
    let mut pictures: Vec<Captioned> = target.chain(study.steps.iter().map(|step| seen(step, exposure))).collect();
    // As large as it is, so that rows and pixels beat with each other only once.
    let last = picture(&study.last().view.image);
    let (wide, high) = last.dimensions();
    let (side_x, side_y) = (PIECE.min(wide), PIECE.min(high));
    let crop = imageops::crop_imm(&last, (wide - side_x) / 2, (high - side_y) / 2, side_x, side_y).to_image();
    let times = (WIDTH / side_x).max(1);
    let crop = imageops::resize(&crop, times * side_x, times * side_y, imageops::FilterType::Nearest);
    let pixel_mm = piece.bench.window().width_mm / f64::from(wide);
    let rows_mm = study.pass.step_over_mm * piece.bench.window().as_vec().max_element()
        / piece.bench.block().as_vec().max_element();
    let mut what = format!("rows {rows_mm:.2} mm apart on the wall, pixels {pixel_mm:.2} mm");
    if rows_mm < BEATING * pixel_mm {
        what += ":\ncurves and dashes are the beat of the two,\non the wall every row is a fine line";
    }
    let caption =
        format!("the middle of the last, {:.1} mm wide, pixel by pixel\n{what}", pixel_mm * f64::from(side_x));
    pictures.push(Captioned { caption, picture: crop });
    contact_sheet(&pictures, 3, WIDTH)
}
