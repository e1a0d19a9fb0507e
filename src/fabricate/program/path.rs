//! The way of the tip over a face.

use super::{
    super::{Cutter, Direction, DropCutter, Pass, PassError, Rows},
    fit::Upright,
};
use crate::{grid::Contour, surface::HeightField};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::{borrow::Cow, f64::consts::TAU, fmt, str::FromStr};

/// How a way lies on the face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pattern {
    /// Rows along the pass's direction.
    #[default]
    Rows,
    /// One spiral from the middle outwards.
    Spiral,
    /// Closed ways like the outline, from outside inwards.
    ContourParallel,
}

impl fmt::Display for Pattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Rows => "rows",
            Self::Spiral => "spiral",
            Self::ContourParallel => "contour-parallel",
        })
    }
}

impl FromStr for Pattern {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        [Self::Rows, Self::Spiral, Self::ContourParallel]
            .into_iter()
            .find(|pattern| pattern.to_string() == text)
            .ok_or_else(|| format!("'{text}' is no pattern: write rows, spiral or contour-parallel"))
    }
}

/// In which sense rows are cut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sense {
    /// To and fro.
    #[default]
    BothWays,
    /// Always with the uncut glass on the right, as a spindle that turns clockwise (M3) climbs.
    Climb,
}

/// A roughing pass in levels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roughing {
    /// What cuts.
    pub cutter: Cutter,
    /// From row to row, mm.
    pub step_over_mm: f64,
    /// From level to level, mm.
    pub step_down_mm: f64,
    /// What it leaves for the finishing pass, along the normal, mm.
    pub allowance_mm: f64,
}

/// A way of the tip, mm on the zero of the face.
#[derive(Clone, Debug)]
pub(super) struct Way {
    /// Places on it, near to each other.
    pub(super) places: Vec<DVec3>,
    /// Whether it begins where the last one ended, or so near that the tip goes there as it is.
    pub(super) goes_on: bool,
    /// The axis that it lies along, if it does.
    pub(super) upright: Option<Upright>,
}

impl Way {
    pub(super) fn length_mm(&self) -> f64 {
        self.places.windows(2).map(|pair| pair[0].distance(pair[1])).sum()
    }
}

/// What keeps the tip up besides the face: the entry face, and a rim around the outline.
pub(super) struct Guard {
    pub(super) contour: Contour,
    pub(super) rim_mm: Option<f64>,
    pub(super) least_mm: f64,
    /// The highest place of the stock.
    pub(super) top_mm: f64,
    pub(super) cutter: Cutter,
}

impl Guard {
    /// How low the tip may go with its axis at a point, if the face allows.
    fn floor(&self, at: DVec2) -> f64 {
        let rim = self.rim_mm.map_or(f64::NEG_INFINITY, |rim| {
            // The rim is level, and begins at the outline.
            let inside = (-self.contour.level(at).distance_mm).max(0.0);
            if inside >= self.cutter.radius_mm() { f64::NEG_INFINITY } else { rim - self.cutter.profile_mm(inside) }
        });
        rim.max(self.least_mm)
    }

    fn reaches(&self, at: DVec2) -> bool {
        self.contour.level(at).distance_mm <= self.cutter.radius_mm() * (1.0 + 1e-9)
    }
}

/// Places of a curved way are as near as this part of the cutter's radius, and a third of the
/// nodes' spacing.
const PER_RADIUS: f64 = 0.03;
/// A way that begins nearer to the last one's end than so many step-overs goes on from it.
const NEAR: f64 = 1.5;
/// A way that begins or ends over the face is joined along its tangent: so far before it, in
/// radii, and so much higher.
const LEAD: f64 = 1.0;
const LEAD_UP: f64 = 0.3;
/// Places of a lead.
const LEAD_PLACES: usize = 8;

/// The finishing way.
pub(super) fn finishing(
    surface: &HeightField,
    pass: Pass,
    pattern: Pattern,
    sense: Sense,
    (guard, off_mm): (&Guard, f64),
) -> Result<Vec<Way>, PassError> {
    let face = &*sheet_of(surface);
    let mut ways = match pattern {
        Pattern::Rows => rows(face, pass, sense, (guard, off_mm))?,
        Pattern::Spiral | Pattern::ContourParallel => {
            pass.check(surface.extent())?;
            let plans = if pattern == Pattern::Spiral { spiral(surface, &pass) } else { contours(surface, &pass) };
            dropped(face, &pass, plans, guard)
        }
    };
    let drop = DropCutter::new(face, pass.cutter);
    lead(&mut ways, &drop, guard);
    link(&mut ways, pass.cutter.radius_mm());
    Ok(ways)
}

