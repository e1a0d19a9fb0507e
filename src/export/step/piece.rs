//! The pieces of an outline: straight sides and quarters of ellipses.

use crate::grid::Contour;
use glam::DVec2;
use std::f64::consts::FRAC_PI_2;

/// A piece of an outline, counter-clockwise around the block, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Piece {
    Straight {
        from: DVec2,
        to: DVec2,
    },
    /// A quarter of an ellipse that begins on one of its axes.
    Quarter {
        centre: DVec2,
        semi_axes: DVec2,
        /// It begins at so many right angles from `+x`: 0 to 3.
        begin: u8,
    },
}

impl Piece {
    /// The pieces of a contour in order, each of which begins where the one before ends. There are no sides without length.
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
                pieces.push(Self::Quarter { centre: to, semi_axes: radius, begin: (side as u8 + 3) % 4 });
            }
        }
        pieces
    }

    /// The point at this share of the way, by length of a side and by the angle of an ellipse.
    pub(super) fn at(&self, share: f64) -> DVec2 {
        match *self {
            Self::Straight { from, to } => from.lerp(to, share),
            Self::Quarter { centre, semi_axes, .. } => centre + DVec2::from_angle(self.angle(share)) * semi_axes,
        }
    }

    /// Its derivative by the share.
    pub(super) fn rate(&self, share: f64) -> DVec2 {
        match *self {
            Self::Straight { from, to } => to - from,
            Self::Quarter { semi_axes, .. } => FRAC_PI_2 * DVec2::from_angle(self.angle(share)).perp() * semi_axes,
        }
    }

    fn angle(&self, share: f64) -> f64 {
        match *self {
            Self::Straight { .. } => 0.0,
            Self::Quarter { begin, .. } => FRAC_PI_2 * (f64::from(begin) + share),
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
                    assert!((difference - piece.rate(share)).length() < 1e-6);
                }
            }
            assert!((area - contour.area_mm2()).abs() < 1e-3, "{outline:?}: {area}");
        }
    }
}
