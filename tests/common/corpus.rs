//! The files of the corpora.

use std::{fs, path::Path};

/// The contents of the files of a folder of the package that have one of these extensions, in the
/// order of their names.
pub(crate) fn files_of(folder: &str, extensions: &[&str]) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let mut paths: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| extensions.iter().any(|wanted| path.extension().is_some_and(|found| found == *wanted)));
    paths.sort();
    assert!(!paths.is_empty());
    paths.iter().map(|path| fs::read(path).unwrap()).collect()
}