/// The face as it is cut: beyond an outline that is no rectangle it goes straight on.
fn sheet_of(surface: &HeightField) -> Cow<'_, HeightField> {
    if surface.contour().is_rectangle() { Cow::Borrowed(surface) } else { Cow::Owned(surface.sheet()) }
}

/// Whether a way that begins here goes on from the last one.
fn is_near(ways: &[Way], begin: DVec3, pass: &Pass) -> bool {
    let end = ways.last().and_then(|last| last.places.last());
    end.is_some_and(|end| end.truncate().distance(begin.truncate()) < NEAR * pass.step_over_mm)
}

/// Rows to and fro, or all in the sense in which the cutter climbs.
fn rows(face: &HeightField, pass: Pass, sense: Sense, (guard, off_mm): (&Guard, f64)) -> Result<Vec<Way>, PassError> {
    let rows = Rows::along(face, pass)?;
    let upright = match (rows.along.x == 0.0, rows.along.y == 0.0) {
        (false, true) => Some(Upright::X),
        (true, false) => Some(Upright::Y),
        _ => None,
    };
    let along_row = |row: usize| -> Vec<DVec3> {
        row_places(&rows, row, off_mm)
            .filter(|p| guard.reaches(p.truncate()))
            .map(|p| p.with_z(p.z.max(guard.floor(p.truncate()))))
            .collect()
    };
    let mut ways: Vec<Way> = Vec::new();
    let all: Vec<Vec<DVec3>> = (0..rows.count).into_par_iter().map(along_row).collect();
    for mut places in all.into_iter().filter(|places| places.len() >= 2) {
        // Later rows lie on the left of the direction.
        if sense == Sense::Climb || ways.len() % 2 == 1 {
            places.reverse();
        }
        let goes_on = sense == Sense::BothWays && is_near(&ways, places[0], &pass);
        ways.push(Way { places, goes_on, upright });
    }
    Ok(ways)
}

/// Places of the tip along a row, so near to each other that straight lines between them are no
/// further off the way than a part of `off`, mm: between the positions of a row it is cubic.
fn row_places<'a>(rows: &'a Rows<'_>, row: usize, off: f64) -> impl Iterator<Item = DVec3> + 'a {
    let (h, positions) = (rows.spacing_mm, rows.positions);
    let aside = rows.first.y + row as f64 * rows.pass.step_over_mm;
    let place = move |u: f64, z: f64| (u * rows.along + aside * rows.across).extend(z);
    let at = move |position: f64| rows.first.x + position * h;
    let kinks = &rows.kinks[row];
    (0..positions).flat_map(move |i| {
        let known = |i: usize| i < positions && rows.tips[row * positions + i][0].is_finite();
        let mut parts = Vec::new();
        if known(i) {
            parts.push(0.0);
        }
        if known(i) && known(i + 1) {
            let bend = |part: f64| rows.tip(row, at(i as f64 + part)).map_or(0.0, |tip| tip.bend.abs());
            let most = bend(0.25).max(bend(0.75));
            let inside = |part: f64| rows.surface.contour().contains(place(at(i as f64 + part), 0.0).truncate());
            let off = if inside(0.0) || inside(1.0) { off } else { off.max(EDGE_MM) };
            let pieces = (h * (most / (8.0 * PART_OF_BOUND * off)).sqrt()).ceil().clamp(1.0, 64.0) as usize;
            parts.extend((1..pieces).map(|k| k as f64 / pieces as f64));
            // Where the contact jumps, both ways meet.
            if let Ok(k) = kinks.binary_search_by_key(&i, |kink| kink.position) {
                parts.push(kinks[k].at);
                parts.sort_by(f64::total_cmp);
            }
        }
        parts.into_iter().filter_map(move |part| {
            let z = if part == 0.0 {
                rows.tips[row * positions + i][0]
            } else {
                rows.tip(row, at(i as f64 + part))?.height
            };
            Some(place(at(i as f64 + part), z))
        })
    })
}

