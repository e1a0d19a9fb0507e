//! The side file of a block: what must not be forgotten about it. docs/side-file.md explains every
//! key.

use super::annotated::{Annotated, Note};
use crate::{
    failure::Failure,
    solid::Origin,
    spec::{
        Settings,
        conflicts::check_file,
        mistakes::{self, Known},
    },
};
use glam::{DVec2, DVec3};
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A side file.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub struct SideFile {
    /// What was asked for.
    pub design: Settings,
    /// What light and block are to each other.
    pub bench: BenchRecord,
    /// Where the coordinates of the files are counted from.
    #[serde(default)]
    pub frame: FrameRecord,
    /// What has been done to the block since it was designed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub work: Option<WorkRecord>,
    /// Which pictures it was made from.
    pub picture: PictureRecord,
    /// The SHA-256 of every file of this name without its extension.
    #[serde(default)]
    pub files: IndexMap<String, String>,
    /// The numbers that stand in the metadata of height maps, by their files.
    #[serde(default, skip_deserializing, skip_serializing_if = "IndexMap::is_empty")]
    pub height_maps: IndexMap<String, IndexMap<String, toml::Value>>,
}

/// What light and block are to each other, in the frame of the bench: mm, radians.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub struct BenchRecord {
    /// Whether the exit face reflects.
    #[serde(default)]
    pub mirror: bool,
    /// Unit vector along which light travels before it meets the block; from a source, that of its
    /// axis.
    #[serde(default = "along_the_axis")]
    pub light_direction: [f64; 3],
    /// A point source, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source_mm: Option<[f64; 3]>,
    /// How it emits. For other programs: glasswarp goes by the settings.
    #[serde(flatten, skip_deserializing)]
    pub emission: Option<EmissionRecord>,
    /// Of the block; 1 for a mirror.
    pub ior: f64,
    /// Of the part of the exit face that draws, along x.
    pub width_mm: f64,
    /// The same along y.
    pub height_mm: f64,
    /// Of the exit face with its skirt, along x and y. For other programs.
    #[serde(default, skip_deserializing)]
    pub nodes: [usize; 2],
    /// Semi-axes of the corners of the exit face with its skirt. For other programs.
    #[serde(default, skip_deserializing)]
    pub corner_radius_mm: [f64; 2],
    /// The planar entry face.
    pub entry_z_mm: f64,
    /// Of the exit face, peak to valley.
    pub relief_mm: f64,
    /// From the entry face to the lowest point of the exit face.
    pub thinnest_mm: f64,
    /// From the mean plane of the exit face to the receiver, along the axis.
    pub distance_mm: f64,
    /// Of the picture on the receiver.
    pub window_width_mm: f64,
    /// Of the picture on the receiver.
    pub window_height_mm: f64,
    /// In the receiver's own coordinates.
    #[serde(default)]
    pub window_centre_mm: [f64; 2],
    /// A rotation vector about the receiver's point on the axis.
    #[serde(default)]
    pub receiver_turned: [f64; 3],
    /// How far the exit face goes on beyond `width_mm` and `height_mm`, on every side.
    #[serde(default)]
    pub skirt_mm: [f64; 2],
    /// Which way round the picture lies, for people.
    #[serde(skip_deserializing)]
    pub picture_orientation: &'static str,
}

/// The intensity of a point source by the angle to its axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "emission", rename_all = "kebab-case")]
pub enum EmissionRecord {
    /// The same in every direction.
    Isotropic,
    /// As the cosine.
    Lambertian,
    /// A Gaussian.
    Gaussian {
        /// Where half of the intensity is left.
        #[serde(rename = "emission-half-angle")]
        half_angle: f64,
    },
    /// As it was measured.
    Table {
        /// Angles, and the intensity there.
        #[serde(rename = "emission-table")]
        table: Vec<[f64; 2]>,
    },
}

