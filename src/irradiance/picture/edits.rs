//! What is done to a picture on the way in.

use super::{Picture, PictureError, Transfer, primaries::REC_709};
use crate::grid::Field;
use std::{fmt, str::FromStr};

/// The light behind transparent parts, as a colour of sRGB.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Background {
    rgb: [u8; 3],
}

impl Background {
    /// White.
    pub const WHITE: Self = Self { rgb: [255; 3] };

    /// Of red, green and blue.
    pub fn of(rgb: [u8; 3]) -> Self {
        Self { rgb }
    }

    /// Red, green and blue.
    pub fn rgb(self) -> [u8; 3] {
        self.rgb
    }

    /// Its luminance, 0 to 1, if its numbers are encoded so.
    pub fn light(self, transfer: Transfer) -> f64 {
        (0..3).map(|k| REC_709[k] * transfer.to_linear(f64::from(self.rgb[k]) / 255.0)).sum()
    }
}

/// A side, or the distance from one, of a part that is cut out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measure {
    /// Pixels.
    Pixels(usize),
    /// A share of the picture's own width or height, per cent.
    Percent(f64),
}

/// The part of a picture that is used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crop {
    /// From the left side.
    pub x: Measure,
    /// From the top.
    pub y: Measure,
    /// Width of the part.
    pub width: Measure,
    /// Height of the part.
    pub height: Measure,
}

/// A turn, clockwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rotation {
    /// A quarter.
    Right,
    /// A half.
    Half,
    /// Three quarters.
    Left,
}

/// Which sides change places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flip {
    /// Left and right.
    Horizontal,
    /// Top and bottom.
    Vertical,
}

/// What becomes black and white, on the scale of image editors (0..1, the curve of sRGB), and how
/// light lies in between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Levels {
    black: f64,
    white: f64,
    gamma: f64,
}

/// Edits of a picture, done in the order of the fields.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Edits {
    /// The part that is used.
    pub crop: Option<Crop>,
    /// How it is turned.
    pub rotate: Option<Rotation>,
    /// Which of its sides change places.
    pub flip: Option<Flip>,
    /// What becomes black and white.
    pub levels: Option<Levels>,
    /// Whether dark and light change places.
    pub invert: bool,
}

/// An edit that is not understood, or makes no sense.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct EditError(String);

impl Levels {
    /// What becomes black.
    pub fn black(self) -> f64 {
        self.black
    }

    /// What becomes white.
    pub fn white(self) -> f64 {
        self.white
    }

    /// The inverse of the exponent in between.
    pub fn gamma(self) -> f64 {
        self.gamma
    }

    /// Range of gamma.
    pub const GAMMA: std::ops::RangeInclusive<f64> = 0.05..=20.0;

    /// What becomes black and what white, and the exponent 1 / `gamma` in between.
    ///
    /// # Errors
    /// Black and white out of 0..1 or the wrong way round, or a gamma out of range.
    pub fn new(black: f64, white: f64, gamma: f64) -> Result<Self, EditError> {
        if !((0.0..=1.0).contains(&black) && (0.0..=1.0).contains(&white)) {
            return Err(EditError(format!(
                "levels {black},{white} are out of range: black and white lie between 0 and 1"
            )));
        }
        if black >= white {
            return Err(EditError(format!(
                "levels {black},{white} leave nothing between black and white: black must be below white; inverting turns them round"
            )));
        }
        if !Self::GAMMA.contains(&gamma) {
            let (least, most) = (Self::GAMMA.start(), Self::GAMMA.end());
            return Err(EditError(format!(
                "the gamma of the levels is {gamma}; it must lie between {least} and {most}"
            )));
        }
        Ok(Self { black, white, gamma })
    }

    fn apply(&self, value: f64) -> f64 {
        ((value - self.black) / (self.white - self.black)).clamp(0.0, 1.0).powf(1.0 / self.gamma)
    }
}

impl Measure {
    fn pixels(self, of: usize) -> usize {
        match self {
            Self::Pixels(pixels) => pixels,
            Self::Percent(share) => (share / 100.0 * of as f64).round() as usize,
        }
    }
}

impl Crop {
    /// First column and row, width and height, pixels.
    fn within(&self, (nx, ny): (usize, usize)) -> Result<[usize; 4], PictureError> {
        let (x, y) = (self.x.pixels(nx), self.y.pixels(ny));
        let (width, height) = (self.width.pixels(nx), self.height.pixels(ny));
        let fits =
            x.checked_add(width).is_some_and(|end| end <= nx) && y.checked_add(height).is_some_and(|end| end <= ny);
        if !fits || width.min(height) < Picture::LEAST_SIDE {
            return Err(PictureError::Crop { x, y, width, height, nx, ny, least: Picture::LEAST_SIDE });
        }
        Ok([x, y, width, height])
    }
}

