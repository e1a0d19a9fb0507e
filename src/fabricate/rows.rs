//! Moving a cutter along parallel rows.

use super::{Cutter, CutterShape, DropCutter};
use crate::{
    grid::{Contour, Extent},
    surface::HeightField,
};
use glam::DVec2;
use rayon::prelude::*;
use std::{fmt, str::FromStr};

/// The direction of the rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction {
    degrees: f64,
}

impl Direction {
    /// Rows along x.
    pub const X: Self = Self { degrees: 0.0 };
    /// Rows along y.
    pub const Y: Self = Self { degrees: 90.0 };

    /// Rows at an angle from the x axis towards the y axis, degrees.
    pub const fn at(degrees: f64) -> Self {
        Self { degrees }
    }

    /// Unit vector along the rows; exact along the axes.
    pub fn unit(self) -> DVec2 {
        match self.degrees.rem_euclid(180.0) {
            0.0 => DVec2::X,
            90.0 => DVec2::Y,
            degrees => DVec2::from_angle(degrees.to_radians()),
        }
    }
}

impl fmt::Display for Direction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.degrees {
            0.0 => f.write_str("x"),
            90.0 => f.write_str("y"),
            degrees => write!(f, "{degrees}deg"),
        }
    }
}

impl FromStr for Direction {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim() {
            "x" => Ok(Self::X),
            "y" => Ok(Self::Y),
            angle => match angle.strip_suffix("deg").unwrap_or(angle).trim().parse::<f64>() {
                Ok(degrees) if degrees.abs() <= 360.0 => Ok(Self { degrees }),
                _ => Err(format!("'{text}' is no direction: write x, y or an angle such as 45deg")),
            },
        }
    }
}

/// One pass over the whole face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pass {
    /// What cuts.
    pub cutter: Cutter,
    /// From row to row, mm.
    pub step_over_mm: f64,
    /// Along what.
    pub direction: Direction,
    /// What the pass leaves on the face, measured along its normal, mm: 0 for the last pass, the
    /// allowance for finishing of a roughing pass.
    pub allowance_mm: f64,
}

/// Why a pass cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PassError {
    /// A step-over that is none, or beyond which rows leave walls between them.
    #[error(
        "the step-over is {step_over_mm} mm; it must lie between {} mm and the cutter's diameter of {diameter_mm} mm",
        Pass::LEAST_STEP_OVER_MM
    )]
    StepOver {
        /// The refused step-over, mm.
        step_over_mm: f64,
        /// The cutter's diameter, mm.
        diameter_mm: f64,
    },
    /// A cutter that does not fit onto the block.
    #[error(
        "the cutter {cutter} is {} mm across, more than the stock of {width_mm} x {height_mm} mm: take a smaller cutter",
        2.0 * cutter.radius_mm()
    )]
    CutterExceedsStock {
        /// The refused cutter.
        cutter: Cutter,
        /// Width of the block, mm.
        width_mm: f64,
        /// Height of the block, mm.
        height_mm: f64,
    },
    /// An allowance that is none.
    #[error("the allowance is {allowance_mm} mm; it must lie between 0 mm and {} mm", Pass::MOST_ALLOWANCE_MM)]
    Allowance {
        /// The refused allowance, mm.
        allowance_mm: f64,
    },
    /// More than can be kept in memory.
    #[error(
        "resolving rows {step_over_mm} mm apart takes {nx} x {ny} nodes, more than {most}: take a larger step-over, a smaller block, or rows along x or y",
        most = Pass::MOST_NODES
    )]
    TooFine {
        /// Step-over, mm.
        step_over_mm: f64,
        /// Nodes along x.
        nx: usize,
        /// Nodes along y.
        ny: usize,
    },
}

impl Pass {
    /// Least accepted step-over, mm.
    pub const LEAST_STEP_OVER_MM: f64 = 0.001;
    /// Greatest accepted allowance, mm.
    pub const MOST_ALLOWANCE_MM: f64 = 10.0;
    /// Most nodes of a milled face: a gigabyte for the heights alone.
    pub const MOST_NODES: usize = 1 << 27;

    /// The finishing pass along x.
    pub fn finishing(cutter: Cutter, step_over_mm: f64) -> Self {
        Self { cutter, step_over_mm, direction: Direction::X, allowance_mm: 0.0 }
    }