/// How far strokes beyond the border of the face may lie off the way, mm.
pub(super) const EDGE_MM: f64 = 2e-5;
/// Part of a bound that places of a row may take: the rest is for strokes between them.
const PART_OF_BOUND: f64 = 0.5;

/// A spiral whose turns lie a step-over apart, out to the furthest corner.
fn spiral(surface: &HeightField, pass: &Pass) -> Vec<Vec<DVec2>> {
    let spacing = spacing(surface, pass);
    let reach = 0.5 * surface.extent().as_vec().length() + pass.cutter.radius_mm();
    let per_radian = pass.step_over_mm / TAU;
    let (mut angle, mut way) = (0.0, Vec::new());
    while per_radian * angle < reach {
        let radius = per_radian * angle;
        way.push(radius * DVec2::from_angle(angle));
        angle += spacing / radius.max(pass.step_over_mm);
    }
    vec![way]
}

/// Ways like the outline, a step-over apart, from one radius outside to the middle.
fn contours(surface: &HeightField, pass: &Pass) -> Vec<Vec<DVec2>> {
    let (size, radius, spacing) = (surface.extent().as_vec(), pass.cutter.radius_mm(), spacing(surface, pass));
    let least = 0.5 * size.min_element();
    let mut ways = Vec::new();
    let mut inset = -radius;
    while inset < least {
        let grown = crate::grid::Extent::new(size.x - 2.0 * inset, size.y - 2.0 * inset);
        let outline = surface.outline().grown(-inset);
        let corners = outline.within(grown).polygon(0.1 * CLOSE_MM);
        let mut way = Vec::new();
        for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            let pieces = (a.distance(*b) / spacing).ceil().max(1.0) as usize;
            way.extend((0..pieces).map(|k| a.lerp(*b, k as f64 / pieces as f64)));
        }
        // Clockwise, with the glass that is still uncut on the right.
        way.reverse();
        way.extend(way.first().copied());
        ways.push(way);
        inset += pass.step_over_mm;
    }
    ways
}

/// Curves of an outline are followed to this, mm.
const CLOSE_MM: f64 = 1e-3;

fn spacing(surface: &HeightField, pass: &Pass) -> f64 {
    let node = surface.extent().node_spacing(surface.heights_mm().nx(), surface.heights_mm().ny()).min_element();
    (PER_RADIUS * pass.cutter.radius_mm()).min(node / 3.0)
}

/// Curves of the plan as ways of a cutter that is dropped at every place of them; beyond its reach
/// they are cut apart.
fn dropped(face: &HeightField, pass: &Pass, plans: Vec<Vec<DVec2>>, guard: &Guard) -> Vec<Way> {
    const CHUNK: usize = 256;
    let drop = DropCutter::new(face, pass.cutter.grown(pass.allowance_mm));
    let mut ways: Vec<Way> = Vec::new();
    for plan in plans {
        let heights: Vec<Option<f64>> = plan
            .par_chunks(CHUNK)
            .flat_map_iter(|places| {
                let mut last = DVec2::ZERO;
                places
                    .iter()
                    .map(|&at| {
                        if !guard.reaches(at) {
                            return None;
                        }
                        let contact = drop.drop(at, at + last)?;
                        last = contact.at - at;
                        Some((contact.tip_mm + pass.allowance_mm).max(guard.floor(at)))
                    })
                    .collect::<Vec<_>>()
            })
            .collect();
        let mut places = Vec::new();
        let mut end = |places: &mut Vec<DVec3>| {
            if places.len() >= 2 {
                let goes_on = is_near(&ways, places[0], pass);
                ways.push(Way { places: std::mem::take(places), goes_on, upright: None });
            }
            places.clear();
        };
        for (at, height) in plan.iter().zip(heights) {
            match height {
                Some(z) => places.push(at.extend(z)),
                None => end(&mut places),
            }
        }
        end(&mut places);
    }
    ways
}

/// How far above both of its ends a link goes across, in radii: what it crosses may bulge between
/// them.
const LINK_UP: f64 = 0.1;

/// Ways that go on from the last one go there above the face.
fn link(ways: &mut [Way], radius: f64) {
    for k in 1..ways.len() {
        let (before, rest) = ways.split_at_mut(k);
        let (Some(&end), Some(&begin)) = (before[k - 1].places.last(), rest[0].places.first()) else { continue };
        if rest[0].goes_on {
            let z = end.z.max(begin.z) + LINK_UP * radius;
            rest[0].places.splice(0..0, [end.with_z(z), begin.with_z(z)]);
        }
    }
}

