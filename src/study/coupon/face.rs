//! Where the fields of a coupon lie, and the face that they make together.
//!
//! The face is a sum: a profile along x, whose parts throw light to the ladder and to the uprights;
//! a profile along y, whose strips throw it to the rungs; and the waves. Each part is a lens that
//! brings the lamp to a line on the sheet, so that how large it is does not matter.

use super::plan::{CouponError, CouponPlan};
use crate::{
    grid::{Extent, Field},
    surface::HeightField,
};
use glam::DVec2;
use std::f64::consts::{LN_2, PI, TAU};

/// Size of the coupon along x and y, mm.
pub(super) const SIZE_MM: DVec2 = DVec2::new(32.0, 40.0);
/// Nodes along x and y: seven to the shortest wave, six to the narrowest seam.
const NODES: (usize, usize) = (801, 501);
/// Rulings of the ladder, and how many of them come before the second pair of marks.
const RULINGS: usize = 16;
const BEFORE_MARKS: usize = 8;
/// The polishes that make the coarsest and the finest bar as long as the marks, mm.
const SIGMA_MM: (f64, f64) = (0.45, 0.055);
/// Half of the length of a bar, mm: no more has room between the uprights, and with less its ends
/// could hardly be told from its middle.
const REACH_MM: (f64, f64) = (6.0, 12.0);
/// Period of the waves of the marks, mm.
const MARKS_PERIOD_MM: f64 = 4.5;
/// The sharpest hollow of a wave, in radii of the cutter.
const HOLLOW: f64 = 1.25;

/// On the sheet: from rung to rung, from the spot to the first one, and from the axis to an
/// upright, mm.
const PITCH_MM: f64 = 8.0;
const GAP_MM: f64 = 36.0;
const UPRIGHT_MM: f64 = 75.0;

/// Along x: from the axis to where the ladder ends and the wedges begin, and how wide that seam is,
/// mm.
pub(super) const LADDER_MM: f64 = 5.5;
const WEDGE_SEAM_MM: f64 = 2.0;
/// Along y: how high lens, marks and rulings are before they are stretched to fill the coupon, and
/// the seams between them, mm. A ruling is at least six standard deviations of its polish high.
const LENS_MM: f64 = 3.0;
const MARKS_MM: f64 = 2.4;
const LEAST_RULING_MM: f64 = 1.6;
const SIGMAS_HIGH: f64 = 6.0;
const SEAM_MM: f64 = 0.5;
const LENS_SEAM_MM: f64 = 1.5;

/// `exp(-2 pi^2 sigma^2 / L^2)`: what a polish leaves of a wave's amplitude.
fn left(sigma_mm: f64, period_mm: f64) -> f64 {
    (-2.0 * (PI * sigma_mm / period_mm).powi(2)).exp()
}

/// The polish that leaves this part of what it leaves of the marks, mm.
fn sigma_leaving(part: f64, period_mm: f64) -> f64 {
    let against = period_mm.powi(-2) - MARKS_PERIOD_MM.powi(-2);
    (-0.5 * part.ln() / against).max(0.0).sqrt() / PI
}

/// The period of the wave of which a polish leaves half of what it leaves of the marks, mm.
fn period_of(sigma_mm: f64) -> f64 {
    (0.5 * LN_2 / (PI * sigma_mm).powi(2) + MARKS_PERIOD_MM.powi(-2)).sqrt().recip()
}

/// A ruling of the ladder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ruling {
    /// Its number on the page, from 1.
    pub number: usize,
    /// Its period, mm.
    pub period_mm: f64,
    /// Amplitude of the wave, mm.
    pub amplitude_mm: f64,
    /// The standard deviation of the polish that makes its bar as long as the marks, mm.
    pub sigma_mm: f64,
    /// Where it lies on the face: from and to, along y, mm.
    pub strip_mm: [f64; 2],
}

impl Ruling {
    /// What a polish leaves of its wave, `exp(-2 pi^2 sigma^2 / L^2)`.
    pub fn left_by(&self, sigma_mm: f64) -> f64 {
        left(sigma_mm, self.period_mm)
    }

    /// The polish at which its bar is this many times as long as the marks, mm.
    pub fn sigma_at(&self, against_marks: f64) -> f64 {
        sigma_leaving(0.5 * against_marks, self.period_mm)
    }
}

/// What a strip of the face shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shows {
    /// A spot.
    Lens,
    /// A bar half as long as those of the rulings, which no polish of interest shortens.
    Marks,
    /// The ruling that tells this polish, mm.
    Ruling(f64),
}