    /// Refuses what cannot be done on a block of this size.
    ///
    /// # Errors
    /// [`PassError`], except for [`PassError::TooFine`].
    pub fn check(&self, block: Extent) -> Result<(), PassError> {
        let diameter_mm = 2.0 * self.cutter.radius_mm();
        if !(Self::LEAST_STEP_OVER_MM..=diameter_mm).contains(&self.step_over_mm) {
            return Err(PassError::StepOver { step_over_mm: self.step_over_mm, diameter_mm });
        }
        if diameter_mm > block.width_mm.min(block.height_mm) {
            let Extent { width_mm, height_mm } = block;
            return Err(PassError::CutterExceedsStock { cutter: self.cutter, width_mm, height_mm });
        }
        if !(0.0..=Self::MOST_ALLOWANCE_MM).contains(&self.allowance_mm) {
            return Err(PassError::Allowance { allowance_mm: self.allowance_mm });
        }
        Ok(())
    }

    /// What the pass takes on a block of this outline, seen from above: rows to and fro that run
    /// out by the cutter's radius at both ends, and the links between them.
    pub fn cost(&self, block: &Contour) -> RowsCost {
        let along = self.direction.unit();
        let across = along.perp();
        let count = 1 + (2.0 * block.reach_mm(across) / self.step_over_mm).ceil() as usize;
        let first = -0.5 * (count - 1) as f64 * self.step_over_mm;
        let length = |k: usize| {
            // Rows beside the block by rounding still cut its edge.
            let reach = block.reach_mm(across);
            let aside = (first + k as f64 * self.step_over_mm).clamp(-reach, reach);
            let chord = block.chord_mm(aside * across, along).map_or(0.0, |(begin, end)| end - begin);
            chord + 2.0 * self.cutter.radius_mm()
        };
        let rows: f64 = (0..count).map(length).sum();
        RowsCost { rows: count, length_mm: rows + (count - 1) as f64 * self.step_over_mm }
    }
}

/// What a pass takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowsCost {
    /// Number of rows.
    pub rows: usize,
    /// Length of the cutter's way, mm.
    pub length_mm: f64,
}

impl RowsCost {
    /// Time at a feed, minutes: without acceleration, which makes it longer.
    pub fn minutes(&self, feed_mm_per_min: f64) -> f64 {
        self.length_mm / feed_mm_per_min
    }
}

/// The way of the cutter's tip along all rows: at equidistant places its height and how steeply it
/// rises there.
#[derive(Debug)]
pub struct Rows<'a> {
    pub(super) surface: &'a HeightField,
    pub(super) pass: Pass,
    /// Unit vectors along and across the rows.
    pub(super) along: DVec2,
    pub(super) across: DVec2,
    /// Places of the first row and of the first position in every row, mm.
    pub(super) first: DVec2,
    /// Positions in a row, and from one to the next, mm.
    pub(super) positions: usize,
    pub(super) spacing_mm: f64,
    /// Number of rows.
    pub(super) count: usize,
    /// Tip height and its slope along the row; infinite where the cutter passes the block.
    pub(super) tips: Vec<[f64; 2]>,
    /// In every row, in order, what its tips do not tell.
    pub(super) kinks: Vec<Vec<Kink>>,
}

/// Between two positions the contact jumps, and another contact may hold the cutter up on the way:
/// where the tangents of both meet it has been dropped once more.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kink {
    /// The position before it.
    pub(super) position: usize,
    /// Where between, in parts of the spacing.
    pub(super) at: f64,
    /// Height of the tip and its slope there.
    pub(super) tip: [f64; 2],
}

/// Positions in a row are at most this part of the node spacing apart: the way of the tip is cubic
/// between them, and its error is curved, which light notices.
const PER_NODE: f64 = 1.0 / 3.0;
/// And at most these parts of the radius of a ball, of the radius of a corner (whose disc bends the
/// way of the tip suddenly), and of that of a sharp rim.
const PER_BALL: f64 = 0.1;
const PER_CORNER: f64 = 0.05;
const PER_RIM: f64 = 0.02;

