//! The pieces of an outline: straight sides and arcs of ellipses.

use crate::grid::Contour;
use glam::DVec2;
use std::f64::consts::{FRAC_PI_2, TAU};

/// A piece of an outline, counter-clockwise around the block, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Piece {
    Straight {
        from: DVec2,
        to: DVec2,
    },
    /// Of an ellipse, between two angles (of its auxiliary circle, from `+x`), rad: within 0 to 2
    /// pi, a right angle at most.
    Arc {
        centre: DVec2,
        semi_axes: DVec2,
        begin: f64,
        end: f64,
    },
}

/// Shorter pieces are left out, mm.
const SHORTEST_MM: f64 = 1e-6;

impl Piece {
    /// The pieces of a contour in order, each of which begins where the one before ends. There are
    /// no sides without length.
    pub(super) fn around(contour: &Contour) -> Vec<Self> {
        let half = 0.5 * contour.extent().as_vec();
        let radius = contour.radius_mm();
        let core = half - radius;
        let corners = [-core, DVec2::new(core.x, -core.y), core, DVec2::new(-core.x, core.y)];
        let outward = [DVec2::NEG_Y, DVec2::X, DVec2::Y, DVec2::NEG_X];
        let mut pieces = Vec::with_capacity(8);
        for (side, &from) in corners.iter().enumerate() {
            let to = corners[(side + 1) % 4];
            if from != to {
                let beyond = outward[side] * radius;
                pieces.push(Self::Straight { from: from + beyond, to: to + beyond });
            }
            if !contour.is_rectangle() {
                let turns = ((side + 3) % 4) as f64;
                let (begin, end) = (FRAC_PI_2 * turns, FRAC_PI_2 * (turns + 1.0));
                pieces.push(Self::Arc { centre: to, semi_axes: radius, begin, end });
            }
        }
        pieces
    }

    /// What of a convex outline lies no further than `reach` along a unit vector, with the flat
    /// that cuts off the rest.
    pub(super) fn cut_off(pieces: &[Self], along: DVec2, reach: f64) -> Vec<Self> {
        let mut kept: Vec<Self> = pieces.iter().flat_map(|piece| piece.within(along, reach)).collect();
        let gap = (0..kept.len()).find(|&k| {
            let next = &kept[(k + 1) % kept.len()];
            (next.at(0.0) - kept[k].at(1.0)).length() > SHORTEST_MM
        });
        if let Some(k) = gap {
            let flat = Self::Straight { from: kept[k].at(1.0), to: kept[(k + 1) % kept.len()].at(0.0) };
            kept.insert(k + 1, flat);
        }
        kept
    }

    /// The parts of a piece that lie no further than `reach` along a unit vector.
    fn within(&self, along: DVec2, reach: f64) -> Vec<Self> {
        // Shares where it is beyond, in order.
        let beyond: Vec<(f64, f64)> = match *self {
            Self::Straight { from, to } => {
                let (a, b) = (along.dot(from) - reach, along.dot(to) - reach);
                match (a > 0.0, b > 0.0) {
                    (false, false) => Vec::new(),
                    (true, true) => vec![(0.0, 1.0)],
                    (true, false) => vec![(0.0, a / (a - b))],
                    (false, true) => vec![(a / (a - b), 1.0)],
                }
            }
            Self::Arc { centre, semi_axes, begin, end } => {
                // Along the vector it reaches its centre's place and A cos(angle - furthest).
                let amplitude = along * semi_axes;
                let share = (reach - along.dot(centre)) / amplitude.length();
                let (furthest, half) = (amplitude.to_angle(), share.clamp(-1.0, 1.0).acos());
                [-TAU, 0.0, TAU]
                    .map(|turn| {
                        [furthest - half + turn, furthest + half + turn].map(|angle| (angle - begin) / (end - begin))
                    })
                    .map(|[from, to]| (from.max(0.0), to.min(1.0)))
                    .into_iter()
                    .filter(|(from, to)| to > from)
                    .collect()
            }
        };
        let begins = std::iter::once(0.0).chain(beyond.iter().map(|b| b.1));
        let ends = beyond.iter().map(|b| b.0).chain([1.0]);
        begins
            .zip(ends)
            .filter(|(from, to)| to > from)
            .map(|(from, to)| self.part(from, to))
            .filter(|part| (part.at(1.0) - part.at(0.0)).length() > SHORTEST_MM)
            .collect()
    }

    fn part(&self, from: f64, to: f64) -> Self {
        match *self {
            Self::Straight { .. } => Self::Straight { from: self.at(from), to: self.at(to) },
            Self::Arc { centre, semi_axes, begin, end } => {
                // Ends that stay are the same bits.
                let angle = |share: f64| if share == 1.0 { end } else { begin + share * (end - begin) };
                Self::Arc { centre, semi_axes, begin: angle(from), end: angle(to) }
            }
        }
    }

