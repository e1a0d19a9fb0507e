//! What there is to say of a program without cutting anything: its size, feeds, tools, decimals,
//! the length of its straight pieces, its time.

use super::{
    error::{ProgramError, ProgramFault},
    interpret::{Run, Units, run},
    modal::Blending,
    moves::{Move, Way},
    time::{Clock, Dynamics},
    tool::{Tool, tools_in},
};
use glam::{DVec2, DVec3};
use std::{collections::BTreeMap, io::BufRead};

/// Where the work lies, in the coordinates of the program.
#[derive(Clone, Copy, Debug)]
pub struct SurveyLimits {
    /// Least and greatest corner of the face, mm.
    pub face: (DVec2, DVec2),
    /// The highest place of the stock, mm.
    pub top_mm: f64,
}

/// What was found.
#[derive(Clone, Debug)]
pub struct Survey {
    /// Lines of the file with a move, and moves that feed.
    pub moves: u64,
    /// The same, of those that feed.
    pub feed_moves: u64,
    /// Length of all feed moves, and of rapids as far as their ends are known, mm.
    pub feed_mm: f64,
    /// The same of rapids.
    pub rapid_mm: f64,
    /// Least and greatest place of the tip on all moves, mm.
    pub bounds: (DVec3, DVec3),
    /// The same of feed moves that reach below the top of the stock.
    pub cut_bounds: (DVec3, DVec3),
    /// Feeds, mm per minute, with the length that is cut at each, as many as are told apart.
    pub feeds: Vec<(f64, f64)>,
    /// How often the feed changes.
    pub feed_changes: u64,
    /// How many coordinates have so many decimals, and millimetres of their unit.
    pub decimals: [u64; 20],
    /// Millimetres of the unit of the last coordinate.
    pub unit_mm: f64,
    /// Every tool that is used, and what comments say of its shape.
    pub tools: BTreeMap<u32, ToolUse>,
    /// Shapes from comments without a number.
    pub unnumbered: Option<Tool>,
    /// How corners are treated on feed moves, in the order in which they come.
    pub blending: Vec<Blending>,
    /// Time with acceleration, seconds.
    pub seconds: f64,
    /// Time of dwells in it, seconds.
    pub dwell_seconds: f64,
    /// The highest speed of the spindle while feeding, per minute.
    pub spindle_per_min: f64,
    /// Whether something is cut while the spindle stands: line of the first such move.
    pub cuts_standing: Option<u64>,
    /// The tool that cuts the face last.
    pub finishes: Option<u32>,
}

/// What a tool does.
#[derive(Clone, Debug, Default)]
pub struct ToolUse {
    /// Its shape, from comments.
    pub shape: Option<Tool>,
    /// Whether it feeds anywhere.
    pub is_used: bool,
    /// Length that it feeds over the face and below the top of the stock, mm.
    pub over_face_mm: f64,
    /// That length by direction: 180 bins of a degree, from x towards y.
    pub directions: Vec<f64>,
    /// Lengths of its straight pieces over the face, by their own length, mm.
    pub pieces: Spread,
    /// How sharply these pieces turn up or down, rad, by their length.
    pub kinks: Spread,
    /// How far a smooth way lies off its pieces, mm: an eighth of the turn times the length.
    pub chord: Spread,
}

/// Most feeds that are told apart.
const MOST_FEEDS: usize = 32;
/// Most tools that are told apart.
const MOST_TOOLS: usize = 200;
/// Bins of directions.
const DIRECTIONS: usize = 180;

/// Positive numbers with weights, in bins of a tenth of a decade from 1e-9 to 1e5.
#[derive(Clone, Debug, Default)]
pub struct Spread {
    bins: Vec<f64>,
}

impl Spread {
    const LEAST: f64 = 1e-9;
    const PER_DECADE: f64 = 10.0;
    const BINS: usize = 140;

    fn add(&mut self, value: f64, weight: f64) {
        if self.bins.is_empty() {
            self.bins = vec![0.0; Self::BINS];
        }
        let bin = (Self::PER_DECADE * (value / Self::LEAST).log10()).floor();
        self.bins[bin.clamp(0.0, (Self::BINS - 1) as f64) as usize] += weight;
    }

