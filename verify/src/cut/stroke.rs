//! Strokes: moves of a cutter as what they leave.

use super::profile::Profile;
use crate::program::{Arc, Move, Tool, Way};
use glam::{DVec2, DVec3};

/// A cutter going straight along a line, or along a short piece of an arc.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stroke {
    /// Where its tip begins, mm.
    begin: DVec3,
    /// Its direction in the plan; zero if it stays in its place.
    along: DVec2,
    /// Its length in the plan, mm, and how it rises per mm.
    length: f64,
    rise: f64,
    /// The lowest place of the tip, mm.
    pub(super) lowest: f64,
    /// How far the way lies off the line at most, mm: 0 but for arcs.
    pub(super) off: f64,
    profile: u16,
    /// Which curve, if it is not the line; `u32::MAX` for none.
    curve: u32,
    /// Place of its move among all.
    pub(super) order: u64,
}

/// A piece of an arc: the parts between which it lies.
#[derive(Clone, Copy, Debug)]
struct Piece {
    arc: Arc,
    from: f64,
    to: f64,
}

/// What a cutter leaves at a point when it goes past.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Touch {
    /// The height, mm; infinite out of its reach.
    pub(super) height: f64,
    /// The slope there, mm per mm.
    pub(super) slope: DVec2,
    /// The place of the tip that leaves it.
    pub(super) tip: DVec3,
}

impl Touch {
    const NONE: Self = Self { height: f64::INFINITY, slope: DVec2::ZERO, tip: DVec3::ZERO };
}

/// Strokes of some tools, in the order of the program.
#[derive(Clone, Debug, Default)]
pub struct Strokes {
    pub(super) list: Vec<Stroke>,
    pieces: Vec<Piece>,
    profiles: Vec<Profile>,
    /// Where they are of any concern, mm.
    region: Option<(DVec2, DVec2)>,
    /// How many moves were told.
    pub(super) moves: u64,
}

const STRAIGHT: u32 = u32::MAX;
/// Arcs are cut into pieces no longer than this part of the cutter's radius, and that turn by no
/// more than this angle, rad, over each of which the problem has one solution.
const PIECE: f64 = 0.25;
const TURN: f64 = 0.2;
/// Steps towards the place of an arc that touches.
const STEPS: usize = 60;
/// Steps after which only halving is trusted: the edge of a flat cutter is a jump.
const QUICK: usize = 12;

impl Strokes {
    /// No strokes yet, of these tools.
    pub fn of(tools: &[Tool]) -> Self {
        Self { profiles: tools.iter().map(Profile::of).collect(), ..Self::default() }
    }

    /// The same, of arcs only the pieces that come within reach of a rectangle, mm: an arc that is
    /// large beside it takes no more memory than what of it lies there.
    #[must_use]
    pub fn within(self, low: DVec2, high: DVec2) -> Self {
        Self { region: Some((low, high)), ..self }
    }

    /// Forgets the strokes and keeps the tools.
    pub fn clear(&mut self) {
        self.list.clear();
        self.pieces.clear();
    }

    /// Number of strokes.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Adds what a move does with the tool of this index; one whose ends are not known is counted
    /// and leaves nothing.
    pub fn add(&mut self, made: &Move, tool: usize) {
        let order = self.moves;
        self.moves += 1;
        if made.to.is_nan() || made.from.is_nan() {
            return;
        }
        let Way::Arc { arc, .. } = made.way else {
            self.list.push(Stroke::along(made.from, made.to, (tool as u16, STRAIGHT, 0.0), order));
            return;
        };
        let longest = PIECE * self.profiles[tool].radius_mm();
        let count = (arc.length_mm() / longest).max(arc.angle[1].abs() / TURN).ceil().clamp(1.0, 1e15) as u64;
        self.pieces_of(&arc, (0, count, count), tool, order);
    }

