//! The files of a page.

use glasswarp::spec::Host;
use std::{
    collections::HashMap,
    io,
    path::Path,
    sync::{Mutex, PoisonError},
};

/// Memory that reading a picture may take, bytes: a page has 4 GB in all, and the design needs its
/// own.
const PICTURE_MEMORY: u64 = 1 << 30;

/// What was dropped on the page, by name.
#[derive(Default)]
pub(crate) struct PageHost {
    pub(crate) files: HashMap<String, Vec<u8>>,
    warnings: Mutex<Vec<String>>,
}

impl PageHost {
    /// What was warned of since the last time.
    pub(crate) fn take_warnings(&self) -> Vec<String> {
        std::mem::take(&mut self.warnings.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Host for PageHost {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        // A page knows names, not folders.
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        self.files.get(name.as_ref()).cloned().ok_or_else(|| {
            io::Error::new(io::ErrorKind::NotFound, "it was not given to the page: add it beside the picture")
        })
    }

    fn picture_memory(&self) -> u64 {
        PICTURE_MEMORY
    }

    fn warn(&self, warning: &str) {
        self.warnings.lock().unwrap_or_else(PoisonError::into_inner).push(warning.to_owned());
    }
}
