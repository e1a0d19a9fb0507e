//! A block on one page of HTML, for the people who will make it: pictures, maps, drawings, charts, and a model to turn in the
//! hand.
//!
//! The page is one file that asks for nothing else: styles, scripts, pictures and heights are embedded, and its own policy
//! forbids it to load anything. [`Page`] holds plain data; what it says in words is said by whoever fills it.

mod charts;
mod data;
mod maps;
mod rays;
mod scene;
mod section;
mod still;

use crate::{
    bench::Bench,
    export::{WriteError, write_atomically},
    grid::Field,
    optim::Summary,
    report::Isocontours,
    surface::{HeightField, SurfaceSpline},
};
use askama::Template;
use charts::{BudgetChart, ConvergenceChart};
use glam::DVec2;
use image::{DynamicImage, GrayImage};
use maps::ColourMap;
use rayon::prelude::*;
use rays::RayFan;
use section::{Across, Section};
use std::{io::Write, path::Path};
use still::Still;

/// Everything that the page shows.
#[derive(Clone, Debug)]
pub struct Page<'a> {
    /// Name of the block.
    pub title: String,
    /// What is seen here, in a sentence or two.
    pub about: String,
    /// What must be known before anything else.
    pub warnings: Vec<String>,
    /// A few figures that say most.
    pub highlights: Vec<Highlight>,
    /// The block on its bench.
    pub model: Model<'a>,
    /// The picture that is wanted, as far as there is one.
    pub target: Option<View>,
    /// The light on the receiver.
    pub caustic: View,
    /// How far the two are apart.
    pub difference: Option<View>,
    /// The light seen otherwise: with less exact geometry, from other files, after finishing; each with its difference from
    /// the target.
    pub others: Vec<(View, View)>,
    /// What each step costs.
    pub budget: Vec<Cost>,
    /// What the solver did.
    pub summary: Option<&'a Summary>,
    /// The workshop drawing of the block.
    pub drawing: Option<GrayImage>,
    /// Facts, in groups.
    pub facts: Vec<Facts>,
    /// Files that belong to the block.
    pub files: Vec<FileRecord>,
    /// The command that makes all of this again.
    pub command: String,
    /// The program and its version.
    pub program: String,
}

/// A block on its bench.
#[derive(Clone, Debug)]
pub struct Model<'a> {
    /// The exit face.
    pub surface: &'a HeightField,
    /// The planar entry face, mm.
    pub entry_z_mm: f64,
    /// Corners of the block seen along the axis, mm, counter-clockwise.
    pub outline: Vec<DVec2>,
    /// The plane of the rim, mm, if there is one.
    pub rim_z_mm: Option<f64>,
    /// Light and receiver.
    pub bench: &'a Bench,
    /// Slope of the face at its nodes, mm per mm.
    pub slope: &'a Field<f64>,
    /// The greater principal curvature at its nodes, per mm, positive in hollows.
    pub hollow_per_mm: &'a Field<f64>,
    /// Its lines of equal height.
    pub contours: &'a Isocontours,
}

/// A figure that is read first.
#[derive(Clone, Debug)]
pub struct Highlight {
    /// What it is.
    pub label: String,
    /// The figure.
    pub value: String,
    /// Its unit, or nothing.
    pub unit: String,
    /// What it means.
    pub note: String,
}

/// A picture with what it shows, for eyes and for those who cannot see it.
#[derive(Clone, Debug)]
pub struct View {
    /// A few words above it.
    pub title: String,
    /// A line below it.
    pub note: String,
    /// What is to be seen on it.
    pub alt: String,
    /// The picture.
    pub picture: GrayImage,
}

/// A step of the error budget.
#[derive(Clone, Debug)]
pub struct Cost {
    /// What is looked at.
    pub name: String,
    /// Relative RMS error of its light against the target, and by how much it alone moves the light. `None` if it is known to
    /// be that of another step, as the name says.
    pub errors: Option<(f64, f64)>,
}

/// A table of facts.
#[derive(Clone, Debug)]
pub struct Facts {
    /// What they are about.
    pub title: String,
    /// Names and values with their units.
    pub rows: Vec<(String, String)>,
}

/// A file on the disk.
#[derive(Clone, Debug)]
pub struct FileRecord {
    /// Its name.
    pub name: String,
    /// What it is.
    pub what: String,
    /// Its length.
    pub bytes: u64,
    /// Its SHA-256 in hexadecimal.
    pub sha256: String,
}

impl FileRecord {
    /// The length for people.
    fn size(&self) -> String {
        let bytes = self.bytes as f64;
        match self.bytes {
            0..1_000 => format!("{}\u{a0}B", self.bytes),
            1_000..1_000_000 => format!("{:.1}\u{a0}kB", bytes / 1e3),
            _ => format!("{:.1}\u{a0}MB", bytes / 1e6),
        }
    }
}

/// Writes the page. The file appears whole or not at all.
///
/// # Errors
/// A file that cannot be written.
pub fn write_html(path: &Path, page: &Page<'_>) -> Result<(), WriteError> {
    let text = render(page);
    write_atomically(path, |writer| writer.write_all(text.as_bytes()))
}

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
        scene,
        still,
        sections: [Across::X, Across::Y].map(|across| Section::of(model, &spline, &fan, across)).into(),
        budget: BudgetChart::of(&page.budget),
        convergence: page.summary.and_then(ConvergenceChart::of),
        drawing: page.drawing.as_ref().map(|drawing| data::png_uri(&DynamicImage::from(drawing.clone()))),
        style: include_str!("style.css"),
        viewer: include_str!("viewer.js"),
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
    scene: String,
    still: Still,
    sections: Vec<Section>,
    budget: BudgetChart,
    convergence: Option<ConvergenceChart>,
    drawing: Option<String>,
    style: &'static str,
    viewer: &'static str,
    script: &'static str,
}

/// A picture on the page.
struct Figure {
    title: String,
    note: String,
    alt: String,
    uri: String,
    width: u32,
    height: u32,
}

impl Figure {
    fn of(view: &View, most_px: u32) -> Self {
        let picture = data::shrunk(&view.picture, most_px);
        let (width, height) = picture.dimensions();
        let uri = data::png_uri(&DynamicImage::from(picture));
        Self { title: view.title.clone(), note: view.note.clone(), alt: view.alt.clone(), uri, width, height }
    }

    /// Few pixels are shown as such.
    fn rendering(&self) -> &'static str {
        if self.width.max(self.height) < 200 { "coarse" } else { "fine" }
    }
}

/// The face as isocontours and maps.
struct FaceFigures {
    contours: String,
    interval: String,
    slope: ColourMap,
    hollow: ColourMap,
}

impl FaceFigures {
    fn of(model: &Model<'_>) -> Self {
        let (contours, (slope, hollow)) = rayon::join(
            || data::png_uri(&DynamicImage::from(model.contours.picture.clone())),
            || {
                rayon::join(
                    || maps::slope(model.slope, model.surface.extent(), MAP_PX),
                    || maps::hollow(model.hollow_per_mm, model.surface.extent(), MAP_PX),
                )
            },
        );
        let interval = super::contour_interval_mm(model.surface)
            .map_or_else(|| "the face is flat".to_owned(), |step| format!("a line every {} mm", data::figure(step)));
        Self { contours, interval, slope, hollow }
    }
}

#[cfg(test)]
mod tests;
