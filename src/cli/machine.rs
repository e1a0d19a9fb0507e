//! The machine that commands run on: its disk and its memory, for what the library asks of them.

use super::{console, memory};
use crate::{failure::Failure, memory::Bytes, spec::Host};
use glasswarp_verify::{
    Image, Mesh, image_file,
    load::{self, LoadError},
};
use std::{fs, io, path::Path};

/// This machine.
pub struct Machine;

impl Machine {
    /// Memory that can be had without swapping, if the system tells.
    pub fn free_memory() -> Option<Bytes> {
        memory::free()
    }
}

impl Host for Machine {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        fs::read(path)
    }

    fn solid(&self, path: &Path) -> Result<Mesh, Failure> {
        read_bare_mesh(path)
    }

    fn picture_memory(&self) -> u64 {
        memory::for_a_picture()
    }

    fn warn(&self, warning: &str) {
        console::warn(warning);
    }
}

/// Reads a mesh file.
pub(super) fn read_mesh(path: &Path) -> Result<Mesh, Failure> {
    read_by(load::read, path)
}

/// Reads a mesh file but for its normals.
pub(super) fn read_bare_mesh(path: &Path) -> Result<Mesh, Failure> {
    read_by(load::read_bare, path)
}

fn read_by(read: impl Fn(&Path) -> Result<Mesh, LoadError>, path: &Path) -> Result<Mesh, Failure> {
    let _span = tracing::info_span!("read back", file = %path.display()).entered();
    if ["jpg", "jpeg", "webp", "gif", "bmp", "svg", "tif", "tiff"].iter().any(|kind| has_extension(path, kind)) {
        let path = path.display();
        return Err(Failure::Usage(format!(
            "{path} is a picture and no block: 'glasswarp design {path}' makes one of it"
        )));
    }
    read(path).map_err(|error| {
        let what = format!("{} is no readable mesh", path.display());
        match error {
            LoadError::Read { .. } => Failure::Io { what, source: error.into() },
            LoadError::UnknownExtension { .. } => Failure::refused(error),
            _ if has_extension(path, "png") => Failure::InvalidMesh {
                what: format!(
                    "{0} is neither a block nor a height map; if it is a picture, 'glasswarp design {0}' makes a block of it",
                    path.display()
                ),
                source: Some(error.into()),
            },
            _ => Failure::InvalidMesh { what, source: Some(error.into()) },
        }
    })
}

/// Whether a file is one of this kind, by its name.
pub(super) fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

/// A file of irradiance, by its extension.
pub(super) enum IrradianceFile {
    Exr,
    Png,
}

impl IrradianceFile {
    pub(super) fn of(path: &Path) -> Result<Self, Failure> {
        match path {
            path if has_extension(path, "exr") => Ok(Self::Exr),
            path if has_extension(path, "png") => Ok(Self::Png),
            _ => Err(Failure::Usage(format!(
                "{}: irradiance is written as .exr (32-bit) or .png (16-bit), both linear",
                path.display()
            ))),
        }
    }

    /// Writes an image; in a PNG `peak` becomes white.
    pub(super) fn write(&self, path: &Path, image: &Image, peak: f64) -> Result<(), Failure> {
        let written = match self {
            Self::Exr => image_file::write_exr(path, image),
            Self::Png => image_file::write_png(path, image, peak),
        };
        written.map_err(Failure::writing)
    }

    /// Writes red, green and blue; in a PNG their greatest value becomes white.
    pub(super) fn write_rgb(&self, path: &Path, rgb: &[Image; 3]) -> Result<(), Failure> {
        let peak = rgb.iter().flat_map(|image| &image.values).copied().fold(0.0, f64::max);
        let written = match self {
            Self::Exr => image_file::write_rgb_exr(path, rgb),
            Self::Png => image_file::write_rgb_png(path, rgb, peak),
        };
        written.map_err(Failure::writing)
    }
}