/// Where the coordinates of the files are counted from, and what stands around the exit face.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub struct FrameRecord {
    /// Its name. For other programs, as is what stands around the face.
    #[serde(default, skip_deserializing)]
    pub origin: &'static str,
    /// In the frame of the bench.
    #[serde(default)]
    pub origin_mm: [f64; 3],
    /// Along x.
    #[serde(default)]
    pub stock_width_mm: f64,
    /// Along y.
    #[serde(default)]
    pub stock_height_mm: f64,
    /// From the entry face to the highest point.
    #[serde(default)]
    pub stock_thickness_mm: f64,
    /// On every side of the exit face.
    #[serde(skip_deserializing, skip_serializing_if = "Option::is_none")]
    pub rim_width_mm: Option<f64>,
    /// The plane of the rim, in the frame of the bench.
    #[serde(skip_deserializing, skip_serializing_if = "Option::is_none")]
    pub rim_z_mm: Option<f64>,
    /// Cut off the corner of the rim at +x, +y.
    #[serde(skip_deserializing, skip_serializing_if = "Option::is_none")]
    pub mark_mm: Option<f64>,
}

/// What has been done to a block in simulation.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct WorkRecord {
    /// In words.
    pub done: String,
}

/// Which pictures a block was made from.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub struct PictureRecord {
    /// Of the picture.
    pub sha256: String,
    /// Of the picture of the beam.
    #[serde(skip_deserializing, skip_serializing_if = "Option::is_none")]
    pub beam_sha256: Option<String>,
    /// Of the file of the block before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub behind_sha256: Option<String>,
}

fn along_the_axis() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

/// What messages call a side file.
const KIND: &str = "side file of a block";

impl SideFile {
    /// Reads a side file from memory; the paths that it names become relative to the working
    /// folder. `path` is its name.
    ///
    /// # Errors
    /// Mistakes, settings that exclude each other.
    pub fn parse(text: &str, path: &Path) -> Result<Self, Failure> {
        let mut side = mistakes::parse::<Self>(text, path, KIND, &Known::DESIGN)?;
        check_file(&side.design).map_err(|refusal| mistakes::placed(refusal, text, path))?;
        side.design.resolve_paths(path);
        Ok(side)
    }

    /// The text of the file; `name` is what it will be called, and its paths are written as they
    /// are.
    ///
    /// # Errors
    /// Settings that cannot be written as text.
    pub fn to_text(&self, name: &str) -> Result<String, Failure> {
        let mut file = Annotated::of(self)?;
        file.comment(&format!("Written by glasswarp {}. All lengths are millimetres.", env!("CARGO_PKG_VERSION")));
        let which = if self.work.is_some() { "the block before [work]" } else { "this block" };
        file.comment(&format!(
            "`glasswarp design {name}` makes {which} again, `glasswarp verify` reads its bench from here."
        ));
        file.table("design", "", DESIGN);
        let of_light = match self.bench.source_mm {
            Some(_) => "axis of the lamp, before it meets the block",
            None => "of parallel light, before it meets the block",
        };
        file.table("bench", "", &[&BENCH[..1], &[("light-direction", of_light)], &BENCH[1..]].concat());
        let origin =
            Origin::ALL.into_iter().find(|origin| origin.name() == self.frame.origin).map_or("", Origin::place);
        let about = "of the files: millimetres, z up (GLB: metres, y up); height maps keep to [bench]";
        file.table("frame", about, &[&[("origin", origin)], FRAME].concat());
        file.table("work", "", &[("done", "")]);
        file.table(
            "picture",
            "",
            &[("sha256", ""), ("beam-sha256", "of the picture of the beam"), ("behind-sha256", "of the block before")],
        );
        file.table("files", "sha256", &[]);
        file.tables("height-maps", "the numbers that stand in its metadata too");
        Ok(file.finish())
    }
}

impl BenchRecord {
    /// The share of the exit face that its skirt is.
    pub fn skirt_share(&self) -> f64 {
        let face = self.face_mm();
        1.0 - self.width_mm * self.height_mm / (face.x * face.y)
    }

    /// Size of the exit face with its skirt, mm.
    pub fn face_mm(&self) -> DVec2 {
        DVec2::new(self.width_mm, self.height_mm) + 2.0 * DVec2::from(self.skirt_mm)
    }
}

