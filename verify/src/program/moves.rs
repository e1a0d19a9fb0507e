//! What a program makes a machine do.

use super::{geometry::Arc, modal::Blending};
use glam::DVec3;

/// A move of the tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Move {
    /// The line of the file that makes it, from 1.
    pub line: u64,
    /// Where it begins, mm. Not a number where the program has not said it: before the first word
    /// of an axis, and after the machine went to a place of its own (G28, G53).
    pub from: DVec3,
    /// Where it ends, mm; not a number as above.
    pub to: DVec3,
    /// How it goes there.
    pub way: Way,
    /// Number of the tool in the spindle; 0 before the first one is named.
    pub tool: u32,
    /// Speed of the spindle, per minute; 0 while it stands.
    pub spindle_per_min: f64,
    /// How corners are treated.
    pub blending: Blending,
}

/// How a move goes from its beginning to its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Way {
    /// As fast as the machine can; on many machines not along a straight line.
    Rapid,
    /// Straight, at a feed, mm per minute.
    Straight {
        /// The feed, mm per minute.
        feed: f64,
    },
    /// Along an arc or a helix, at a feed, mm per minute.
    Arc {
        /// The curve.
        arc: Arc,
        /// The feed, mm per minute.
        feed: f64,
    },
}

impl Move {
    /// Whether it cuts.
    pub fn feeds(&self) -> bool {
        !matches!(self.way, Way::Rapid)
    }

    /// Its feed, mm per minute; `None` of a rapid.
    pub fn feed(&self) -> Option<f64> {
        match self.way {
            Way::Rapid => None,
            Way::Straight { feed } | Way::Arc { feed, .. } => Some(feed),
        }
    }

    /// Its length, mm. Axes whose place is not known count nothing.
    pub fn length_mm(&self) -> f64 {
        match self.way {
            Way::Arc { arc, .. } => arc.length_mm(),
            _ => {
                let known = |v: f64| if v.is_nan() { 0.0 } else { v };
                let way = self.to - self.from;
                DVec3::new(known(way.x), known(way.y), known(way.z)).length()
            }
        }
    }
}
