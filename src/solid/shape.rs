//! What a workshop may ask of the block around its optical face: a rim to hold it by, a mark, and
//! another origin.

use super::SolidError;
use crate::grid::{Contour, Extent};
use glam::DVec2;
use std::fmt;

/// A planar frame around the exit face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rim {
    /// How far it reaches beyond the exit face on every side, mm.
    pub width_mm: f64,
    /// Its plane above the highest point of the exit face, mm. Above: a rim that keeps the face
    /// from being scratched. Negative: a flange to clamp the block by, below the whole border of
    /// the face.
    pub rise_mm: f64,
    /// Cuts off the outer corner at the top left of the picture as it is seen on the wall (+x, +y),
    /// by this length along both sides, mm: a block with this mark cannot be turned or mirrored
    /// unnoticed. Where there is no corner, it is a flat towards it, as deep as the cut: this
    /// length divided by the root of 2.
    pub mark_mm: Option<f64>,
}

/// Where the coordinates of files are counted from. Axes and units are always the library's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Origin {
    /// On the axis, in the mean plane of the exit face: the library's own frame.
    #[default]
    Exit,
    /// On the axis, in the entry face: the table, if the block lies on it.
    Entry,
    /// On the axis, at the highest point of the block.
    StockTop,
    /// At the corner of least x and y of the stock, in the entry face: no coordinate is negative.
    Corner,
}

impl Origin {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Exit, Self::Entry, Self::StockTop, Self::Corner];

    /// The name, as on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Exit => "exit",
            Self::Entry => "entry",
            Self::StockTop => "stock-top",
            Self::Corner => "corner",
        }
    }

    /// Where it is, in words of 7-bit text.
    pub const fn place(self) -> &'static str {
        match self {
            Self::Exit => "on the axis in the mean plane of the exit face",
            Self::Entry => "on the axis in the entry face",
            Self::StockTop => "on the axis at the highest point of the block",
            Self::Corner => "at the corner of least x and y in the entry face",
        }
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Everything about a block that is not its optical face or its stock.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shape {
    /// How far the exit face goes on, smoothly, beyond the part that draws the picture, mm, rounded
    /// up to whole cells: light from the side then enters through the entry face, and not through a
    /// wall.
    pub skirt_mm: f64,
    /// A frame around the exit face.
    pub rim: Option<Rim>,
    /// Where coordinates are counted from.
    pub origin: Origin,
}

/// Least step between the border of the exit face and the plane of the rim, mm: lower inner walls
/// would have triangles near the resolution of the files, and nobody could mill or feel them.
pub(super) const LEAST_STEP_MM: f64 = 0.05;
/// Least thickness of a flange, mm.
pub(super) const LEAST_FLANGE_MM: f64 = 1.0;

impl Shape {
    /// Refuses what no block of this size can have, before a surface is solved for.
    ///
    /// # Errors
    /// [`SolidError::Skirt`], [`SolidError::RimWidth`], [`SolidError::Mark`] or
    /// [`SolidError::RimHeight`].
    pub fn check(&self, face: Extent) -> Result<(), SolidError> {
        let greatest_mm = face.width_mm.min(face.height_mm);
        if !(0.0..=greatest_mm).contains(&self.skirt_mm) {
            return Err(SolidError::Skirt { width_mm: self.skirt_mm, greatest_mm });
        }
        let Some(rim) = self.rim else { return Ok(()) };
        let (least_mm, greatest_mm) = (0.5, face.width_mm.min(face.height_mm));
        if !(least_mm..=greatest_mm).contains(&rim.width_mm) {
            return Err(SolidError::RimWidth { width_mm: rim.width_mm, least_mm, greatest_mm });
        }
        if !rim.rise_mm.is_finite() {
            return Err(SolidError::RimHeight {
                rise_mm: rim.rise_mm,
                raised_mm: LEAST_STEP_MM,
                lowered_mm: f64::NAN,
                lowest_mm: f64::NAN,
            });
        }
        match rim.mark_mm {
            Some(mark_mm) if !(0.5..=rim.width_mm).contains(&mark_mm) => {
                Err(SolidError::Mark { mark_mm, least_mm: 0.5, greatest_mm: rim.width_mm })
            }
            _ => Ok(()),
        }
    }

    /// How far the stock rises above the highest point of the exit face, mm.
    pub(super) fn rise_mm(&self) -> f64 {
        self.rim.map_or(0.0, |rim| rim.rise_mm.max(0.0))
    }

    /// The flat that a mark cuts off a rim within this curve: what lies further than a length, mm,
    /// along a unit vector.
    pub(super) fn flat(&self, curve: &Contour) -> Option<(DVec2, f64)> {
        let mark_mm = self.rim?.mark_mm?;
        let along = DVec2::splat(std::f64::consts::FRAC_1_SQRT_2);
        Some((along, curve.reach_mm(along) - mark_mm * std::f64::consts::FRAC_1_SQRT_2))
    }

    /// Corners of a rectangular block as seen along the axis, mm, counter-clockwise from +z and
    /// from the corner of least x and y.
    pub fn outline(&self, face: Extent) -> Vec<DVec2> {
        let reach = 0.5 * face.as_vec() + self.rim.map_or(0.0, |rim| rim.width_mm);
        let mut corners = vec![-reach, DVec2::new(reach.x, -reach.y)];
        match self.rim.and_then(|rim| rim.mark_mm) {
            Some(mark) => corners.extend([reach - DVec2::new(0.0, mark), reach - DVec2::new(mark, 0.0)]),
            None => corners.push(reach),
        }
        corners.push(DVec2::new(-reach.x, reach.y));
        corners
    }
}

impl Rim {
    /// The plane of the rim, mm, over the heights of the border of the exit face and the entry
    /// plane.
    pub(super) fn plane_mm(self, highest_mm: f64, border_mm: (f64, f64), entry_z_mm: f64) -> Result<f64, SolidError> {
        let plane = highest_mm + self.rise_mm;
        let (low, high) = border_mm;
        let lowest = entry_z_mm + LEAST_FLANGE_MM;
        let raised = plane >= high + LEAST_STEP_MM;
        let lowered = plane <= low - LEAST_STEP_MM && plane >= lowest;
        if raised || lowered {
            return Ok(plane);
        }
        Err(SolidError::RimHeight {
            rise_mm: self.rise_mm,
            raised_mm: high + LEAST_STEP_MM - highest_mm,
            lowered_mm: low - LEAST_STEP_MM - highest_mm,
            lowest_mm: lowest - highest_mm,
        })
    }
}
