//! A block on one page of HTML, for the people who will make it: pictures, maps, drawings, charts,
//! and a model to turn in the hand.
//!
//! The page is one file that asks for nothing else: styles, scripts, pictures and heights are
//! embedded, and its own policy forbids it to load anything. [`Page`] holds plain data; what it
//! says in words is said by whoever fills it.

mod convergence;
#[cfg(feature = "cli")]
mod coupon;
mod data;
mod figure;
mod maps;
mod page;
mod rays;
mod scene;
mod section;
mod sheet;
mod still;

#[cfg(feature = "cli")]
pub use coupon::{CouponSheet, ReadingRule, coupon_html};
pub use page::{Facts, FileRecord, Highlight, Model, MovingLight, Page, TrafficLight, View};
pub use sheet::{ReadySheet, ready_sheet};

use crate::{
    report::{
        budget::{Cost, CostErrors, budget_chart, rounded},
        isocontours::contour_interval_mm,
        svg::Escaped,
    },
    surface::SurfaceSpline,
};
use askama::Template;
use convergence::Convergence;
use figure::{Figure, Sheet};
use maps::ColourMap;
use rayon::prelude::*;
use rays::RayFan;
use section::{Across, section};
use still::Still;

/// The page as text.
pub fn render(page: &Page<'_>) -> String {
    let model = &page.model;
    let spline = SurfaceSpline::through(model.surface);
    let fan = RayFan::of(&spline, model);
    let shaded = maps::hillshade(&spline, 320);
    let shown: Vec<(&View, u32)> = [page.target.as_ref(), Some(&page.caustic), page.difference.as_ref()]
        .into_iter()
        .flatten()
        .map(|view| (view, MAIN_PX))
        .chain(page.others.iter().flat_map(|(light, difference)| [(light, OTHER_PX), (difference, OTHER_PX)]))
        .collect();
    // Pictures are independent of each other, and compressing them is most of the work.
    let (figures, (face, (scene, still))) = rayon::join(
        || shown.par_iter().map(|(view, most)| Figure::of(view, *most)).collect::<Vec<_>>(),
        || {
            rayon::join(
                || FaceFigures::of(model),
                || {
                    rayon::join(
                        || scene::json(model, &spline, &fan),
                        || Still::of(model, &fan, &shaded, &page.caustic.picture),
                    )
                },
            )
        },
    );
    let mut figures = figures.into_iter();
    let target = page.target.as_ref().and_then(|_| figures.next());
    let caustic = figures.next();
    let difference = page.difference.as_ref().and_then(|_| figures.next());
    let template = Whole {
        page,
        target,
        caustic,
        difference,
        others: std::iter::from_fn(|| figures.next().zip(figures.next())).collect(),
        face,
        moving: page.moving.as_ref().map(data::script_json).map_err(|&unsaid| unsaid),
        scene,
        still,
        sections: [Across::X, Across::Y].map(|across| section(model, &spline, &fan, across)).into(),
        budget: (!page.budget.is_empty()).then(|| budget(&page.budget)),
        convergence: page.summary.and_then(Convergence::of),
        drawing: page.drawing.as_ref().map(Sheet::of),
        style: include_str!("style.css"),
        viewer: include_str!("viewer.js"),
        photons: include_str!("photons.js"),
        light: include_str!("light.js"),
        script: include_str!("page.js"),
    };
    // Writing to a string cannot fail, and nothing in the template does.
    template.render().unwrap_or_else(|error| format!("<!doctype html><title>{error}</title>"))
}

/// Longer side of a main picture and of the others, pixels, at most.
const MAIN_PX: u32 = 720;
const OTHER_PX: u32 = 320;
/// Longer side of the maps of a face, pixels.
const MAP_PX: u32 = 480;

#[derive(Template)]
#[template(path = "page.html")]
struct Whole<'a> {
    page: &'a Page<'a>,
    target: Option<Figure>,
    caustic: Option<Figure>,
    difference: Option<Figure>,
    others: Vec<(Figure, Figure)>,
    face: FaceFigures,
    /// The light that moves, and the model, as JSON.
    moving: Result<String, &'static str>,
    scene: String,
    still: Still,
    /// Drawings as elements.
    sections: Vec<String>,
    /// The chart as an element.
    budget: Option<String>,
    convergence: Option<Convergence>,
    drawing: Option<Sheet>,
    style: &'static str,
    viewer: &'static str,
    photons: &'static str,
    light: &'static str,
    script: &'static str,
}

/// The error budget, with its figures in words for those who cannot see it.
fn budget(costs: &[Cost]) -> String {
    let step = |cost: &Cost| match cost.errors {
        Some(CostErrors { rel_rms, ssim, moved }) => {
            format!("{}: {}, SSIM {ssim:.4}, moves the light by {}", cost.name, rounded(rel_rms), rounded(moved))
        }
        None => cost.name.clone(),
    };
    let steps: Vec<String> = costs.iter().map(step).collect();
    let words = format!(
        "Relative RMS error of the light, step by step, along an axis of its square root. {}",
        steps.join("; ")
    );
    budget_chart(costs).element(&format!("class=\"paper ink\" role=\"img\" aria-label=\"{}\"", Escaped(&words)))
}

/// The face as isocontours and maps.
struct FaceFigures {
    /// Its address, width and height.
    contours: (String, u32, u32),
    interval: String,
    slope: ColourMap,
    hollow: ColourMap,
}

impl FaceFigures {
    fn of(model: &Model<'_>) -> Self {
        let (contours, (slope, hollow)) = rayon::join(
            || {
                let (width, height) = model.contours.picture.size();
                (model.contours.picture.uri(), width, height)
            },
            || {
                rayon::join(
                    || maps::slope(model.slope, model.surface.extent(), MAP_PX),
                    || maps::hollow(model.hollow_per_mm, model.surface.extent(), MAP_PX),
                )
            },
        );
        let interval = contour_interval_mm(model.surface)
            .map_or_else(|| "the face is flat".to_owned(), |step| format!("a line every {} mm", data::figure(step)));
        Self { contours, interval, slope, hollow }
    }
}

#[cfg(test)]
mod tests;