    /// The point at this share of the way, by length of a side and by the angle of an ellipse.
    pub(super) fn at(&self, share: f64) -> DVec2 {
        match *self {
            Self::Straight { from, to } => from.lerp(to, share),
            Self::Arc { centre, semi_axes, begin, end } => {
                centre + DVec2::from_angle(begin + share * (end - begin)) * semi_axes
            }
        }
    }

    /// Its derivative by the share.
    pub(super) fn rate(&self, share: f64) -> DVec2 {
        match *self {
            Self::Straight { from, to } => to - from,
            Self::Arc { semi_axes, begin, end, .. } => {
                (end - begin) * DVec2::from_angle(begin + share * (end - begin)).perp() * semi_axes
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{Extent, Outline};

    #[test]
    fn pieces_go_once_around_and_are_the_outline() {
        let square = Extent::new(40.0, 40.0);
        let wide = Extent::new(60.0, 40.0);
        for (extent, outline, count) in [
            (wide, Outline::Rectangle, 4),
            (wide, Outline::Circle, 4),
            (square, Outline::Circle, 4),
            (wide, Outline::Rounded { radius_mm: 7.0 }, 8),
            (wide, Outline::Rounded { radius_mm: 20.0 }, 6),
            (square, Outline::Rounded { radius_mm: 20.0 }, 4),
        ] {
            let contour = outline.within(extent);
            let pieces = Piece::around(&contour);
            assert_eq!(pieces.len(), count, "{outline:?}");
            let mut area = 0.0;
            for (k, piece) in pieces.iter().enumerate() {
                assert!((piece.at(1.0) - pieces[(k + 1) % count].at(0.0)).length() < 1e-12);
                let steps = 2000;
                for step in 0..steps {
                    let share = (f64::from(step) + 0.5) / f64::from(steps);
                    assert!(contour.level(piece.at(share)).distance_mm.abs() < 1e-12, "{outline:?} {piece:?}");
                    area += 0.5 * piece.at(share).perp_dot(piece.rate(share)) / f64::from(steps);
                    let difference = (piece.at(share + 1e-6) - piece.at(share - 1e-6)) / 2e-6;
                    assert!((difference - piece.rate(share)).length() < 1e-7);
                }
            }
            assert!((area - contour.area_mm2()).abs() < 1e-3, "{outline:?}: {area}");
        }
    }

    #[test]
    fn flats_cut_off_what_lies_beyond_them() {
        let along = DVec2::splat(std::f64::consts::FRAC_1_SQRT_2);
        for (outline, extent, off, count) in [
            (Outline::Rectangle, Extent::new(60.0, 40.0), 3.0, 5),
            (Outline::Circle, Extent::new(40.0, 40.0), 2.0, 6),
            // Beyond the quarter into both of its neighbours.
            (Outline::Circle, Extent::new(40.0, 40.0), 14.0, 4),
            (Outline::Circle, Extent::new(60.0, 40.0), 3.0, 6),
            (Outline::Rounded { radius_mm: 5.0 }, Extent::new(60.0, 40.0), 1.0, 10),
            // All of the corner and more.
            (Outline::Rounded { radius_mm: 5.0 }, Extent::new(60.0, 40.0), 6.0, 8),
            (Outline::Circle, Extent::new(40.0, 40.0), 0.0, 4),
        ] {
            let contour = outline.within(extent);
            let pieces = Piece::around(&contour);
            let points = |pieces: &[Piece]| -> Vec<DVec2> {
                let of = |piece: &Piece| {
                    let piece = *piece;
                    (0..4000).map(move |k| piece.at(f64::from(k) / 4000.0))
                };
                pieces.iter().flat_map(of).collect()
            };
            let area = |points: &[DVec2]| -> f64 {
                (0..points.len()).map(|k| 0.5 * points[k].perp_dot(points[(k + 1) % points.len()])).sum()
            };
            let reach = points(&pieces).iter().map(|p| along.dot(*p)).fold(0.0, f64::max) - off;
            let cut = Piece::cut_off(&pieces, along, reach);
            assert_eq!(cut.len(), count, "{outline:?} {off}: {cut:?}");
            for (k, piece) in cut.iter().enumerate() {
                assert!((piece.at(1.0) - cut[(k + 1) % count].at(0.0)).length() < SHORTEST_MM);
            }
            let left = points(&cut);
            assert!(left.iter().all(|p| along.dot(*p) < reach + 1e-6 && contour.level(*p).distance_mm < 1e-9));
            // The same by cutting a polygon.
            let polygon = crate::grid::cut_off(&points(&pieces), along, reach);
            assert!((area(&left) - area(&polygon)).abs() < 1e-3, "{outline:?} {off}");
        }
    }
}