impl<'a> Rows<'a> {
    /// Drops the cutter along every row.
    ///
    /// # Errors
    /// What [`Pass::check`] refuses.
    pub fn along(surface: &'a HeightField, pass: Pass) -> Result<Self, PassError> {
        let extent = surface.extent();
        pass.check(extent)?;
        let (along, radius) = (pass.direction.unit(), pass.cutter.radius_mm());
        let across = along.perp();
        let contour = surface.contour();
        let half = |axis: DVec2| contour.reach_mm(axis) + radius + pass.allowance_mm;
        let node = extent.node_spacing(surface.heights_mm().nx(), surface.heights_mm().ny()).min_element();
        let fine = match pass.cutter.shape() {
            CutterShape::Ball => PER_BALL * radius,
            CutterShape::Bull => PER_CORNER * pass.cutter.corner_mm(),
            CutterShape::Flat => PER_RIM * radius,
        };
        let positions = 1 + (2.0 * half(along) / fine.min(PER_NODE * node)).ceil() as usize;
        let spacing_mm = 2.0 * half(along) / (positions - 1) as f64;
        let count = 1 + (2.0 * half(across) / pass.step_over_mm).floor() as usize;
        let first = DVec2::new(-half(along), -0.5 * (count - 1) as f64 * pass.step_over_mm);
        // Leaving an allowance is cutting with a cutter that has grown by it.
        let drop = DropCutter::new(surface, pass.cutter.grown(pass.allowance_mm));
        let mut tips = vec![[f64::INFINITY, 0.0]; count * positions];
        let mut kinks = vec![Vec::new(); count];
        tips.par_chunks_mut(positions).zip(&mut kinks).enumerate().for_each(|(k, (row, kinks))| {
            let drop_at = |place: f64, offset: DVec2| {
                let u = first.x + place * spacing_mm;
                let axis = u * along + (first.y + k as f64 * pass.step_over_mm) * across;
                let contact = drop.drop(axis, axis + offset)?;
                let offset = contact.at - axis;
                let slope = slope(&drop.cutter(), offset, along);
                Some((offset, slope.map(|slope| [contact.tip_mm + pass.allowance_mm, slope])))
            };
            let mut last: Option<DVec2> = None;
            for i in 0..positions {
                let Some((offset, tip)) = drop_at(i as f64, last.unwrap_or_default()) else {
                    last = None;
                    continue;
                };
                row[i] = tip.unwrap_or(row[i]);
                let jumped = last.is_some_and(|last| last.distance(offset) > JUMP * spacing_mm);
                let meets = if jumped { meeting(row[i - 1], row[i], spacing_mm) } else { None };
                kinks.extend(meets.and_then(|at| {
                    let (_, tip) = drop_at(i as f64 - 1.0 + at, offset)?;
                    Some(Kink { position: i - 1, at, tip: tip? })
                }));
                last = Some(offset);
            }
            differences(row, spacing_mm);
        });
        Ok(Self { surface, pass, along, across, first, positions, spacing_mm, count, tips, kinks })
    }

    /// The pass.
    pub fn pass(&self) -> &Pass {
        &self.pass
    }

    /// Number of rows, those beside the block which still touch its edge included.
    pub fn count(&self) -> usize {
        self.count
    }
}

/// How steeply the tip rises along the row: by the envelope theorem the profile's slope at the
/// contact. Not a number where a sharp rim touches. `None` where the flank touches an edge of the
/// block: rows run out before that, and the glass is none the wiser.
fn slope(cutter: &Cutter, offset: DVec2, along: DVec2) -> Option<f64> {
    let from_axis = offset.length();
    if cutter.corner_mm() == 0.0 {
        return Some(f64::NAN);
    }
    let slope = cutter.profile_slope(from_axis);
    if slope > STEEPEST {
        None
    } else if from_axis > 0.0 {
        Some(slope * offset.dot(along) / from_axis)
    } else {
        Some(0.0)
    }
}

/// No face is as steep as this; only edges are touched so. Over an edge the way of the tip is the
/// profile upside down, of which a cubic over a stretch `h` misses `h^4 / 384 * 3 (1 + 4 s^2 / (1 +
/// s^2)) (1 + s^2)^(7/2) / r^3` at the slope `s`: at the spacings above 6e-5 of the corner's radius
/// at a slope of 2, and twelve times as much at 3.
const STEEPEST: f64 = 2.0;

/// A contact that moves by more than this many spacings from one position to the next has jumped.
const JUMP: f64 = 8.0;

/// Where between two positions the tangents of both meet below them, in parts of the spacing.
fn meeting([a, p]: [f64; 2], [b, q]: [f64; 2], spacing_mm: f64) -> Option<f64> {
    let (p, q) = (p * spacing_mm, q * spacing_mm);
    let at = (a - b + q) / (q - p);
    (q > p && at > 0.0 && at < 1.0).then_some(at)
}

