//! Light that is not perfect, as a person writes it: the size of its source, the roughness of the
//! face, a measured spread.

use super::{
    angle::Angle,
    length::Length,
    quantity::{names, read_as_text},
};
use crate::irradiance::SourceSize;
use clap::ValueEnum;
use std::{fmt, path::PathBuf, str::FromStr};

read_as_text!(SourceName, Roughness, SpeckFile, BeforeFile);
names!(DeconvolutionName, "deconvolution");

/// The size of the source: `sun`, `0.53deg`, `5mm` or `5x3mm`; `none` says that it has none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SourceName {
    /// None that would be seen, such as that of a laser.
    None,
    /// A disc far away, by its angular diameter.
    Angle(Angle),
    /// A disc, by its diameter.
    Disc(Length),
    /// A rectangle: along x, and along y.
    Rectangle(Length, Length),
}

impl FromStr for SourceName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        match text {
            "sun" => return Ok(Self::Angle(Angle { deg: 0.53 })),
            "none" => return Ok(Self::None),
            _ => {}
        }
        if let Some((width, height)) = text.split_once('x') {
            // 5x3mm: the unit stands once.
            let unit = height.trim_start_matches(|c: char| !c.is_alphabetic() && c != '"');
            let has_unit = width.contains(|c: char| c.is_alphabetic() || c == '"');
            let width = if has_unit { width.to_owned() } else { format!("{width}{unit}") };
            return Ok(Self::Rectangle(width.parse()?, height.parse()?));
        }
        if text.parse::<f64>().is_ok() {
            return Err(format!("'{text}' lacks its unit; write sun, 0.53deg, 5mm, 5x3mm or none"));
        }
        text.parse().map(Self::Disc).or_else(|_| text.parse().map(Self::Angle)).map_err(|_: String| {
            format!(
                "'{text}' is no size of a source; write sun, 0.53deg (parallel light), 5mm or 5x3mm (a point source), or none"
            )
        })
    }
}

impl fmt::Display for SourceName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("none"),
            Self::Angle(angle) => write!(f, "{angle}"),
            Self::Disc(diameter) => write!(f, "{}mm", diameter.mm),
            Self::Rectangle(width, height) => write!(f, "{}x{}mm", width.mm, height.mm),
        }
    }
}

impl SourceName {
    /// What spreads light; nothing does that is said to have no size.
    pub fn size(self) -> Option<SourceSize> {
        Some(match self {
            Self::None => return None,
            Self::Angle(angle) => SourceSize::Angle { diameter: angle.radians() },
            Self::Disc(diameter) => SourceSize::Disc { diameter_mm: diameter.mm },
            Self::Rectangle(width, height) => SourceSize::Rectangle { width_mm: width.mm, height_mm: height.mm },
        })
    }
}

/// How rough the face is: the angle whose tangent is the standard deviation of its slope along any
/// one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roughness(pub Angle);

impl Roughness {
    /// The standard deviation of the slope.
    pub(crate) fn slope(self) -> f64 {
        self.0.radians().tan()
    }
}

impl FromStr for Roughness {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        text.parse().map(Self)
    }
}

impl fmt::Display for Roughness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// A picture of a speck of light, and the size of its pixels: `speck.png,0.05mm`.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeckFile {
    /// The picture.
    pub path: PathBuf,
    /// The size of a pixel on the receiver.
    pub pixel: Length,
}

impl FromStr for SpeckFile {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (path, pixel) = file_and_length(text, "the size of a pixel on the receiver; write speck.png,0.05mm")?;
        Ok(Self { path, pixel })
    }
}

/// Reads `file,length`; `lacks` says what is missing where there is no length.
fn file_and_length(text: &str, lacks: &str) -> Result<(PathBuf, Length), String> {
    let (path, length) = text.rsplit_once(',').ok_or_else(|| format!("'{text}' lacks {lacks}"))?;
    Ok((path.into(), length.parse()?))
}

impl fmt::Display for SpeckFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{}mm", self.path.display(), self.pixel.mm)
    }
}

/// The block before this one in the way of the light, and the air between them: `stack.1.stl,30mm`.
#[derive(Clone, Debug, PartialEq)]
pub struct BeforeFile {
    /// Its file, with its side file beside it.
    pub path: PathBuf,
    /// From its mean exit plane to the entry face of this block.
    pub gap: Length,
}

impl FromStr for BeforeFile {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let lacks = "the air between the blocks; write stack.1.stl,30mm";
        let (path, gap) = file_and_length(text, lacks)?;
        Ok(Self { path, gap })
    }
}

impl fmt::Display for BeforeFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{}mm", self.path.display(), self.gap.mm)
    }
}

/// How spread light is corrected for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum DeconvolutionName {
    /// Make up for the spread of the light; beyond the window there is none, so that its brim is
    /// made brighter
    #[default]
    Window,
    /// As the paper does: the picture is continued and bevelled beyond its border, whose light then
    /// fades
    Paper,
    /// Design for perfect light, and judge in what is there
    Off,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_of_sources_are_read_as_they_are_written() {
        for (text, expected) in [
            ("sun", "0.53deg"),
            ("0.5deg", "0.5deg"),
            ("5mm", "5mm"),
            ("0.5cm", "5mm"),
            ("5x3mm", "5x3mm"),
            ("0.5x0.3cm", "5x3mm"),
            ("5mmx0.3cm", "5x3mm"),
        ] {
            let source: SourceName = text.parse().unwrap();
            assert_eq!(source.to_string(), expected);
            assert_eq!(source.to_string().parse::<SourceName>().unwrap(), source);
        }
        for text in ["", "5", "moon", "5x", "x3mm", "5furlongs", "5x3deg", "nan mm"] {
            assert!(text.parse::<SourceName>().is_err(), "{text} was taken");
        }
    }

    #[test]
    fn specks_need_the_size_of_their_pixels() {
        let speck: SpeckFile = "a,b.png,0.05mm".parse().unwrap();
        assert_eq!((speck.path, speck.pixel.mm), (PathBuf::from("a,b.png"), 0.05));
        assert!("speck.png".parse::<SpeckFile>().is_err());
        assert!("speck.png,wide".parse::<SpeckFile>().is_err());
    }
}