    /// Adds the pieces of an arc from one number to another, of so many in all.
    fn pieces_of(&mut self, arc: &Arc, (first, end, count): (u64, u64, u64), tool: usize, order: u64) {
        let (from, to) = (first as f64 / count as f64, end as f64 / count as f64);
        let (begin, last, off) = (arc.at(from), arc.at(to), arc.sagitta_mm(to - from));
        if let Some((low, high)) = self.region {
            let reach = DVec2::splat(self.profiles[tool].radius_mm() + off);
            let (a, b) = (begin.truncate(), last.truncate());
            if a.min(b).cmpgt(high + reach).any() || a.max(b).cmplt(low - reach).any() {
                return;
            }
        }
        if end - first > 1 {
            let middle = first + (end - first) / 2;
            self.pieces_of(arc, (first, middle, count), tool, order);
            self.pieces_of(arc, (middle, end, count), tool, order);
            return;
        }
        let curve = self.pieces.len() as u32;
        self.pieces.push(Piece { arc: *arc, from, to });
        self.list.push(Stroke::along(begin, last, (tool as u16, curve, off), order));
    }

    /// Whether a move with the tool of this index comes within reach of a rectangle, mm, and below
    /// a height.
    pub fn comes_near(&self, made: &Move, tool: usize, (low, high): (DVec2, DVec2), below: f64) -> bool {
        let (from, to) = match made.way {
            Way::Arc { arc, .. } => arc.bounds(),
            _ => (made.from.min(made.to), made.from.max(made.to)),
        };
        let reach = DVec2::splat(self.profiles[tool].radius_mm());
        from.z < below && from.truncate().cmple(high + reach).all() && to.truncate().cmpge(low - reach).all()
    }

    /// Whether a stroke comes within reach of a rectangle, mm, below a height.
    pub(super) fn reaches(&self, k: usize, (low, high): (DVec2, DVec2), below: f64) -> bool {
        let stroke = &self.list[k];
        let (a, b) = (stroke.begin.truncate(), stroke.end());
        let reach = DVec2::splat(self.reach(k));
        stroke.lowest < below && a.min(b).cmple(high + reach).all() && a.max(b).cmpge(low - reach).all()
    }

    /// How far from its line a stroke reaches, mm.
    pub(super) fn reach(&self, k: usize) -> f64 {
        let stroke = &self.list[k];
        self.profiles[usize::from(stroke.profile)].radius_mm() + stroke.off
    }

    /// Bounds of a stroke's line in the plan, mm.
    pub(super) fn bounds(&self, k: usize) -> (DVec2, DVec2) {
        let stroke = &self.list[k];
        let (a, b) = (stroke.begin.truncate(), stroke.end());
        (a.min(b), a.max(b))
    }

    /// The least that a stroke can leave within `radius` of a point, mm: coarse.
    pub(super) fn at_least(&self, k: usize, at: DVec2, radius: f64) -> f64 {
        let stroke = &self.list[k];
        let from = (stroke.distance(at) - radius - stroke.off).max(0.0);
        stroke.lowest + self.profiles[usize::from(stroke.profile)].height_mm(from)
    }

    /// What a stroke's line leaves at a point: of a piece of an arc, its chord.
    #[inline]
    pub(super) fn line(&self, k: usize, at: DVec2) -> Touch {
        let stroke = &self.list[k];
        stroke.touch(&self.profiles[usize::from(stroke.profile)], at)
    }

    /// What a stroke leaves at a point.
    #[inline]
    pub(super) fn touch(&self, k: usize, at: DVec2) -> Touch {
        let stroke = &self.list[k];
        let profile = &self.profiles[usize::from(stroke.profile)];
        if stroke.curve == STRAIGHT {
            stroke.touch(profile, at)
        } else {
            self.pieces[stroke.curve as usize].touch(profile, at)
        }
    }

    /// What the tool of a stroke leaves at a point with its tip at a place.
    pub(super) fn standing(&self, k: usize, tip: DVec3, at: DVec2) -> f64 {
        tip.z + self.profiles[usize::from(self.list[k].profile)].height_mm(tip.truncate().distance(at))
    }
}

impl Stroke {
    fn along(begin: DVec3, end: DVec3, (profile, curve, off): (u16, u32, f64), order: u64) -> Self {
        let way = end - begin;
        let length = way.truncate().length();
        let lowest = begin.z.min(end.z) - off;
        // Up or down, or nearly so: the lower end leaves all that is left.
        if length <= 1e-12 {
            let begin = begin.truncate().extend(begin.z.min(end.z));
            let (along, length, rise) = (DVec2::ZERO, 0.0, 0.0);
            return Self { begin, along, length, rise, lowest, off, profile, curve, order };
        }
        let (along, rise) = (way.truncate() / length, way.z / length);
        Self { begin, along, length, rise, lowest, off, profile, curve, order }
    }

