//! What people do to a picture before it becomes light: crop, turn, levels, inversion.

use super::{
    error::ReferenceError,
    plane::Plane,
    tone::{light_to_srgb, srgb_to_light},
};

/// A length within a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measure {
    /// In pixels of the upright picture.
    Pixels(f64),
    /// As a share of the picture's side, 1 being all of it.
    Share(f64),
}

impl Measure {
    /// In whole pixels of a side.
    fn of(self, side: usize) -> Result<usize, ReferenceError> {
        let pixels = match self {
            Self::Pixels(pixels) => pixels,
            Self::Share(share) => share * side as f64,
        };
        if (0.0..1e9).contains(&pixels) {
            Ok(pixels.round() as usize)
        } else {
            let (what, must) = ("a length of the crop", "not negative, and within the picture");
            Err(ReferenceError::Option { what, value: pixels, must, flag: "--crop" })
        }
    }
}

/// A part of a picture, from its top left corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crop {
    /// Left edge.
    pub x: Measure,
    /// Top edge.
    pub y: Measure,
    /// Width.
    pub width: Measure,
    /// Height.
    pub height: Measure,
}

/// A clockwise turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// 90 degrees: the left side becomes the top.
    Quarter,
    /// 180 degrees.
    Half,
    /// 270 degrees: the right side becomes the top.
    ThreeQuarters,
}

/// A mirror image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flip {
    /// Left and right change places.
    Horizontal,
    /// Top and bottom change places.
    Vertical,
}

/// Black, white and gamma on the scale of image editors: 0 to 1 of the curve of sRGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Levels {
    /// What becomes 0.
    pub black: f64,
    /// What becomes 1.
    pub white: f64,
    /// The exponent is its inverse: more than 1 makes the middle brighter.
    pub gamma: f64,
}

impl Plane {
    pub(super) fn cropped(self, crop: Option<Crop>) -> Result<Self, ReferenceError> {
        let Some(crop) = crop else { return Ok(self) };
        let (nx, ny) = (self.nx, self.ny);
        let (x, width) = (crop.x.of(nx)?, crop.width.of(nx)?);
        let (y, height) = (crop.y.of(ny)?, crop.height.of(ny)?);
        if width == 0 || height == 0 || x + width > nx || y + height > ny {
            return Err(ReferenceError::Crop { x, y, width, height, nx, ny });
        }
        Ok(self.gathered(width, height, |i, j| (x + i, y + j)))
    }

    pub(super) fn turned(self, turn: Option<Turn>, flip: Option<Flip>) -> Self {
        let turned = match turn {
            None => self,
            Some(Turn::Quarter) => self.upright(6),
            Some(Turn::Half) => self.upright(3),
            Some(Turn::ThreeQuarters) => self.upright(8),
        };
        match flip {
            None => turned,
            Some(Flip::Horizontal) => turned.upright(2),
            Some(Flip::Vertical) => turned.upright(4),
        }
    }

    pub(super) fn graded(mut self, levels: Option<Levels>, invert: bool) -> Result<Self, ReferenceError> {
        if let Some(Levels { black, white, gamma }) = levels {
            let refused = |what, value, must| Err(ReferenceError::Option { what, value, must, flag: "--levels" });
            if !(0.0..=1.0).contains(&black) {
                return refused("the black of the levels", black, "0 to 1");
            }
            if !(white > black && white <= 1.0) {
                return refused("the white of the levels", white, "above the black and at most 1");
            }
            if !(gamma.is_finite() && gamma > 0.0) {
                return refused("the gamma of the levels", gamma, "positive and finite");
            }
            self.map(|light| {
                let v = ((light_to_srgb(light) - black) / (white - black)).clamp(0.0, 1.0);
                srgb_to_light(v.powf(1.0 / gamma))
            });
        }
        if invert {
            self.map(|light| srgb_to_light(1.0 - light_to_srgb(light.min(1.0))));
        }
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered() -> Plane {
        Plane { nx: 4, ny: 3, values: (0..12).map(|k| k as f32).collect() }
    }

    #[test]
    fn crops_count_from_the_top_left_in_pixels_and_shares() {
        let crop = Crop {
            x: Measure::Pixels(1.0),
            y: Measure::Share(0.34),
            width: Measure::Share(0.5),
            height: Measure::Pixels(2.0),
        };
        let part = numbered().cropped(Some(crop)).unwrap();
        assert_eq!((part.nx, part.ny, part.values), (2, 2, vec![5.0, 6.0, 9.0, 10.0]));
        for (x, width) in [(3.0, 2.0), (0.0, 0.0), (-1.0, 2.0), (f64::NAN, 2.0)] {
            let crop = Crop { x: Measure::Pixels(x), width: Measure::Pixels(width), ..crop };
            assert!(numbered().cropped(Some(crop)).is_err());
        }
    }

    #[test]
    fn a_quarter_turn_is_clockwise() {
        let turned = numbered().turned(Some(Turn::Quarter), None);
        assert_eq!((turned.nx, turned.ny, &turned.values[..3]), (3, 4, &[8.0, 4.0, 0.0][..]));
        let flipped = numbered().turned(None, Some(Flip::Horizontal));
        assert_eq!(flipped.values[..4], [3.0, 2.0, 1.0, 0.0]);
        let both = numbered().turned(Some(Turn::Half), Some(Flip::Vertical));
        assert_eq!(both.values[..4], [3.0, 2.0, 1.0, 0.0]);
    }

    #[test]
    fn levels_and_inversion_work_on_the_scale_of_editors() {
        let grey = |v: f64| Plane { nx: 1, ny: 1, values: vec![srgb_to_light(v) as f32] };
        let editor = |plane: Plane| light_to_srgb(f64::from(plane.values[0]));
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} is not {b}");
        let levels = |black, white, gamma| Some(Levels { black, white, gamma });
        near(editor(grey(0.5).graded(levels(0.25, 0.75, 1.0), false).unwrap()), 0.5);
        near(editor(grey(0.5).graded(levels(0.0, 1.0, 2.0), false).unwrap()), 0.5_f64.sqrt());
        near(editor(grey(0.2).graded(levels(0.25, 0.75, 1.0), false).unwrap()), 0.0);
        near(editor(grey(0.3).graded(None, true).unwrap()), 0.7);
        near(editor(grey(0.3).graded(levels(0.2, 0.4, 1.0), true).unwrap()), 0.5);
        for bad in [
            levels(0.5, 0.5, 1.0),
            levels(-0.1, 1.0, 1.0),
            levels(0.0, 1.5, 1.0),
            levels(0.0, 1.0, 0.0),
            levels(f64::NAN, 1.0, 1.0),
        ] {
            assert!(grey(0.5).graded(bad, false).is_err());
        }
    }
}