    /// The number below which this part of the weight lies, to a quarter; `None` without any.
    pub fn quantile(&self, part: f64) -> Option<f64> {
        let all: f64 = self.bins.iter().sum();
        let mut sum = 0.0;
        self.bins.iter().enumerate().find_map(|(k, weight)| {
            sum += weight;
            (*weight > 0.0 && sum >= part * all).then(|| Self::LEAST * 10f64.powf((k as f64 + 0.5) / Self::PER_DECADE))
        })
    }
}

impl Survey {
    /// The finest decimal that coordinates are written with, mm; `None` where nothing is rounded
    /// visibly: fewer coordinates than that tells, or units whose decimals are too many to matter.
    ///
    /// Of numbers with another last digit, one in ten ends in a zero; so the finest that at least
    /// one in a hundred coordinates has is the one that they were rounded to.
    pub fn resolution_mm(&self) -> Option<f64> {
        let all: u64 = self.decimals.iter().sum();
        let finest = (0..self.decimals.len()).rev().find(|&k| self.decimals[k] * 100 > all)?;
        Some(self.unit_mm * 10f64.powi(-(finest as i32)))
    }

    /// What is known of the tool that cuts the face last.
    pub fn finishing(&self) -> Option<&ToolUse> {
        self.finishes.and_then(|number| self.tools.get(&number))
    }
}

struct Surveyor {
    survey: Survey,
    limits: SurveyLimits,
    clock: Clock,
    last_feed: f64,
    /// The straight piece that is being gone along: direction in the plan, slope, length.
    piece: Option<(DVec2, f64, f64)>,
    finest_mm: f64,
}

/// Reads a program and says what there is to say without cutting anything.
///
/// # Errors
/// Those of [`run`]; more tools than any magazine holds.
pub fn survey(
    reader: impl BufRead,
    units: Option<Units>,
    limits: SurveyLimits,
    dynamics: Dynamics,
) -> Result<Survey, ProgramError> {
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let survey = Survey {
        moves: 0,
        feed_moves: 0,
        feed_mm: 0.0,
        rapid_mm: 0.0,
        bounds: empty,
        cut_bounds: empty,
        feeds: Vec::new(),
        feed_changes: 0,
        decimals: [0; 20],
        unit_mm: 1.0,
        tools: BTreeMap::new(),
        unnumbered: None,
        blending: Vec::new(),
        seconds: 0.0,
        dwell_seconds: 0.0,
        spindle_per_min: 0.0,
        cuts_standing: None,
        finishes: None,
    };
    let clock = Clock::new(dynamics);
    let finest_mm = 1.0;
    let mut surveyor = Surveyor { survey, limits, clock, last_feed: 0.0, piece: None, finest_mm };
    run(reader, units, &mut surveyor)?;
    let mut survey = surveyor.survey;
    survey.seconds = surveyor.clock.seconds();
    Ok(survey)
}

impl Run for Surveyor {
    fn moved(&mut self, made: &Move) -> Result<(), ProgramFault> {
        let survey = &mut self.survey;
        self.clock.moved(made);
        survey.moves += 1;
        let length = made.length_mm();
        let (low, high) = match made.way {
            Way::Arc { arc, .. } => arc.bounds(),
            // Minimum and maximum pass over what is not a number.
            _ => (made.from.min(made.to), made.from.max(made.to)),
        };
        survey.bounds = (survey.bounds.0.min(low), survey.bounds.1.max(high));
        let Some(feed) = made.feed() else {
            survey.rapid_mm += length;
            self.piece = None;
            return Ok(());
        };
        if survey.tools.len() >= MOST_TOOLS && !survey.tools.contains_key(&made.tool) {
            return Err(ProgramFault::Refused {
                what: format!("a program of more than {MOST_TOOLS} tools"),
                remedy: "post the finishing pass by itself",
            });
        }
        survey.tools.entry(made.tool).or_default().is_used = true;
        survey.feed_moves += 1;
        survey.feed_mm += length;
        if feed != self.last_feed {
            survey.feed_changes += u64::from(self.last_feed > 0.0);
            self.last_feed = feed;
        }
        match survey.feeds.iter().position(|(known, _)| *known == feed) {
            Some(k) => survey.feeds[k].1 += length,
            None if survey.feeds.len() < MOST_FEEDS => survey.feeds.push((feed, length)),
            None => {}
        }
        if survey.blending.last() != Some(&made.blending) && survey.blending.len() < MOST_FEEDS {
            survey.blending.push(made.blending);
        }
        if low.z < self.limits.top_mm {
            survey.cut_bounds = (survey.cut_bounds.0.min(low), survey.cut_bounds.1.max(high));
            survey.spindle_per_min = survey.spindle_per_min.max(made.spindle_per_min);
            if made.spindle_per_min == 0.0 && survey.cuts_standing.is_none() {
                survey.cuts_standing = Some(made.line);
            }
        }
        self.over_face(made, length);
        Ok(())
    }