impl Edits {
    /// The picture after crop, turn and flip.
    ///
    /// # Errors
    /// A crop that reaches beyond the picture.
    pub(super) fn place(&self, mut light: Field<f64>) -> Result<Field<f64>, PictureError> {
        if let Some(crop) = &self.crop {
            let [x, y, width, height] = crop.within((light.nx(), light.ny()))?;
            light = Field::from_fn(width, height, |i, j| light[(x + i, y + j)]);
        }
        let (nx, ny) = (light.nx(), light.ny());
        light = match self.rotate {
            None => light,
            Some(Rotation::Right) => Field::from_fn(ny, nx, |i, j| light[(j, ny - 1 - i)]),
            Some(Rotation::Half) => Field::from_fn(nx, ny, |i, j| light[(nx - 1 - i, ny - 1 - j)]),
            Some(Rotation::Left) => Field::from_fn(ny, nx, |i, j| light[(nx - 1 - j, i)]),
        };
        let (nx, ny) = (light.nx(), light.ny());
        Ok(match self.flip {
            None => light,
            Some(Flip::Horizontal) => Field::from_fn(nx, ny, |i, j| light[(nx - 1 - i, j)]),
            Some(Flip::Vertical) => Field::from_fn(nx, ny, |i, j| light[(i, ny - 1 - j)]),
        })
    }

    /// The picture after levels and inversion.
    pub(super) fn shade(&self, light: Field<f64>) -> Field<f64> {
        if self.levels.is_none() && !self.invert {
            return light;
        }
        light.map(|light| {
            let mut value = Transfer::Srgb.from_linear(*light);
            if let Some(levels) = &self.levels {
                value = levels.apply(value);
            }
            if self.invert {
                value = 1.0 - value.min(1.0);
            }
            Transfer::Srgb.to_linear(value)
        })
    }

    /// What was asked for, as a person writes it.
    pub fn words(&self) -> Vec<String> {
        let mut words = Vec::new();
        words.extend(self.crop.map(|crop| format!("cropped to {crop}")));
        words.extend(self.rotate.map(|rotation| format!("turned by {rotation} clockwise")));
        words.extend(self.flip.map(|flip| format!("flipped {flip}ly")));
        words.extend(self.levels.map(|levels| format!("levels {levels}")));
        words.extend(self.invert.then(|| "inverted".to_owned()));
        words
    }
}

impl FromStr for Background {
    type Err = EditError;

    fn from_str(text: &str) -> Result<Self, EditError> {
        let hex = |text: &str| {
            let byte = |k: usize| u8::from_str_radix(text.get(k..k + 2)?, 16).ok();
            (text.len() == 6 && text.bytes().all(|b| b.is_ascii_hexdigit()))
                .then(|| Some([byte(0)?, byte(2)?, byte(4)?]))?
        };
        match text.trim() {
            "black" => Ok(Self::default()),
            "white" => Ok(Self::WHITE),
            other => other.strip_prefix('#').and_then(hex).map(Self::of).ok_or_else(|| {
                EditError(format!("'{text}' is no background; write black, white or a colour as #rrggbb"))
            }),
        }
    }
}

impl fmt::Display for Background {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.rgb {
            [0, 0, 0] => f.write_str("black"),
            [255, 255, 255] => f.write_str("white"),
            [r, g, b] => write!(f, "#{r:02x}{g:02x}{b:02x}"),
        }
    }
}

impl FromStr for Crop {
    type Err = EditError;

    fn from_str(text: &str) -> Result<Self, EditError> {
        let measure = |part: &str| match part.trim().strip_suffix('%') {
            Some(share) => {
                share.trim().parse().ok().filter(|share| (0.0..=100.0).contains(share)).map(Measure::Percent)
            }
            None => part.trim().parse().ok().map(Measure::Pixels),
        };
        let parts: Vec<Option<Measure>> = text.split(',').map(measure).collect();
        let [Some(x), Some(y), Some(width), Some(height)] = parts[..] else {
            return Err(EditError(format!(
                "'{text}' is no part of a picture; write X,Y,WIDTH,HEIGHT from its top left corner, in pixels or per cent: 100,50,640,480 or 10%,0%,80%,100%"
            )));
        };
        Ok(Self { x, y, width, height })
    }
}

impl fmt::Display for Measure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pixels(pixels) => write!(f, "{pixels}"),
            Self::Percent(share) => write!(f, "{share}%"),
        }
    }
}

impl fmt::Display for Crop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{},{},{}", self.x, self.y, self.width, self.height)
    }
}

impl FromStr for Rotation {
    type Err = EditError;

    fn from_str(text: &str) -> Result<Self, EditError> {
        match text.trim().strip_suffix("deg").unwrap_or(text.trim()) {
            "90" => Ok(Self::Right),
            "180" => Ok(Self::Half),
            "270" | "-90" => Ok(Self::Left),
            _ => Err(EditError(format!("'{text}' is no turn of a picture; write 90deg, 180deg or 270deg (clockwise)"))),
        }
    }
}

impl fmt::Display for Rotation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Right => "90deg",
            Self::Half => "180deg",
            Self::Left => "270deg",
        })
    }
}

impl FromStr for Flip {
    type Err = EditError;

