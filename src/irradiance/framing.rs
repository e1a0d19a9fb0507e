//! Pictures that fill only part of the window, or fade towards its border.

use super::{Picture, PictureError};
use crate::grid::Field;
use glam::DVec2;

/// How a picture darkens towards the border of the window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Vignette {
    /// Not at all.
    #[default]
    None,
    /// Outside of the ellipse inscribed in the picture it is dark.
    Circle {
        /// The share of the radius in which it fades: 0 cuts it off, 1 fades from the middle.
        soft: f64,
    },
}

/// What is done to a picture before it becomes a target: dark parts still get the target's
/// constant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Framing {
    margin: f64,
    vignette: Vignette,
}

/// A framing that leaves no picture.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FramingError {
    /// A margin out of range.
    #[error("the margin is {margin} of the window; it must lie between 0 and {}", Framing::GREATEST_MARGIN)]
    Margin {
        /// The refused share.
        margin: f64,
    },
    /// A soft edge out of range.
    #[error("the vignette fades over {0} of its radius; it must lie between 0 and 1")]
    Soft(f64),
}

impl Framing {
    /// Greatest accepted margin.
    pub const GREATEST_MARGIN: f64 = 0.45;

    /// A margin, as a share of the window that stays dark on every side, around a picture with a
    /// vignette.
    ///
    /// # Errors
    /// A share out of range.
    pub fn new(margin: f64, vignette: Vignette) -> Result<Self, FramingError> {
        if !(0.0..=Self::GREATEST_MARGIN).contains(&margin) {
            return Err(FramingError::Margin { margin });
        }
        match vignette {
            Vignette::Circle { soft } if !(0.0..=1.0).contains(&soft) => Err(FramingError::Soft(soft)),
            _ => Ok(Self { margin, vignette }),
        }
    }

    /// The picture in its frame. With a margin it has more pixels, so that none is resampled; the
    /// margin is whole pixels.
    ///
    /// # Errors
    /// A picture that grows too large.
    pub fn apply(&self, picture: &Picture) -> Result<Picture, PictureError> {
        if *self == Self::default() {
            return Ok(picture.clone());
        }
        let values = picture.values();
        let (nx, ny) = (values.nx(), values.ny());
        let pad = |n: usize| (n as f64 * self.margin / (1.0 - 2.0 * self.margin)).round() as usize;
        let (px, py) = (pad(nx), pad(ny));
        let framed = Field::from_fn(nx + 2 * px, ny + 2 * py, |i, j| {
            let inside = (px..px + nx).contains(&i) && (py..py + ny).contains(&j);
            if inside { values[(i - px, j - py)] * self.light(i - px, j - py, (nx, ny)) } else { 0.0 }
        });
        Picture::from_values(framed)
    }

    /// What the vignette leaves of a pixel, averaged over it.
    fn light(&self, i: usize, j: usize, (nx, ny): (usize, usize)) -> f64 {
        const POINTS: usize = 8;
        let Vignette::Circle { soft } = self.vignette else { return 1.0 };
        let size = DVec2::new(nx as f64, ny as f64);
        let sum: f64 = (0..POINTS * POINTS)
            .map(|k| (DVec2::new((k % POINTS) as f64, (k / POINTS) as f64) + 0.5) / POINTS as f64)
            .map(|within| {
                let radius = ((DVec2::new(i as f64, j as f64) + within) * 2.0 / size - 1.0).length();
                if soft == 0.0 {
                    return if radius <= 1.0 { 1.0 } else { 0.0 };
                }
                let t = ((1.0 - radius) / soft).clamp(0.0, 1.0);
                t * t * (3.0 - 2.0 * t)
            })
            .sum();
        sum / (POINTS * POINTS) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::within_tenth_of;
    use std::f64::consts::PI;

    fn white() -> Picture {
        Picture::from_values(Field::filled(60, 40, 1.0)).unwrap()
    }

    #[test]
    fn a_margin_is_dark_and_the_picture_stays_as_it_is() {
        let framed = Framing::new(0.25, Vignette::None).unwrap().apply(&white()).unwrap();
        let values = framed.values();
        assert_eq!((values.nx(), values.ny()), (120, 80));
        assert!((values.mean() - 0.25).abs() < 1e-12);
        assert_eq!((values[(29, 40)], values[(30, 40)], values[(30, 19)], values[(30, 20)]), (0.0, 1.0, 0.0, 1.0));
        assert_eq!(Framing::default().apply(&white()).unwrap(), white());
    }

    #[test]
    fn a_vignette_keeps_the_middle_and_darkens_the_corners() {
        let cut = Framing::new(0.0, Vignette::Circle { soft: 0.0 }).unwrap().apply(&white()).unwrap();
        within_tenth_of(2.3e-4, (cut.values().mean() - PI / 4.0).abs(), "area of the disc");
        assert_eq!((cut.values()[(0, 0)], cut.values()[(30, 20)]), (0.0, 1.0));
        let soft = Framing::new(0.0, Vignette::Circle { soft: 0.5 }).unwrap().apply(&white()).unwrap();
        let row: Vec<f64> = (30..60).map(|i| soft.values()[(i, 20)]).collect();
        assert!(row.windows(2).all(|pair| pair[1] <= pair[0]) && row[10] == 1.0 && row[29] < 0.01);
    }

    #[test]
    fn frames_without_a_picture_are_refused() {
        for margin in [-0.1, 0.5, f64::NAN] {
            assert!(matches!(Framing::new(margin, Vignette::None), Err(FramingError::Margin { .. })));
        }
        for soft in [-0.1, 1.1, f64::NAN] {
            assert!(matches!(Framing::new(0.0, Vignette::Circle { soft }), Err(FramingError::Soft(_))));
        }
    }
}
