//! The shapes of the block and of its picture, as a person writes them.

use super::{length::Length, quantity::read_as_text};
use crate::{grid::Outline, irradiance::Vignette};
use std::{fmt, str::FromStr};

read_as_text!(VignetteName, OutlineName, RimSize, Shift);

/// A vignette as a person writes it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VignetteName(pub Vignette);

impl FromStr for VignetteName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let soft = match text.trim().split_once(':') {
            None if text.trim() == "none" => return Ok(Self(Vignette::None)),
            None if text.trim() == "circle" => Some(0.0),
            Some(("circle", soft)) => soft.parse().ok(),
            _ => None,
        };
        soft.map(|soft| Self(Vignette::Circle { soft }))
            .ok_or_else(|| format!("'{text}' is no vignette; write none, circle or circle:SHARE, as circle:0.2"))
    }
}

impl fmt::Display for VignetteName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Vignette::None => f.write_str("none"),
            Vignette::Circle { soft } => write!(f, "circle:{soft}"),
        }
    }
}

/// An outline as a person writes it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OutlineName(pub Outline);

impl FromStr for OutlineName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim().split_once(':') {
            None if text.trim() == "rectangle" => Ok(Self(Outline::Rectangle)),
            None if text.trim() == "circle" => Ok(Self(Outline::Circle)),
            Some(("rounded", radius)) => Ok(Self(Outline::Rounded { radius_mm: radius.parse::<Length>()?.mm })),
            _ => Err(format!("'{text}' is no outline; write rectangle, circle or rounded:RADIUS, as rounded:10mm")),
        }
    }
}

impl fmt::Display for OutlineName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Outline::Rectangle => f.write_str("rectangle"),
            Outline::Circle => f.write_str("circle"),
            Outline::Rounded { radius_mm } => write!(f, "rounded:{radius_mm}mm"),
        }
    }
}

/// Width and height of a rim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RimSize {
    /// On every side of the face.
    pub width: Length,
    /// Of its plane above the highest point of the face.
    pub rise: Length,
}

impl FromStr for RimSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (width, rise) = text
            .split_once(',')
            .ok_or_else(|| format!("'{text}' is no width and height; write them as 10mm,2mm or 10mm,-4mm"))?;
        Ok(Self { width: width.parse()?, rise: rise.parse()? })
    }
}

impl fmt::Display for RimSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}mm,{}mm", self.width.mm, self.rise.mm)
    }
}

/// How far a picture is moved on the receiver, as seen from the block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shift {
    /// To the right.
    pub right: Length,
    /// Upwards.
    pub up: Length,
}

impl FromStr for Shift {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (right, up) = text.split_once(',').ok_or_else(|| {
            format!("'{text}' is no shift; write how far to the right and up, as 25mm,0mm or -10mm,5mm")
        })?;
        Ok(Self { right: right.parse()?, up: up.parse()? })
    }
}

impl fmt::Display for Shift {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}mm,{}mm", self.right.mm, self.up.mm)
    }
}

/// Size of the window: its height follows the target or the solid unless it is given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowSize {
    /// Its width.
    pub width: Length,
    /// Its height, if it is given.
    pub height: Option<Length>,
}

impl FromStr for WindowSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once('x') {
            Some((width, height)) => Ok(Self { width: width.parse()?, height: Some(height.parse()?) }),
            None => Ok(Self { width: text.parse()?, height: None }),
        }
    }
}