    fn end(&self) -> DVec2 {
        self.begin.truncate() + self.length * self.along
    }

    fn distance(&self, at: DVec2) -> f64 {
        let from = at - self.begin.truncate();
        (from - from.dot(self.along).clamp(0.0, self.length) * self.along).length()
    }

    #[inline]
    fn touch(&self, profile: &Profile, at: DVec2) -> Touch {
        let from = at - self.begin.truncate();
        let (forward, aside) = (from.dot(self.along), from.perp_dot(self.along).abs());
        let s = if self.length > 0.0 {
            if aside > profile.radius_mm() {
                return Touch::NONE;
            }
            (forward - profile.behind_mm(self.rise, aside)).clamp(0.0, self.length)
        } else {
            0.0
        };
        left(profile, self.begin + s * self.along.extend(self.rise), at)
    }
}

/// What a cutter leaves at a point with its tip at a place.
#[inline]
fn left(profile: &Profile, tip: DVec3, at: DVec2) -> Touch {
    let away = at - tip.truncate();
    let from_axis = away.length();
    let height = profile.height_mm(from_axis);
    if height == f64::INFINITY {
        return Touch::NONE;
    }
    let slope = if from_axis > 0.0 { profile.slope(from_axis) / from_axis * away } else { DVec2::ZERO };
    Touch { height: tip.z + height, slope, tip }
}

