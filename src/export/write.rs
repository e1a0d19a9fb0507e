//! A block in any of the formats.

use super::{
    StepTolerance, choose_net,
    format::{Design, ExportError, Format},
    glb, write_3mf, write_glb, write_obj, write_ply, write_step, write_stl,
};
use crate::{solid::Solid, surface::HeightField};
#[cfg(feature = "files")]
use glasswarp_files::write_atomically;
use std::io;
#[cfg(feature = "files")]
use std::path::Path;

impl Format {
    /// Refuses what the format cannot hold, before anything is written.
    ///
    /// # Errors
    /// [`ExportError::TooManyForGlb`].
    pub fn check(self, solid: &Solid) -> Result<(), ExportError> {
        match self {
            Self::Glb => glb::check(solid),
            Self::Stl | Self::Obj | Self::Step | Self::ThreeMf | Self::Ply => Ok(()),
        }
    }

    /// Writes the block to anything that takes bytes.
    ///
    /// # Errors
    /// Those of the writer, and [`io::ErrorKind::InvalidInput`] for what [`check`](Self::check)
    /// refuses.
    pub fn write(self, writer: &mut impl io::Write, solid: &Solid, design: &Design) -> io::Result<()> {
        match self {
            Self::Stl => write_stl(writer, solid, design),
            Self::Obj => write_obj(writer, solid, design),
            Self::Glb => write_glb(writer, solid, design),
            Self::Step => {
                let chosen = |surface: &HeightField| {
                    choose_net(surface, StepTolerance::Picture, design)
                        .map_err(|error| io::Error::new(io::ErrorKind::InvalidInput, error))
                };
                let (exit, entry) = (chosen(solid.surface())?, solid.entry_surface().map(chosen).transpose()?);
                write_step(writer, solid, &exit.net, entry.as_ref().map(|fit| &fit.net), design)
            }
            Self::ThreeMf => write_3mf(writer, solid, design),
            Self::Ply => write_ply(writer, solid, design),
        }
    }
}

/// Writes the block in the format that the extension names. The file appears whole or not at all.
///
/// # Errors
/// An unknown extension, a block too large for the format, or a file that cannot be written. A STEP
/// file gets the net that the picture needs; [`choose_net`] and [`write_step`] give the choice.
#[cfg(feature = "files")]
pub fn export(path: &Path, solid: &Solid, design: &Design) -> Result<(), ExportError> {
    let format = Format::from_path(path)?;
    format.check(solid)?;
    let _span = tracing::info_span!("write", file = %path.display()).entered();
    write_atomically(path, |writer| format.write(writer, solid, design))?;
    Ok(())
}
