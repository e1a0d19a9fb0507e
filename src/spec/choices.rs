//! Settings that are one of a few.

use super::quantity::names;
use crate::{irradiance::Transfer, solid::Origin};
use clap::ValueEnum;
use glasswarp_verify::Surface;

names!(TransferName, "curve");
names!(OriginName, "place");
names!(SolverName, "solver");
names!(QualityName, "quality");

/// How numbers in a picture become light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TransferName {
    /// Encoded for a screen: the wall looks like the picture on that screen
    Srgb,
    /// Light already
    Linear,
}

impl From<TransferName> for Transfer {
    fn from(name: TransferName) -> Self {
        match name {
            TransferName::Srgb => Self::Srgb,
            TransferName::Linear => Self::Linear,
        }
    }
}

/// Where the coordinates of the files are counted from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum OriginName {
    /// On the axis, in the mean plane of the exit face
    #[default]
    Exit,
    /// On the axis, in the entry face
    Entry,
    /// On the axis, at the highest point of the block
    StockTop,
    /// At the corner of least x and y, in the entry face
    Corner,
}

impl From<OriginName> for Origin {
    fn from(name: OriginName) -> Self {
        match name {
            OriginName::Exit => Self::Exit,
            OriginName::Entry => Self::Entry,
            OriginName::StockTop => Self::StockTop,
            OriginName::Corner => Self::Corner,
        }
    }
}

/// How the surface is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum SolverName {
    /// Optical-path transport: the most accurate, and the only one for true black (offset 0)
    #[default]
    Transport,
    /// Brightness warping, improved: height-aware, smooth, closed loop
    Warping,
    /// Brightness warping as the paper prints it
    WarpingPaper,
}

/// How much work the transport solver puts in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum QualityName {
    /// A look at what will come, in well under a second
    Draft,
    /// Seconds
    #[default]
    Normal,
    /// What the nodes can give, in a few times the time
    Fine,
}

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
