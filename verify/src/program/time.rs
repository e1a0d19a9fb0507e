//! How long a machine takes for its moves, by feeds and accelerations.

use super::{
    modal::Blending,
    moves::{Move, Way},
};
use glam::DVec3;
use std::collections::VecDeque;

/// What a machine can do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dynamics {
    /// Greatest acceleration along any way, mm/s²; infinite for feeds alone.
    pub acceleration: f64,
    /// Speed of rapids, mm per minute.
    pub rapid_feed: f64,
    /// How far corners may be cut where the program does not say (no G61 nor G64 P), mm.
    pub corner_mm: f64,
}

/// Moves ahead of which speeds are planned, as controllers do: a machine that looks ahead further
/// gains nothing once it could stop within them.
const AHEAD: usize = 4096;
/// Where nothing bounds the speed in a corner, a turn by this cosine or less still stops.
const TURNS_BACK: f64 = -0.99;

/// One move as far as time goes.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    length: f64,
    /// Greatest speed, mm/s.
    speed: f64,
    /// Greatest speed at its beginning, mm/s.
    enters: f64,
}

/// Adds up the time of moves that are told one after another.
///
/// Speeds are trapezoidal: every move speeds up and slows down by the acceleration, as far as the
/// corners between the moves demand. In a corner of the turn `theta` the speed is the one whose
/// arc, of the acceleration's radius, cuts the corner by the tolerance `t` at most: `v² = a t
/// cos(theta / 2) / (1 - cos(theta / 2))`. Limits of single axes, of the control's cycle and of
/// jerk are not known here.
#[derive(Debug)]
pub struct Clock {
    dynamics: Dynamics,
    queue: VecDeque<Stretch>,
    /// Speed with which the first of the queue is entered, mm/s.
    entry: f64,
    seconds: f64,
    direction: Option<DVec3>,
}

impl Clock {
    /// A clock at 0.
    pub fn new(dynamics: Dynamics) -> Self {
        Self { dynamics, queue: VecDeque::new(), entry: 0.0, seconds: 0.0, direction: None }
    }

    /// Counts a move.
    pub fn moved(&mut self, made: &Move) {
        let length = made.length_mm();
        if length <= 0.0 {
            return;
        }
        let feed = match made.way {
            Way::Rapid => self.dynamics.rapid_feed,
            Way::Straight { feed } | Way::Arc { feed, .. } => feed.min(self.dynamics.rapid_feed),
        };
        let speed = feed / 60.0;
        let (begins, ends, radius) = match made.way {
            Way::Arc { arc, .. } => (arc.velocity(0.0), arc.velocity(1.0), arc.radius[0].min(arc.radius[1])),
            _ => {
                let way = made.to - made.from;
                let way = DVec3::select(way.is_nan_mask(), DVec3::ZERO, way);
                (way, way, f64::INFINITY)
            }
        };
        // Along an arc the machine accelerates towards its centre.
        let speed = speed.min((self.dynamics.acceleration * radius).sqrt());
        let before = self.direction.replace(ends.normalize_or_zero());
        let corner = before.map_or(0.0, |before| self.corner(before.dot(begins.normalize_or_zero()), made.blending));
        let enters = corner.min(speed).min(self.queue.back().map_or(0.0, |last| last.speed));
        self.queue.push_back(Stretch { length, speed, enters });
        if self.queue.len() >= 2 * AHEAD {
            self.settle(AHEAD);
        }
    }

    /// Counts a pause.
    pub fn dwelt(&mut self, seconds: f64) {
        self.stop();
        self.seconds += seconds;
    }

    /// The time so far, seconds, if the machine stops now.
    pub fn seconds(&mut self) -> f64 {
        self.stop();
        self.seconds
    }

    fn stop(&mut self) {
        self.settle(0);
        (self.entry, self.direction) = (0.0, None);
    }

    /// Greatest speed through a corner of this cosine of the turn, mm/s.
    fn corner(&self, cosine: f64, blending: Blending) -> f64 {
        let tolerance = match blending {
            Blending::Unsaid => self.dynamics.corner_mm,
            // Small turns are no corner to a control that samples its way.
            Blending::Exact => 1e-4,
            Blending::Within(mm) => mm.max(1e-4),
            Blending::Unbounded => {
                return if cosine <= TURNS_BACK { 0.0 } else { f64::INFINITY };
            }
        };
        let half = (0.5 * (1.0 + cosine.clamp(-1.0, 1.0))).sqrt();
        if half >= 1.0 { f64::INFINITY } else { (self.dynamics.acceleration * tolerance * half / (1.0 - half)).sqrt() }
    }