    fn from_str(text: &str) -> Result<Self, EditError> {
        match text.trim() {
            "horizontal" => Ok(Self::Horizontal),
            "vertical" => Ok(Self::Vertical),
            _ => Err(EditError(format!(
                "'{text}' is no flip; write horizontal (left and right change places) or vertical"
            ))),
        }
    }
}

impl fmt::Display for Flip {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if *self == Self::Horizontal { "horizontal" } else { "vertical" })
    }
}

impl FromStr for Levels {
    type Err = EditError;

    fn from_str(text: &str) -> Result<Self, EditError> {
        let numbers: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
        match numbers.as_deref() {
            Some([black, white]) => Self::new(*black, *white, 1.0),
            Some([black, white, gamma]) => Self::new(*black, *white, *gamma),
            _ => Err(EditError(format!(
                "'{text}' are no levels; write BLACK,WHITE or BLACK,WHITE,GAMMA on a scale from 0 to 1, as 0.1,0.9 or 0.05,0.8,1.2"
            ))),
        }
    }
}

impl fmt::Display for Levels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{}", self.black, self.white)?;
        if self.gamma == 1.0 { Ok(()) } else { write!(f, ",{}", self.gamma) }
    }
}

/// In design files edits are written as on the command line.
macro_rules! read_as_text {
    ($($kind:ty),+) => {
        $(
            impl serde::Serialize for $kind {
                fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                    serializer.collect_str(self)
                }
            }
            impl<'de> serde::Deserialize<'de> for $kind {
                fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                    String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
                }
            }
        )+
    };
}

read_as_text!(Background, Crop, Rotation, Flip, Levels);

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of 4 by 5 whose light tells where it is.
    fn numbered() -> Field<f64> {
        Field::from_fn(4, 5, |i, j| (10 * j + i) as f64 / 100.0)
    }

    #[test]
    fn edits_are_read_as_they_are_written() {
        fn same<T: FromStr<Err = EditError> + fmt::Display>(texts: &[&str]) {
            for text in texts {
                assert_eq!(text.parse::<T>().map(|edit| edit.to_string()).as_deref(), Ok(*text));
            }
        }
        same::<Crop>(&["1,2,30,40", "12.5%,0%,50%,100%", "10,0%,20,100%"]);
        same::<Rotation>(&["90deg", "180deg", "270deg"]);
        same::<Flip>(&["horizontal", "vertical"]);
        same::<Levels>(&["0.1,0.9", "0,1,2.2"]);
        same::<Background>(&["black", "white", "#12ab00"]);
        assert!("1,2,3".parse::<Crop>().is_err() && "1,2,3,-4".parse::<Crop>().is_err());
        assert!("0,0,101%,100%".parse::<Crop>().is_err() && "45deg".parse::<Rotation>().is_err());
        assert!("#12345".parse::<Background>().is_err() && "#+1+2+3".parse::<Background>().is_err());
        for (levels, word) in
            [("0.9,0.1", "inverting"), ("0,2", "out of range"), ("0,1,0", "gamma"), ("0,NaN", "range")]
        {
            assert!(levels.parse::<Levels>().unwrap_err().to_string().contains(word), "{levels}");
        }
    }

    #[test]
    fn a_part_is_cut_out_before_it_is_turned_and_flipped() {
        let edits = Edits {
            crop: Some("0,1,4,4".parse().unwrap()),
            rotate: Some(Rotation::Right),
            flip: Some(Flip::Vertical),
            ..Edits::default()
        };
        let placed = edits.place(numbered()).unwrap();
        // Turned clockwise, the top row (10 to 13) becomes the right column, from top to bottom;
        // flipped, from bottom to top.
        assert_eq!((0..4).map(|j| (100.0 * placed[(3, 3 - j)]).round()).collect::<Vec<_>>(), [10.0, 11.0, 12.0, 13.0]);
        for (rotation, corner) in [(Rotation::Right, 40), (Rotation::Half, 43), (Rotation::Left, 3)] {
            let turned = Edits { rotate: Some(rotation), ..Edits::default() }.place(numbered()).unwrap();
            assert_eq!((100.0 * turned[(0, 0)]).round() as usize, corner, "{rotation}");
        }
        let beyond = Edits { crop: Some("1,0,4,5".parse().unwrap()), ..Edits::default() };
        assert!(matches!(beyond.place(numbered()), Err(PictureError::Crop { nx: 4, ny: 5, .. })));
    }

    #[test]
    fn levels_and_inversion_are_those_of_image_editors() {
        let light = Field::from_fn(5, 4, |i, _| Transfer::Srgb.to_linear(i as f64 / 4.0));
        let edits = Edits { levels: Some(Levels::new(0.25, 0.75, 2.0).unwrap()), invert: true, ..Edits::default() };
        let shaded = edits.shade(light).map(|v| Transfer::Srgb.from_linear(*v));
        let right = [1.0, 1.0, 1.0 - 0.5_f64.sqrt(), 0.0, 0.0];
        assert!((0..5).all(|i| (shaded[(i, 0)] - right[i]).abs() < 1e-6), "{shaded:?}");
    }
}