/// Joins ways that begin or end by themselves along their tangents, from above.
fn lead(ways: &mut [Way], drop: &DropCutter<'_>, guard: &Guard) {
    let radius = guard.cutter.radius_mm();
    let joined = |at: DVec3, away: DVec2| -> Vec<DVec3> {
        (1..=LEAD_PLACES)
            .map(|k| {
                let part = k as f64 / LEAD_PLACES as f64;
                let place = at.truncate() + part * LEAD * radius * away;
                let face = drop.drop(place, place).map_or(f64::NEG_INFINITY, |contact| contact.tip_mm);
                // Up along a parabola, which leaves the way without a corner.
                place.extend(at.z.max(face).max(guard.floor(place)) + part * part * LEAD_UP * radius)
            })
            .collect()
    };
    for k in 0..ways.len() {
        let ends = ways.get(k + 1).is_none_or(|next| !next.goes_on);
        let way = &mut ways[k];
        let count = way.places.len();
        if ends {
            let away = (way.places[count - 1] - way.places[count - 2]).truncate().normalize_or_zero();
            let out = joined(way.places[count - 1], away);
            way.places.extend(out);
        }
        if !way.goes_on {
            let away = (way.places[0] - way.places[1]).truncate().normalize_or_zero();
            let mut places = joined(way.places[0], away);
            places.reverse();
            places.append(&mut way.places);
            way.places = places;
        }
    }
}

/// How far roughing may be off its way, mm.
const ROUGH_MM: f64 = 0.01;
/// How steeply a roughing cutter goes down along its way.
const RAMP: f64 = 0.1;
/// Levels differ from what is left by at least this, mm.
const LEAST_LEVEL_MM: f64 = 0.02;

/// Rows in levels, wherever the level before has left glass.
pub(super) fn roughing(surface: &HeightField, rough: &Roughing, guard: &Guard) -> Result<Vec<Way>, PassError> {
    let Roughing { cutter, step_over_mm, step_down_mm, allowance_mm } = *rough;
    let face = &*sheet_of(surface);
    let pass = Pass { cutter, step_over_mm, direction: Direction::X, allowance_mm };
    let rows = Rows::along(face, pass)?;
    let all: Vec<Vec<DVec3>> = (0..rows.count)
        .map(|row| {
            row_places(&rows, row, ROUGH_MM)
                .filter(|p| guard.reaches(p.truncate()))
                .map(|p| p.with_z(p.z.max(guard.floor(p.truncate()) + allowance_mm)))
                .collect()
        })
        .collect();
    let lowest = all.iter().flatten().map(|p| p.z).fold(f64::INFINITY, f64::min);
    let mut ways = Vec::new();
    let mut above = guard.top_mm;
    while above > lowest + LEAST_LEVEL_MM {
        let level = (above - step_down_mm).max(lowest);
        for (k, row) in all.iter().enumerate() {
            let mut piece: Vec<DVec3> = Vec::new();
            for p in row.iter().copied().map(Some).chain([None]) {
                match p.filter(|p| p.z < above - LEAST_LEVEL_MM) {
                    Some(p) => piece.push(p.with_z(p.z.max(level))),
                    None if piece.len() >= 2 => {
                        if k % 2 == 1 {
                            piece.reverse();
                        }
                        ways.push(Way {
                            places: ramped(std::mem::take(&mut piece), above),
                            goes_on: false,
                            upright: None,
                        });
                    }
                    None => piece.clear(),
                }
            }
        }
        above = level;
    }
    Ok(ways)
}

/// A way that goes down along itself, back to its beginning, and then along.
fn ramped(piece: Vec<DVec3>, above: f64) -> Vec<DVec3> {
    let mut down = Vec::new();
    let mut gone = 0.0;
    for (k, p) in piece.iter().enumerate() {
        gone += if k > 0 { piece[k - 1].truncate().distance(p.truncate()) } else { 0.0 };
        let z = above - RAMP * gone;
        if z <= p.z {
            break;
        }
        down.push(p.with_z(z));
    }
    let back = piece[..down.len()].iter().rev().copied().collect::<Vec<_>>();
    down.into_iter().chain(back).chain(piece).collect()
}
