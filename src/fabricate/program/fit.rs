//! Straight strokes and arcs through the places of a way, no further off it than a bound.

use glam::{DVec2, DVec3};

/// A stroke from where the last one ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stroke {
    /// Straight.
    Line(DVec3),
    /// Along an arc in an upright plane along an axis: its end, its centre, and whether it turns
    /// clockwise from the axis to z.
    Arc { to: DVec3, centre: DVec3, clockwise: bool },
}

/// The axis along which an upright plane of arcs lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Upright {
    X,
    Y,
}

impl Upright {
    fn of(self, p: DVec3) -> DVec2 {
        match self {
            Self::X => DVec2::new(p.x, p.z),
            Self::Y => DVec2::new(p.y, p.z),
        }
    }
}

/// Aside in the plan a way may be off by this many times as much as in height: faces are shallow.
const ASIDE: f64 = 4.0;
/// Most places that one stroke passes.
const MOST: usize = 4096;

/// Straight strokes through `way`, of which no place is further off in height than `off` of it, mm.
pub(super) fn straight(way: &[DVec3], off: &impl Fn(DVec3) -> f64) -> Vec<Stroke> {
    let mut strokes = Vec::new();
    let mut from = 0;
    while from + 1 < way.len() {
        let to = furthest(way.len() - 1 - from, |count| passes(&way[from..=from + count], off));
        strokes.push(Stroke::Line(way[from + to]));
        from += to;
    }
    strokes
}

/// Arcs where they pass more places than a straight stroke.
pub(super) fn arcs(way: &[DVec3], off: &impl Fn(DVec3) -> f64, plane: Upright) -> Vec<Stroke> {
    let mut strokes = Vec::new();
    let mut from = 0;
    while from + 1 < way.len() {
        let left = way.len() - 1 - from;
        let line = furthest(left, |count| passes(&way[from..=from + count], off));
        let arc = furthest(left, |count| count >= 3 && arc_through(&way[from..=from + count], off, plane).is_some());
        match arc_through(&way[from..=from + arc], off, plane) {
            Some(stroke) if arc > line => {
                strokes.push(stroke);
                from += arc;
            }
            _ => {
                strokes.push(Stroke::Line(way[from + line]));
                from += line;
            }
        }
    }
    strokes
}

/// The greatest count for which something holds, found by doubling and halving; at least 1.
fn furthest(left: usize, holds: impl Fn(usize) -> bool) -> usize {
    let most = left.min(MOST);
    let (mut good, mut bad) = (1, most + 1);
    let mut step = 4;
    while good + step <= most {
        if holds(good + step) {
            good += step;
            step *= 2;
        } else {
            bad = good + step;
            break;
        }
    }
    if bad == most + 1 && holds(most) {
        return most;
    }
    while bad - good > 1 {
        let middle = good + (bad - good) / 2;
        if holds(middle) { good = middle } else { bad = middle }
    }
    good
}

/// Whether a straight stroke from the first to the last place passes all between.
fn passes(way: &[DVec3], off: &impl Fn(DVec3) -> f64) -> bool {
    let (begin, end) = (way[0], way[way.len() - 1]);
    let run = (end - begin).truncate();
    let length = run.length();
    if length == 0.0 {
        return way.len() <= 2;
    }
    let along = run / length;
    way[1..way.len() - 1].iter().all(|p| {
        let from = (*p - begin).truncate();
        let part = from.dot(along) / length;
        let height = begin.z + part * (end.z - begin.z);
        let off = off(*p);
        (0.0..=1.0).contains(&part) && (p.z - height).abs() <= off && from.perp_dot(along).abs() <= ASIDE * off
    })
}

/// The greatest radius of an arc, mm: beyond it centres lose the digits that their ends have.
const WIDEST_MM: f64 = 2000.0;
/// The least radius of an arc, mm.
const LEAST_MM: f64 = 1e-3;