impl Piece {
    /// Newton's iteration for the place where the height no longer falls, between places where it
    /// does and where it rises; or an end.
    fn touch(&self, profile: &Profile, at: DVec2) -> Touch {
        let of = |part: f64| left(profile, self.arc.at(part), at);
        // How the height changes along the way; beyond the reach, towards the point.
        let rise = |part: f64| {
            let (tip, way) = (self.arc.at(part), self.arc.velocity(part));
            let away = at - tip.truncate();
            let from_axis = away.length();
            let slope = if from_axis > profile.radius_mm() { 1e4 } else { profile.slope(from_axis) };
            let pull = if from_axis > 0.0 { slope / from_axis * away.dot(way.truncate()) } else { 0.0 };
            way.z - pull
        };
        let (mut low, mut high) = (self.from, self.to);
        let (mut falls, mut rises) = (rise(low), rise(high));
        if falls >= 0.0 {
            return of(low);
        }
        if rises <= 0.0 {
            return of(high);
        }
        let (mut best, mut side) = (of(low), 0);
        for step in 0..STEPS {
            // Regula falsi with the weight of an end that stays halved (Illinois).
            let part = (low * rises - high * falls) / (rises - falls);
            let part = if step < QUICK && part > low && part < high { part } else { 0.5 * (low + high) };
            let now = rise(part);
            let touch = of(part);
            if touch.height < best.height {
                best = touch;
            }
            if now.abs() < 1e-9 * self.arc.length_mm() || high - low < 1e-12 {
                break;
            }
            if now < 0.0 {
                (low, falls) = (part, now);
                if side == -1 {
                    rises *= 0.5;
                }
                side = -1;
            } else {
                (high, rises) = (part, now);
                if side == 1 {
                    falls *= 0.5;
                }
                side = 1;
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::Blending;

    fn made(from: DVec3, to: DVec3, way: Way) -> Move {
        Move { line: 1, from, to, way, tool: 0, spindle_per_min: 0.0, blending: Blending::Unsaid }
    }

    /// The least over many places of the way.
    fn searched(tool: &Tool, way: impl Fn(f64) -> DVec3, at: DVec2) -> f64 {
        let profile = Profile::of(tool);
        let height = |k: u32| {
            let tip = way(f64::from(k) / 20_000.0);
            tip.z + profile.height_mm(tip.truncate().distance(at))
        };
        (0..=20_000).map(height).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn a_stroke_leaves_the_least_of_all_places_on_its_way_with_its_slope() {
        let ends = [
            (DVec3::new(-1.0, 0.5, 0.2), DVec3::new(2.0, 1.1, -0.3)),
            (DVec3::new(0.0, 0.0, 0.0), DVec3::new(0.01, 0.0, 0.5)),
            (DVec3::new(0.3, 0.0, 1.0), DVec3::new(0.3, 0.0, 0.2)),
            (DVec3::new(-4.0, -4.0, 0.0), DVec3::new(4.0, 4.0, 0.0)),
        ];
        for text in ["ball:d6mm", "flat:d6mm", "bull:d6mm,r1mm", "vee:90deg,d6mm", "taper:r1mm,10deg,d6mm"] {
            let tool: Tool = text.parse().unwrap();
            for (from, to) in ends {
                let mut strokes = Strokes::of(&[tool]);
                strokes.add(&made(from, to, Way::Straight { feed: 1.0 }), 0);
                for k in 0..121 {
                    let at = 0.61 * DVec2::new(f64::from(k % 11) - 5.0, f64::from(k / 11) - 5.0);
                    let (touch, least) = (strokes.touch(0, at), searched(&tool, |t| from.lerp(to, t), at));
                    if touch.height.is_infinite() {
                        // Where the way only grazes, places miss it.
                        assert!(least.is_infinite(), "{text} at {at}");
                        continue;
                    }
                    assert!(touch.height <= least + 1e-12, "{text} at {at}: {} > {least}", touch.height);
                    assert!(
                        least.is_infinite() || touch.height > least - 1e-3,
                        "{text} at {at}: {} < {least}",
                        touch.height
                    );
                    let e = 1e-6;
                    let beside = |x: f64, y: f64| strokes.touch(0, at + DVec2::new(x, y)).height;
                    let (x, y) = (
                        (beside(e, 0.0) - beside(-e, 0.0)) / (2.0 * e),
                        (beside(0.0, e) - beside(0.0, -e)) / (2.0 * e),
                    );
                    let difference = DVec2::new(x, y);
                    if !text.starts_with("flat") && difference.is_finite() && difference.length() < 20.0 {
                        let off = difference.distance(touch.slope);
                        // Edges of a cone and ends of a way have two slopes.
                        assert!(
                            off < 1e-3
                                || beside(e, 0.0) + beside(-e, 0.0) > 2.0 * touch.height + 1e-9
                                || beside(0.0, e) + beside(0.0, -e) > 2.0 * touch.height + 1e-9,
                            "{text} at {at}: {difference} for {}",
                            touch.slope
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn an_arc_leaves_the_least_of_all_places_on_its_way() {
        struct Taken(Vec<Move>);
        impl crate::program::Run for Taken {
            fn moved(&mut self, made: &Move) -> Result<(), crate::program::ProgramFault> {
                self.0.push(*made);
                Ok(())
            }
        }
        let program = "G21 G17 F100 G0 X2 Y0 Z1\nG3 X0 Y2 Z0.5 I-2 J0\nG18 G2 X3 Z0 R4\nG19 G3 Y4 Z0.2 J1 K0.1\n";
        let mut taken = Taken(Vec::new());
        crate::program::run(program.as_bytes(), None, &mut taken).unwrap();
        for text in ["ball:d6mm", "flat:d3mm", "bull:d6mm,r1mm", "vee:90deg,d6mm"] {
            let tool: Tool = text.parse().unwrap();
            for made in &taken.0[1..] {
                let Way::Arc { arc, .. } = made.way else { panic!("{made:?}") };
                let mut strokes = Strokes::of(&[tool]);
                strokes.add(made, 0);
                for k in 0..121 {
                    let at = 0.61 * DVec2::new(f64::from(k % 11) - 5.0, f64::from(k / 11) - 5.0);
                    let least = searched(&tool, |t| arc.at(t), at);
                    let found = (0..strokes.len()).map(|k| strokes.touch(k, at).height).fold(f64::INFINITY, f64::min);
                    if found.is_finite() || least.is_finite() {
                        assert!(found <= least + 1e-9, "{text} {arc:?} at {at}: {found} > {least}");
                        assert!(least.is_infinite() || found > least - 1e-3, "{text} at {at}: {found} < {least}");
                    }
                }
            }
        }
    }
}
