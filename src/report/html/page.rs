//! What is on the page, as plain data.

use crate::{
    bench::Bench,
    grid::Field,
    irradiance::Transfer,
    optim::Summary,
    report::{budget::Cost, drawing::Drawing, isocontours::Isocontours, pictures::Exposure},
    study::stand::Stand,
    surface::HeightField,
};
use glam::DVec2;
use image::GrayImage;
use serde::Serialize;

/// Everything that the page shows.
#[derive(Clone, Debug)]
pub struct Page<'a> {
    /// Name of the block.
    pub title: String,
    /// What is seen here, in a sentence or two.
    pub about: String,
    /// Whether it will work, before anything else, if that was asked.
    pub verdict: Option<TrafficLight>,
    /// What must be known.
    pub warnings: Vec<String>,
    /// A few figures that say most.
    pub highlights: Vec<Highlight>,
    /// The block on its bench.
    pub model: Model<'a>,
    /// The picture that the eye shall see, as far as there is one.
    pub target: Option<View>,
    /// What the eye gets: the light on the receiver.
    pub caustic: View,
    /// The same light, to be moved by hand, or what of it the numbers of a stand do not say.
    pub moving: Result<MovingLight, &'static str>,
    /// What the maker must know, in groups: what to order, where it stands.
    pub maker: Vec<Facts>,
    /// How far target and light are apart.
    pub difference: Option<View>,
    /// The light seen otherwise: with less exact geometry, from other files, after finishing; each
    /// with its difference from the target.
    pub others: Vec<(View, View)>,
    /// What each step costs.
    pub budget: Vec<Cost>,
    /// What the solver did.
    pub summary: Option<&'a Summary>,
    /// The workshop drawing of the block.
    pub drawing: Option<Drawing>,
    /// Facts for the engineer, in groups.
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

/// Light that a reader may move: the bench's as it was designed, and how it is shown.
#[derive(Clone, Debug, Serialize)]
pub struct MovingLight {
    /// The block on its bench.
    pub stand: Stand,
    /// Irradiance that becomes white, in means of the window.
    pub white: f64,
    /// Whether greys are the light itself, not encoded for a screen.
    pub linear: bool,
}

impl MovingLight {
    /// In this exposure, if the stand says all of the light.
    ///
    /// # Errors
    /// What it does not say.
    pub fn of(stand: Stand, exposure: Exposure) -> Result<Self, &'static str> {
        let linear = exposure.transfer == Transfer::Linear;
        stand.unsaid.map_or(Ok(Self { stand, white: exposure.white, linear }), Err)
    }
}

/// A question with its answer, in a colour.
#[derive(Clone, Debug)]
pub struct TrafficLight {
    /// What was asked.
    pub question: String,
    /// The answer in a word or two: colour alone tells nothing to many.
    pub answer: &'static str,
    /// The class of its colour in the styles.
    pub class: &'static str,
    /// Why, and what to do.
    pub says: String,
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
    pub(super) fn size(&self) -> String {
        let bytes = self.bytes as f64;
        match self.bytes {
            0..1_000 => format!("{}\u{a0}B", self.bytes),
            1_000..1_000_000 => format!("{:.1}\u{a0}kB", bytes / 1e3),
            _ => format!("{:.1}\u{a0}MB", bytes / 1e6),
        }
    }
}