/// The arc from the first to the last place through the middle one, if it passes all others.
fn arc_through(way: &[DVec3], off: &impl Fn(DVec3) -> f64, plane: Upright) -> Option<Stroke> {
    let (begin, end) = (way[0], way[way.len() - 1]);
    let (a, b, c) = (plane.of(begin), plane.of(way[way.len() / 2]), plane.of(end));
    let (ab, ac) = (b - a, c - a);
    let twice = 2.0 * ab.perp_dot(ac);
    if twice == 0.0 {
        return None;
    }
    let (p, q) = (ab.length_squared(), ac.length_squared());
    let from = DVec2::new(ac.y * p - ab.y * q, ab.x * q - ac.x * p) / twice;
    let (centre, radius) = (a + from, from.length());
    // Not a number is no arc either.
    if !(LEAST_MM..=WIDEST_MM).contains(&radius) {
        return None;
    }
    let aside = |p: &DVec3| match plane {
        Upright::X => p.y,
        Upright::Y => p.x,
    };
    if way.iter().any(|p| (aside(p) - aside(&begin)).abs() > 1e-9) {
        return None;
    }
    // Less than a half turn, upright to the end.
    let forward = (c.x - a.x).signum();
    let fits = way[1..way.len() - 1].iter().zip(way).all(|(p, before)| {
        let (at, last) = (plane.of(*p), plane.of(*before));
        (at.distance(centre) - radius).abs() <= off(*p) && (at.x - last.x) * forward > 0.0
    });
    let above = |p: DVec2| (p.y - centre.y).signum();
    if !fits || above(a) != above(c) {
        return None;
    }
    let middle = match plane {
        Upright::X => DVec3::new(centre.x, begin.y, centre.y),
        Upright::Y => DVec3::new(begin.x, centre.x, centre.y),
    };
    Some(Stroke::Arc { to: end, centre: middle, clockwise: twice < 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave() -> Vec<DVec3> {
        (0..4000).map(|k| f64::from(k) * 0.01).map(|x| DVec3::new(x, 2.0, 0.2 * x.sin())).collect()
    }

    #[test]
    fn strokes_pass_all_places_within_their_bound() {
        let way = wave();
        let strokes = straight(&way, &|_| 1e-4);
        assert!(strokes.len() > 100 && strokes.len() < 1000, "{}", strokes.len());
        let ends: Vec<DVec3> = std::iter::once(way[0])
            .chain(strokes.iter().map(|stroke| match stroke {
                Stroke::Line(to) => *to,
                Stroke::Arc { .. } => panic!("no arc was asked for"),
            }))
            .collect();
        assert_eq!(ends[ends.len() - 1], way[way.len() - 1]);
        for p in &way {
            let k = ends.partition_point(|q| q.x < p.x).clamp(1, ends.len() - 1);
            let (a, b) = (ends[k - 1], ends[k]);
            let height = a.z + (b.z - a.z) * (p.x - a.x) / (b.x - a.x);
            assert!((height - p.z).abs() <= 1.000_001e-4, "{p}");
        }
    }

    #[test]
    fn arcs_pass_all_places_with_fewer_strokes() {
        let way = wave();
        let (lines, fitted) = (straight(&way, &|_| 1e-4).len(), arcs(&way, &|_| 1e-4, Upright::X));
        assert!(fitted.len() * 2 < lines, "{} for {lines}", fitted.len());
        let mut from = way[0];
        for stroke in &fitted {
            let to = match *stroke {
                Stroke::Line(to) => to,
                Stroke::Arc { to, centre, clockwise } => {
                    let radius = from.distance(centre);
                    assert!((to.distance(centre) - radius).abs() < 1e-9 && centre.y == 2.0);
                    // Clockwise from x to z: over the top.
                    assert_eq!(clockwise, centre.z < from.z, "{from} {to} {centre}");
                    for p in way.iter().filter(|p| p.x >= from.x && p.x <= to.x) {
                        assert!((p.distance(centre) - radius).abs() <= 1.000_001e-4);
                    }
                    to
                }
            };
            from = to;
        }
        assert_eq!(from, way[way.len() - 1]);
    }

    #[test]
    fn what_turns_back_or_stands_still_is_kept_as_it_is() {
        let way = [DVec3::ZERO, DVec3::X, DVec3::X * 0.5, DVec3::new(0.5, 1.0, 0.0), DVec3::new(0.5, 1.0, -1.0)];
        let strokes = straight(&way, &|_| 1e-3);
        assert_eq!(strokes, way[1..].iter().map(|p| Stroke::Line(*p)).collect::<Vec<_>>());
    }
}
