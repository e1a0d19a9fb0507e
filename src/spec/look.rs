//! How a file is looked at.

use super::Length;
use clap::ValueEnum;
use glasswarp_verify::Surface;
use std::str::FromStr;

/// How the surface between the vertices of a file is understood.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SurfaceName {
    /// The smooth surface through the vertices of a block
    Spline,
    /// Flat triangles with interpolated normals, as renderers shade
    Smooth,
    /// Flat triangles as they are
    Facets,
}

impl From<SurfaceName> for Surface {
    fn from(name: SurfaceName) -> Self {
        match name {
            SurfaceName::Spline => Self::Spline,
            SurfaceName::Smooth => Self::Smooth,
            SurfaceName::Facets => Self::Facets,
        }
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