    fn comment(&mut self, _: u64, text: &str) {
        match tools_in(text, self.survey.unit_mm) {
            Some((0, tool)) => self.survey.unnumbered = Some(tool),
            Some((number, tool)) if self.survey.tools.len() < MOST_TOOLS => {
                self.survey.tools.entry(number).or_default().shape = Some(tool);
            }
            _ => {}
        }
    }

    fn coordinate(&mut self, decimals: u8, unit_mm: f64) {
        self.survey.unit_mm = unit_mm;
        self.survey.decimals[usize::from(decimals).min(19)] += 1;
        self.finest_mm = self.finest_mm.min(unit_mm * 10f64.powi(-i32::from(decimals)));
    }

    fn dwelt(&mut self, seconds: f64) {
        self.clock.dwelt(seconds);
        self.survey.dwell_seconds += seconds;
    }
}

impl Surveyor {
    /// Counts a feed move that cuts the face.
    fn over_face(&mut self, made: &Move, length: f64) {
        let (from, to) = (made.from.truncate(), made.to.truncate());
        let middle = 0.5 * (from + to);
        let (lower, upper) = self.limits.face;
        let inside = middle.cmpge(lower).all() && middle.cmple(upper).all();
        if !(inside && made.from.z.min(made.to.z) < self.limits.top_mm) {
            self.piece = None;
            return;
        }
        self.survey.finishes = Some(made.tool);
        let tool = self.survey.tools.entry(made.tool).or_default();
        tool.over_face_mm += length;
        if tool.directions.is_empty() {
            tool.directions = vec![0.0; DIRECTIONS];
        }
        let mut turned = |way: DVec2, length: f64| {
            let degrees = way.to_angle().to_degrees().rem_euclid(180.0);
            tool.directions[(degrees as usize).min(DIRECTIONS - 1)] += length;
        };
        if let Way::Arc { arc, .. } = made.way {
            (0..8).for_each(|k| turned(arc.velocity((f64::from(k) + 0.5) / 8.0).truncate(), 0.125 * length));
            self.piece = None;
            return;
        }
        let way = to - from;
        let run = way.length();
        if run == 0.0 {
            self.piece = None;
            return;
        }
        turned(way, length);
        let (direction, slope) = (way / run, (made.to.z - made.from.z) / run);
        let Some((before, rise, so_far)) = self.piece else {
            self.piece = Some((direction, slope, run));
            return;
        };
        // Rounded ends turn every move a little.
        let noise = (2.0 * self.finest_mm * (1.0 / run + 1.0 / so_far)).max(1e-6);
        let kink = slope - rise;
        if before.dot(direction) < 0.99 {
            self.piece = Some((direction, slope, run));
        } else if kink.abs() <= noise {
            let all = so_far + run;
            self.piece = Some((direction, (rise * so_far + slope * run) / all, all));
        } else {
            tool.pieces.add(so_far, so_far);
            tool.kinks.add(kink.abs(), so_far);
            tool.chord.add(0.125 * kink.abs() * so_far, so_far);
            self.piece = Some((direction, slope, run));
        }
    }
}
