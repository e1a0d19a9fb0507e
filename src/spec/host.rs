//! What a study needs of the machine that it runs on.

use crate::{failure::Failure, irradiance::Picture};
use glasswarp_verify::Mesh;
use std::{io, path::Path};

/// Files, memory, and an ear for warnings: the command line has a disk, a page in a browser has
/// what was dropped on it.
pub trait Host: Sync {
    /// The bytes of a file that settings name.
    ///
    /// # Errors
    /// Those of reading it.
    fn read(&self, path: &Path) -> io::Result<Vec<u8>>;

    /// The solid of a file that settings name.
    ///
    /// # Errors
    /// Those of reading it, and everywhere but where solids are read.
    fn solid(&self, path: &Path) -> Result<Mesh, Failure> {
        Err(Failure::Usage(format!(
            "{} is a block, and blocks that stand before others (`behind`) are read by the program only",
            path.display()
        )))
    }

    /// Memory that reading a picture may take, bytes.
    fn picture_memory(&self) -> u64 {
        Picture::MEMORY
    }

    /// Hears what went well and may not be what was meant.
    fn warn(&self, _warning: &str) {}

    /// A file of bytes, for a message that says which could not be read.
    ///
    /// # Errors
    /// A file that cannot be read.
    fn bytes(&self, path: &Path) -> Result<Vec<u8>, Failure> {
        self.read(path).map_err(|source| Failure::reading(path, source))
    }

    /// A file of text.
    ///
    /// # Errors
    /// A file that cannot be read, or is no text.
    fn text(&self, path: &Path) -> Result<String, Failure> {
        String::from_utf8(self.bytes(path)?).map_err(|_| {
            Failure::reading(path, io::Error::new(io::ErrorKind::InvalidData, "stream did not contain valid UTF-8"))
        })
    }
}