/// Fills in slopes that are not known, by differences of neighbours.
fn differences(row: &mut [[f64; 2]], spacing_mm: f64) {
    for i in 0..row.len() {
        if row[i][0].is_finite() && row[i][1].is_nan() {
            let (left, right) = (i.saturating_sub(1), (i + 1).min(row.len() - 1));
            let at = |k: usize| if row[k][0].is_finite() { (k, row[k][0]) } else { (i, row[i][0]) };
            let ((a, low), (b, high)) = (at(left), at(right));
            row[i][1] = if b > a { (high - low) / ((b - a) as f64 * spacing_mm) } else { 0.0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{Field, Outline};
    use crate::measured::at_worst;

    const BLOCK: Extent = Extent::new(60.0, 40.0);

    #[test]
    fn senseless_passes_are_refused_with_value_and_limit() {
        let ball = Cutter::ball(3.0).unwrap();
        for step_over in [0.0, -0.1, f64::NAN, 6.1] {
            let error = Pass::finishing(ball, step_over).check(BLOCK).unwrap_err();
            assert!(matches!(error, PassError::StepOver { .. }) && error.to_string().contains("6 mm"), "{error}");
        }
        let error = Pass::finishing(Cutter::ball(20.5).unwrap(), 0.1).check(BLOCK).unwrap_err().to_string();
        assert!(error.contains("41 mm") && error.contains("60 x 40 mm"), "{error}");
        let pass = Pass { allowance_mm: -0.2, ..Pass::finishing(ball, 0.1) };
        assert!(matches!(pass.check(BLOCK), Err(PassError::Allowance { .. })));
        assert!("sideways".parse::<Direction>().is_err());
        assert_eq!("45deg".parse::<Direction>().unwrap(), Direction::at(45.0));
    }

    #[test]
    fn the_way_is_as_long_as_the_rows() {
        let pass = Pass::finishing(Cutter::ball(2.0).unwrap(), 0.5);
        let cost = pass.cost(&Outline::Rectangle.within(BLOCK));
        assert_eq!(cost.rows, 81);
        assert!((cost.length_mm - (81.0 * 64.0 + 80.0 * 0.5)).abs() < 1e-9);
        assert!((cost.minutes(2000.0) - cost.length_mm / 2000.0).abs() < 1e-12);
        let across = Pass { direction: Direction::Y, ..pass }.cost(&Outline::Rectangle.within(BLOCK));
        assert_eq!(across.rows, 121);
        // Slanted rows cover the same area.
        let slanted = Pass { direction: Direction::at(30.0), ..pass }.cost(&Outline::Rectangle.within(BLOCK));
        let cutting = slanted.length_mm - slanted.rows as f64 * (4.0 + 0.5) + 0.5;
        assert!((cutting * 0.5 - 2400.0).abs() < 1e-9, "{cutting}");
    }

    #[test]
    fn rows_over_a_disc_are_its_chords() {
        let disc = Outline::Circle.within(Extent::new(40.0, 40.0));
        for degrees in [0.0, 30.0, 90.0] {
            let pass = Pass { direction: Direction::at(degrees), ..Pass::finishing(Cutter::ball(2.0).unwrap(), 0.1) };
            let cost = pass.cost(&disc);
            assert_eq!(cost.rows, 401);
            let chords = cost.length_mm - 401.0 * 4.0 - 400.0 * 0.1;
            at_worst(1.33e-4, (0.1 * chords / disc.area_mm2() - 1.0).abs(), format_args!("{degrees}: {chords}"));
        }
    }

    #[test]
    fn tips_rise_as_their_slopes_say() {
        let surface = HeightField::new(
            BLOCK,
            Field::from_fn(121, 81, |i, j| {
                let p = BLOCK.node(i, j, 121, 81);
                0.5 * (0.2 * p.x).sin() * (0.15 * p.y).cos()
            }),
        );
        let pass = Pass { direction: Direction::at(20.0), ..Pass::finishing(Cutter::ball(3.0).unwrap(), 2.0) };
        let rows = Rows::along(&surface, pass).unwrap();
        let row = &rows.tips[rows.count / 2 * rows.positions..][..rows.positions];
        let middle = rows.positions / 4..3 * rows.positions / 4;
        for i in middle {
            let difference = (row[i + 1][0] - row[i - 1][0]) / (2.0 * rows.spacing_mm);
            at_worst(1.9e-5, (difference - row[i][1]).abs(), format_args!("{i}: {difference} for {}", row[i][1]));
        }
    }
}
