//! The page by which a test coupon is read.

use super::{Facts, View, figure::Figure};
use crate::report::svg::{Escaped, Svg};
use askama::Template;

/// What is seen, what it means, and what is typed for it.
#[derive(Clone, Debug)]
pub struct ReadingRule {
    /// What is read.
    pub of: String,
    /// What to look at, and how.
    pub see: String,
    /// What it means.
    pub means: String,
    /// What to type: flags.
    pub types: Vec<String>,
}

/// Everything that the page of a coupon shows.
#[derive(Clone, Debug)]
pub struct CouponSheet {
    /// What is seen here, in a sentence or two.
    pub about: String,
    /// How to make the coupon and how to set it up, step by step.
    pub steps: Vec<String>,
    /// How to read it.
    pub rules: Vec<ReadingRule>,
    /// What must be known before a reading is believed.
    pub cautions: Vec<String>,
    /// The face, the bench, and the sheet in true size with its width in millimetres.
    pub face: Svg,
    /// Lamp, coupon and sheet.
    pub bench: Svg,
    /// The sheet on which the coupon is read.
    pub sheet: Svg,
    /// Width of the sheet, mm.
    pub sheet_mm: f64,
    /// The light of coupons of which all is known.
    pub seen: Vec<View>,
    /// Rulings: number, period, depth, polish.
    pub rulings: Vec<[String; 4]>,
    /// Indices, and how far apart the uprights stand.
    pub indices: Vec<[String; 2]>,
    /// Figures of the coupon.
    pub facts: Facts,
    /// The command that makes it again.
    pub command: String,
    /// The program and its version.
    pub program: String,
}

/// The page as text.
pub fn coupon_html(page: &CouponSheet) -> String {
    let drawing = |svg: &Svg, class: &str, words: &str| {
        svg.element(&format!("class=\"{class}\" role=\"img\" aria-label=\"{}\"", Escaped(words)))
    };
    let template = Whole {
        page,
        face: drawing(&page.face, "drawing", "The structured face with its strips and the direction of the rows"),
        bench: drawing(&page.bench, "bench", "Lamp, coupon and sheet of paper in a line"),
        sheet: drawing(&page.sheet, "true-size", "The sheet to read the coupon on, with its scales"),
        seen: page.seen.iter().map(|view| Figure::of(view, SEEN_PX)).collect(),
    };
    template.render().unwrap_or_else(|error| format!("<!doctype html><title>{error}</title>"))
}

/// Longer side of a picture, pixels.
const SEEN_PX: u32 = 480;

#[derive(Template)]
#[template(path = "coupon.html")]
struct Whole<'a> {
    page: &'a CouponSheet,
    face: String,
    bench: String,
    sheet: String,
    seen: Vec<Figure>,
}
