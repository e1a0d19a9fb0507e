//! The pictures of a check, of tolerances and of milling.

use crate::{
    fabricate::{Cutter, FaceShape},
    report::{
        pictures::{Exposure, irradiance_picture},
        sheet::{Captioned, contact_sheet, map as map_of},
    },
    study::{
        check::Makeable,
        judge,
        mill::MillStudy,
        tolerance::ToleranceStudy,
        workpiece::{JudgedImage, Workpiece},
    },
};
use glasswarp_verify::Image;
use image::GrayImage;

/// Where the face is hollow, steep and thin.
pub(crate) fn maps(cutter: Cutter, subject: &Makeable, shape: &FaceShape) -> Vec<Captioned> {
    const WIDTH: u32 = 420;
    let extent = subject.surface.extent();
    let (sharpest, (steep_at, steepest)) = (shape.sharpest(), shape.steepest());
    let least = cutter.corner_mm().max(1e-3);
    let (low, high) = subject.surface.range_mm();
    let map = |field, range, at| map_of(field, extent, range, at, WIDTH);
    vec![
        Captioned {
            caption: format!("hollows: black at {least} mm, sharpest {:.2} mm", sharpest.radius_mm),
            picture: map(shape.hollow_per_mm(), (0.0, 1.0 / least), Some(sharpest.at)),
        },
        Captioned {
            caption: format!("slope: black at {:.2} degrees", steepest.atan().to_degrees()),
            picture: map(shape.slope(), (0.0, steepest.max(1e-9)), Some(steep_at)),
        },
        Captioned {
            caption: format!(
                "thickness: white {:.3} mm, black {:.3} mm",
                subject.thinnest_mm + high - low,
                subject.thinnest_mm
            ),
            picture: map(&subject.surface.heights_within(high), (high, low), None),
        },
    ]
}

/// The light of every tolerance.
pub(crate) fn tolerances(study: &ToleranceStudy, exposure: Exposure) -> Vec<Captioned> {
    let captioned = |name: &str, view: &JudgedImage| Captioned {
        caption: format!("{name}: {:.4}", view.metrics.rel_rms),
        picture: irradiance_picture(&judge::field_of(&view.image), exposure),
    };
    let cases = study.cases.iter().filter_map(|case| Some(captioned(&case.name, &case.view.as_ref()?.0)));
    std::iter::once(captioned("as designed", &study.designed)).chain(cases).collect()
}

/// The light after every step of milling, as a sheet.
pub(crate) fn milling(piece: &Workpiece, study: &MillStudy, exposure: Exposure) -> GrayImage {
    let captioned = |caption: String, image: &Image| Captioned {
        caption,
        picture: irradiance_picture(&judge::field_of(image), exposure),
    };
    let mut pictures: Vec<Captioned> =
        piece.examiner.target().into_iter().map(|target| captioned("target".into(), target)).collect();
    for step in &study.steps {
        let caption = format!("{}: {:.4}, ssim {:.4}", step.name, step.view.metrics.rel_rms, step.view.metrics.ssim);
        pictures.push(captioned(caption, &step.view.image));
    }
    contact_sheet(&pictures, 3, 420)
}