impl Shows {
    fn high_mm(self) -> f64 {
        match self {
            Self::Lens => LENS_MM,
            Self::Marks => MARKS_MM,
            Self::Ruling(sigma_mm) => (SIGMAS_HIGH * sigma_mm).max(LEAST_RULING_MM),
        }
    }
}

/// A strip of the face, across all of the coupon.
#[derive(Clone, Copy, Debug)]
pub(super) struct Strip {
    pub(super) shows: Shows,
    /// Where it ends at the top and at the bottom, mm along y.
    pub(super) top_mm: f64,
    pub(super) bottom_mm: f64,
    /// Where its light goes, mm along y on the sheet.
    pub(super) rung_mm: f64,
    /// Period and amplitude of its wave, mm.
    pub(super) wave: Option<[f64; 2]>,
}

impl Strip {
    pub(super) fn middle_mm(&self) -> f64 {
        0.5 * (self.top_mm + self.bottom_mm)
    }
}

/// Where everything lies.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    /// Half of the length of a bar, mm.
    pub(super) reach_mm: f64,
    /// Strips of the face from the top: the lens, and the rungs of the ladder.
    pub(super) strips: Vec<Strip>,
    /// Displacement on the sheet per slope of the face, mm.
    throw_mm: f64,
    /// Displacement on the sheet per displacement on a flat face.
    spread: f64,
}

impl Layout {
    pub(super) fn of(plan: &CouponPlan) -> Result<Self, CouponError> {
        // To a few millimetres in a metre; what is read is computed from the face as it is.
        let throw_mm = (plan.ior - 1.0) * plan.distance_mm;
        let radius_mm = HOLLOW * plan.cutter.corner_mm();
        // A wave of period L and slope s is as hollow as s 2 pi / L.
        let reach_of = |period_mm: f64| throw_mm * period_mm / (TAU * radius_mm);
        let (coarsest, finest) = SIGMA_MM;
        let finest = finest.max(finest * REACH_MM.0 / reach_of(period_of(finest)));
        if finest > 0.5 * coarsest {
            let cutter = plan.cutter;
            return Err(CouponError::Coarse { cutter, finest_mm: finest, coarsest_mm: coarsest });
        }
        let reach_mm = reach_of(period_of(finest)).min(REACH_MM.1);
        let ruling = |k: usize| {
            let part = k as f64 / (RULINGS - 1) as f64;
            Shows::Ruling(coarsest * (finest / coarsest).powf(part))
        };
        let mut shows = vec![Shows::Lens, Shows::Marks];
        shows.extend((0..BEFORE_MARKS).map(ruling));
        shows.push(Shows::Marks);
        shows.extend((BEFORE_MARKS..RULINGS).map(ruling));
        shows.push(Shows::Marks);
        let stretched = SIZE_MM.y / shows.iter().map(|strip| strip.high_mm()).sum::<f64>();
        let mut rung_mm = 0.5 * (GAP_MM + PITCH_MM * (shows.len() - 2) as f64);
        let mut top_mm = 0.5 * SIZE_MM.y;
        let slope = reach_mm / throw_mm;
        let mut strips = Vec::new();
        for shows in shows {
            let wave = match shows {
                Shows::Lens => None,
                Shows::Marks => Some([MARKS_PERIOD_MM, 0.5 * slope * MARKS_PERIOD_MM / TAU]),
                Shows::Ruling(sigma_mm) => Some([period_of(sigma_mm), slope * period_of(sigma_mm) / TAU]),
            };
            let bottom_mm = top_mm - stretched * shows.high_mm();
            strips.push(Strip { shows, top_mm, bottom_mm, rung_mm, wave });
            top_mm = bottom_mm;
            rung_mm -= if shows == Shows::Lens { GAP_MM } else { PITCH_MM };
        }
        let spread = 1.0 + plan.distance_mm / plan.lamp_mm;
        Ok(Self { reach_mm, strips, throw_mm, spread })
    }

    pub(super) fn rulings(&self) -> Vec<Ruling> {
        let rulings = self.strips.iter().filter_map(|strip| match (strip.shows, strip.wave) {
            (Shows::Ruling(sigma_mm), Some(wave)) => Some((strip, sigma_mm, wave)),
            _ => None,
        });
        let ruling = |(k, (strip, sigma_mm, [period_mm, amplitude_mm])): (usize, (&Strip, f64, [f64; 2]))| Ruling {
            number: k + 1,
            period_mm,
            amplitude_mm,
            sigma_mm,
            strip_mm: [strip.bottom_mm, strip.top_mm],
        };
        rulings.enumerate().map(ruling).collect()
    }

