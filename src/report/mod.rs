//! What a design looks like: lines of equal height, the light on the wall, and how far it is from
//! the target, step by step and from bench to bench.

#[cfg(feature = "drawings")]
mod axes;
#[cfg(feature = "drawings")]
mod budget;
#[cfg(feature = "svg")]
mod budget_sheet;
#[cfg(feature = "cli")]
mod coupon;
#[cfg(feature = "drawings")]
mod curves;
#[cfg(feature = "drawings")]
mod dimension;
#[cfg(feature = "drawings")]
mod drawing;
#[cfg(feature = "report")]
mod html;
#[cfg(feature = "drawings")]
mod isocontours;
#[cfg(feature = "report")]
pub(crate) mod pages;
mod pictures;
#[cfg(feature = "svg")]
mod raster;
#[cfg(feature = "svg")]
mod sheet;
#[cfg(feature = "drawings")]
mod svg;
#[cfg(feature = "cli")]
pub(crate) mod text;

#[cfg(feature = "cli")]
pub use coupon::{SHEET_MM, coupon_bench, coupon_face, coupon_sheet};
#[cfg(feature = "cli")]
pub use html::{CouponSheet, ReadingRule, coupon_html};
pub use pictures::{Exposure, difference_picture, irradiance_picture};
#[cfg(feature = "drawings")]
pub use {
    budget::{Cost, CostErrors, budget_chart},
    curves::{Curve, curves},
    drawing::{Drawing, dimensioned_drawing},
    isocontours::{Isocontours, contour_interval_mm},
    svg::Svg,
};
#[cfg(feature = "svg")]
pub use {
    budget_sheet::budget_sheet,
    sheet::{Captioned, contact_sheet, map, panel},
};
#[cfg(feature = "report")]
pub use {
    html::{
        Facts, FileRecord, Highlight, Model, MovingLight, Page, ReadySheet, TrafficLight, View, ready_sheet, render,
    },
    pages::{
        common::exposure_of,
        design::{BlockDrawings, DesignPage},
        ready::ReadyPage,
    },
};

#[cfg(feature = "files")]
use crate::export::{WriteError, write_atomically};
use image::{GrayImage, ImageError, codecs::png::PngEncoder};
use std::io;
#[cfg(feature = "files")]
use std::path::Path;

/// Writes a picture as a PNG file, which appears whole or not at all.
///
/// # Errors
/// A file that cannot be written.
#[cfg(feature = "files")]
pub fn write_png(path: &Path, picture: &GrayImage) -> Result<(), WriteError> {
    write_atomically(path, |writer| encode_png(writer, picture))
}

/// Writes a picture as PNG to anything that takes bytes.
///
/// # Errors
/// Those of the writer.
pub fn encode_png(writer: &mut impl io::Write, picture: &GrayImage) -> io::Result<()> {
    picture.write_with_encoder(PngEncoder::new(writer)).map_err(|error| match error {
        ImageError::IoError(error) => error,
        other => io::Error::other(other),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_written_picture_reads_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ramp.png");
        let ramp = GrayImage::from_fn(256, 3, |i, j| image::Luma([(i + j) as u8]));
        write_png(&path, &ramp).unwrap();
        assert_eq!(image::open(&path).unwrap().into_luma8(), ramp);
        assert!(matches!(write_png(&folder.path().join("no/ramp.png"), &ramp), Err(WriteError::NoFolder { .. })));
    }
}