    /// Plans the queue, and counts all of it but its last `keep` moves.
    fn settle(&mut self, keep: usize) {
        let acceleration = self.dynamics.acceleration;
        // How fast every move may be entered so that the machine can still stop.
        let mut leaves = 0.0_f64;
        let mut limits = vec![0.0; self.queue.len()];
        for (k, stretch) in self.queue.iter().enumerate().rev() {
            let stops = (leaves * leaves + 2.0 * acceleration * stretch.length).sqrt();
            limits[k] = stretch.enters.min(stops);
            leaves = limits[k];
        }
        let count = self.queue.len().saturating_sub(keep);
        for k in 0..count {
            let Some(Stretch { length, speed, .. }) = self.queue.pop_front() else { break };
            let next = limits.get(k + 1).copied().unwrap_or(0.0);
            let enters = self.entry.min(speed);
            let leaves = next.min(speed).min((enters * enters + 2.0 * acceleration * length).sqrt());
            self.seconds += trapezoid(length, enters, speed, leaves, acceleration);
            self.entry = leaves;
        }
    }
}

/// Time for a length with these speeds at its beginning, at most, and at its end.
fn trapezoid(length: f64, enters: f64, speed: f64, leaves: f64, acceleration: f64) -> f64 {
    if !acceleration.is_finite() {
        return length / speed;
    }
    let top = (acceleration * length + 0.5 * (enters * enters + leaves * leaves)).sqrt().min(speed).max(enters);
    let ramps = (top * top - 0.5 * (enters * enters + leaves * leaves)) / acceleration;
    (2.0 * top - enters - leaves).max(0.0) / acceleration + (length - ramps).max(0.0) / top
}

#[cfg(test)]
mod tests {
    use super::*;

    fn straight(from: DVec3, to: DVec3, blending: Blending) -> Move {
        let way = Way::Straight { feed: 6000.0 };
        Move { line: 1, from, to, way, tool: 0, spindle_per_min: 0.0, blending }
    }

    #[test]
    fn times_are_those_of_trapezoids() {
        let dynamics = Dynamics { acceleration: 1000.0, rapid_feed: 6000.0, corner_mm: 0.01 };
        // 100 mm/s: up and down in 0.1 s and 5 mm each.
        let mut clock = Clock::new(dynamics);
        clock.moved(&straight(DVec3::ZERO, DVec3::X * 110.0, Blending::Unsaid));
        assert!((clock.seconds() - 1.2).abs() < 1e-12);
        // Too short to reach the feed.
        let mut clock = Clock::new(dynamics);
        clock.moved(&straight(DVec3::ZERO, DVec3::X * 2.5, Blending::Unsaid));
        assert!((clock.seconds() - 0.1).abs() < 1e-12);
        // In pieces the same way takes as long, of whatever number.
        let mut clock = Clock::new(dynamics);
        (0..20_000).for_each(|k| {
            let at = |k: u32| DVec3::X * (110.0 * f64::from(k) / 20_000.0);
            clock.moved(&straight(at(k), at(k + 1), Blending::Exact));
        });
        assert!((clock.seconds() - 1.2).abs() < 1e-9, "{}", clock.seconds());
    }

    #[test]
    fn corners_slow_down_as_far_as_they_must() {
        let dynamics = Dynamics { acceleration: 1000.0, rapid_feed: 6000.0, corner_mm: 0.01 };
        let round = |blending: Blending, dynamics: Dynamics| {
            let mut clock = Clock::new(dynamics);
            let corners = [DVec3::ZERO, DVec3::X * 110.0, DVec3::new(110.0, 110.0, 0.0)];
            corners.windows(2).for_each(|pair| clock.moved(&straight(pair[0], pair[1], blending)));
            clock.seconds()
        };
        let stops = round(Blending::Exact, dynamics);
        let default = round(Blending::Unsaid, dynamics);
        let within = round(Blending::Within(0.5), dynamics);
        let free = round(Blending::Unbounded, dynamics);
        assert!(stops > default && default > within && within > free, "{stops} {default} {within} {free}");
        assert!((free - 2.3).abs() < 1e-9 && stops < 2.4);
        // v² = a t c / (1 - c) at a right angle.
        let c = 0.5f64.sqrt();
        let v = (1000.0 * 0.01 * c / (1.0 - c)).sqrt();
        let loses = (100.0 - v).powi(2) / 1000.0 / 100.0;
        assert!((default - (2.3 + loses)).abs() < 1e-9, "{default} for {}", 2.3 + loses);
        let endless = Dynamics { acceleration: f64::INFINITY, ..dynamics };
        assert!((round(Blending::Exact, endless) - 2.2).abs() < 1e-12);
    }
}