    /// Places along x that stand for a wedge, mm.
    pub(super) fn wedge_places() -> impl Iterator<Item = f64> {
        let (from, to) = (LADDER_MM + 0.5 * WEDGE_SEAM_MM, 0.5 * SIZE_MM.x);
        (0..WEDGE_PLACES).map(move |k| from + (to - from) * (k as f64 + 0.5) / WEDGE_PLACES as f64)
    }

    /// The slope at a place that sends its light to another on the sheet.
    fn slope(&self, to_mm: f64, at_mm: f64) -> f64 {
        (to_mm - self.spread * at_mm) / self.throw_mm
    }

    /// The share of the wedges at a place along x; the rest is the ladder's.
    fn wedge(x: f64) -> f64 {
        step((x.abs() - LADDER_MM) / WEDGE_SEAM_MM + 0.5)
    }

    /// The share of every strip at a place along y.
    fn shares(&self, y: f64) -> impl Iterator<Item = f64> {
        let last = self.strips.len() - 1;
        let below = move |k: usize| {
            let seam = if k == 0 { LENS_SEAM_MM } else { SEAM_MM };
            step((self.strips[k].bottom_mm - y) / seam + 0.5)
        };
        (0..=last).map(move |k| {
            let begun = if k == 0 { 1.0 } else { below(k - 1) };
            begun - if k == last { 0.0 } else { below(k) }
        })
    }

    fn slope_x(&self, x: f64) -> f64 {
        // Light of the wedges crosses over: its way is longer, and what the index does to it
        // greater.
        let wedge = Self::wedge(x);
        (1.0 - wedge) * self.slope(0.0, x) + wedge * self.slope(-x.signum() * UPRIGHT_MM, x)
    }

    fn slope_y(&self, y: f64) -> f64 {
        self.shares(y).zip(&self.strips).map(|(share, strip)| share * self.slope(strip.rung_mm, y)).sum()
    }

    /// The face.
    pub(super) fn surface(&self) -> HeightField {
        let (nx, ny) = NODES;
        let extent = Extent::new(SIZE_MM.x, SIZE_MM.y);
        let along_x = integral(nx, SIZE_MM.x, |x| self.slope_x(x));
        let along_y = integral(ny, SIZE_MM.y, |y| self.slope_y(y));
        let wave = |strip: &Strip| -> Vec<f64> {
            let [period_mm, amplitude_mm] = strip.wave.unwrap_or([1.0, 0.0]);
            let places = (0..nx).map(|i| extent.node(i, 0, nx, ny).x);
            places.map(|x| amplitude_mm * (1.0 - Self::wedge(x)) * (TAU * x / period_mm).cos()).collect()
        };
        let waves: Vec<Vec<f64>> = self.strips.iter().map(wave).collect();
        let mut heights = Vec::with_capacity(nx * ny);
        for (j, &base) in along_y.iter().enumerate() {
            let shares = self.shares(extent.node(0, j, nx, ny).y).zip(&waves);
            let shares: Vec<(f64, &Vec<f64>)> = shares.filter(|(share, _)| *share != 0.0).collect();
            let wave = |i: usize| shares.iter().map(|(share, wave)| share * wave[i]).sum::<f64>();
            heights.extend(along_x.iter().enumerate().map(|(i, height)| base + height + wave(i)));
        }
        HeightField::new(extent, Field::from_vec(nx, ny, heights))
    }
}

/// Places of a wedge whose mean stands for it.
const WEDGE_PLACES: usize = 9;

/// Rises from 0 to 1, twice continuously differentiable.
fn step(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * t * (10.0 - 15.0 * t + 6.0 * t * t)
}

/// Heights at nodes whose slopes these are, by Simpson's rule between them.
fn integral(nodes: usize, size_mm: f64, slope: impl Fn(f64) -> f64) -> Vec<f64> {
    const PIECES: usize = 4;
    let piece = size_mm / ((nodes - 1) * PIECES) as f64;
    let place = |k: usize| -0.5 * size_mm + k as f64 * piece;
    let mut sum = 0.0;
    let mut heights = vec![0.0];
    for k in 0..nodes - 1 {
        for from in (k * PIECES..(k + 1) * PIECES).map(place) {
            sum += piece / 6.0 * (slope(from) + 4.0 * slope(from + 0.5 * piece) + slope(from + piece));
        }
        heights.push(sum);
    }
    heights
}
