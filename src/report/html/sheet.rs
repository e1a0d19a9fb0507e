//! One printed sheet for maker and shop: whether a block is ready to be made, and all that both must
//! have at hand.

use super::{
    figure::{Figure, Sheet},
    page::{Facts, FileRecord, TrafficLight, View},
};
use crate::report::drawing::Drawing;
use askama::Template;

/// Everything on the sheet.
#[derive(Clone, Debug)]
pub struct ReadySheet {
    /// Name of the block.
    pub title: String,
    /// The answer to all questions together.
    pub verdict: TrafficLight,
    /// What it rests on.
    pub lights: Vec<TrafficLight>,
    /// The picture, and what the eye gets of it.
    pub pictures: Vec<View>,
    /// The block.
    pub drawing: Drawing,
    /// What to order, how to work, what to measure, what to watch.
    pub facts: Vec<Facts>,
    /// What to send.
    pub files: Vec<FileRecord>,
    /// The command that makes all of this again.
    pub command: String,
    /// The program and its version.
    pub program: String,
}

#[derive(Template)]
#[template(path = "sheet.html")]
struct Whole<'a> {
    page: &'a ReadySheet,
    figures: Vec<Figure>,
    drawing: Sheet,
    style: &'static str,
}

/// Longer side of a picture on the sheet, pixels, at most.
const PICTURE_PX: u32 = 480;

/// The sheet as text.
pub fn ready_sheet(page: &ReadySheet) -> String {
    let figures = page.pictures.iter().map(|view| Figure::of(view, PICTURE_PX)).collect();
    let whole = Whole { page, figures, drawing: Sheet::of(&page.drawing), style: include_str!("sheet.css") };
    // Writing to a string cannot fail, and nothing in the template does.
    whole.render().unwrap_or_else(|error| format!("<!doctype html><title>{error}</title>"))
}