impl FrameRecord {
    /// From where coordinates are counted, in the frame of the bench, mm.
    pub fn origin_mm(&self) -> DVec3 {
        DVec3::from(self.origin_mm)
    }
}

/// The keys in the order in which they are written, each with what is said of it.
const DESIGN: &[Note] = &[
    ("picture", ""),
    ("size", ""),
    ("distance", ""),
    ("material", "its index is that of [bench]"),
    ("ior", ""),
    ("wavelength", ""),
    ("thickness", ""),
    ("facing", "taken off the top of the sheet before the face is cut"),
    ("window", "width of the picture on the receiver"),
    ("shift", "to the right and up, as seen from the block"),
    ("receiver-tilt", "this side recedes: 0 top, 90 right, 180 bottom, 270 left"),
    ("mirror", ""),
    ("light", ""),
    ("tilt", "the light comes from this side: 0 top, 90 right, 180 bottom, 270 left"),
    ("source-distance", "to the middle of the entry face"),
    ("emission", ""),
    ("beam", ""),
    ("behind", "the block before, and the air from its mean exit plane to the entry face of this one"),
    ("source-size", ""),
    ("roughness", "standard deviation of the slope along any direction"),
    ("psf", "and the size of its pixels on the receiver"),
    ("deconvolution", ""),
    ("deconvolution-rounds", ""),
    ("caustic-mesh", ""),
    ("outline", ""),
    ("skirt", ""),
    ("min-thickness", ""),
    ("nodes", ""),
    ("rim", "width, and height of its plane above the highest point of the exit face"),
    ("mark", ""),
    ("origin", ""),
    ("step-tolerance", "um"),
    ("margin", "share of the window that stays dark on every side"),
    ("vignette", ""),
    ("offset", ""),
    ("transfer", "whatever the picture's file says"),
    ("background", "behind the picture's transparent parts"),
    ("layer", ""),
    ("crop", "x, y, width, height of the part that is used"),
    ("rotate", "clockwise"),
    ("flip", ""),
    ("levels", "black, white, gamma"),
    ("invert", ""),
    ("solver", ""),
    ("quality", ""),
    ("min-radius", ""),
    ("finish", ""),
];

const BENCH: &[Note] = &[
    ("mirror", "whether the exit face reflects"),
    ("source-mm", "the lamp"),
    ("emission", "intensity by the angle to light-direction"),
    ("emission-half-angle", "radians, where half of the intensity is left"),
    ("emission-table", "radians, and the intensity there"),
    ("ior", ""),
    ("width-mm", "along x"),
    ("height-mm", "along y"),
    ("nodes", "of the exit face with its skirt, along x and y"),
    ("corner-radius-mm", "semi-axes of the elliptic corners of the exit face with its skirt"),
    ("entry-z-mm", "the planar face; the mean plane of the exit face is z = 0"),
    ("relief-mm", "of the exit face, peak to valley"),
    ("thinnest-mm", ""),
    ("distance-mm", "from the mean plane of the exit face, z = 0, to the receiver"),
    ("window-width-mm", "of the picture on the receiver"),
    ("window-height-mm", ""),
    ("window-centre-mm", "in the receiver's coordinates"),
    ("receiver-turned", "rotation vector, radians, about its point on the axis"),
    ("skirt-mm", "of the exit face beyond the picture's light, on every side"),
    ("picture-orientation", ""),
];

const FRAME: &[Note] = &[
    ("origin-mm", "in the frame of [bench]"),
    ("stock-width-mm", "along x"),
    ("stock-height-mm", "along y"),
    ("stock-thickness-mm", "from the entry face to the highest point"),
    ("rim-width-mm", "on every side of the exit face"),
    ("rim-z-mm", "its plane, in the frame of [bench]"),
    ("mark-mm", "cut off the corner at +x, +y: the picture's top left"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_setting_has_its_place_in_the_file() {
        let written: Vec<&str> = DESIGN.iter().map(|(key, _)| *key).collect();
        for name in Settings::NAMES {
            let key = name.replace('_', "-");
            assert!(written.contains(&key.as_str()) || key == "preset", "{key}");
        }
    }
}
