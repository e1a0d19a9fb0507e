//! Side files on the disk: beside which block they lie, and what they name.

use super::machine::{Machine, has_extension, read_mesh};
use crate::{
    export::write_atomically,
    failure::Failure,
    record::SideFile,
    solver::Progress,
    spec::{self, Host},
    study::{
        placement::{Expected, Placing, origin_of, place_block},
        workpiece::Workpiece,
    },
};
use glasswarp_verify::{Block, Mesh};
use std::{
    io::{self, Write as _},
    path::{Path, PathBuf},
};

/// Where the side file of an output lies: the same name with the extension `toml`.
pub(super) fn path_beside(output: &Path) -> PathBuf {
    output.with_extension("toml")
}

/// What a side file says of the place of a file's block.
pub(super) fn expected<'a>(side: Option<&'a SideFile>, file: &Path) -> Option<Expected<'a>> {
    side.map(|side| Expected { bench: &side.bench, origin_mm: origin_of(side, file) })
}

/// Reads a side file.
pub(super) fn read(path: &Path) -> Result<SideFile, Failure> {
    SideFile::parse(&Machine.text(path)?, path)
}

/// The side file of a block: the one that is named, else the one beside it, if it is there.
pub(super) fn find(block: &Path, named: Option<&Path>) -> Result<Option<SideFile>, Failure> {
    if !block.exists() {
        return Err(Failure::reading(block, io::ErrorKind::NotFound.into()));
    }
    let path = named.map_or_else(|| path_beside(block), Path::to_path_buf);
    match named {
        None if !path.exists() => Ok(None),
        _ => read(&path).map(Some),
    }
}

/// The side file of a block, which must have one.
pub(super) fn of_block(block: &Path, named: Option<&Path>) -> Result<SideFile, Failure> {
    find(block, named)?.ok_or_else(|| missing(block, ""))
}

/// There is no side file where there must be one. `or_else` says what else would do.
pub(super) fn missing(block: &Path, or_else: &str) -> Failure {
    Failure::Usage(format!(
        "there is no side file {}: name one with --bench, keep the .toml that was written with the block beside it{or_else}",
        path_beside(block).display()
    ))
}

/// What a command reads that looks at a block, or at a design file: that, its side file, and all
/// that they name.
pub(super) fn inputs(block: &Path, named: Option<&Path>) -> Result<Vec<PathBuf>, Failure> {
    let mut inputs = vec![block.to_path_buf()];
    if has_extension(block, "toml") {
        inputs.extend(spec::read(block, &Machine)?.files().map(Path::to_path_buf));
    } else if let Some(side) = find(block, named)? {
        inputs.push(named.map_or_else(|| path_beside(block), Path::to_path_buf));
        inputs.extend(side.design.files().map(Path::to_path_buf));
    }
    Ok(inputs)
}

/// Opens a file that must hold a block, and brings it where it belongs; tells what that took, and
/// what does not fit.
pub(super) fn open_block(
    path: &Path,
    side: Option<&SideFile>,
    placing: Placing,
) -> Result<(Mesh, Block, Vec<String>), Failure> {
    place_block(read_mesh(path)?, &path.display().to_string(), expected(side, path), placing)
}

/// Opens a block and its side file, to be worked on and looked at on its bench, or at another
/// distance and through another index.
pub(super) fn open_workpiece(
    path: &Path,
    named: Option<&Path>,
    placing: Placing,
    changed: (Option<f64>, Option<f64>),
    pixels: usize,
    progress: &dyn Progress,
) -> Result<Workpiece, Failure> {
    let side = of_block(path, named)?;
    let origin_mm = origin_of(&side, path);
    let (mesh, name) = (read_mesh(path)?, path.display().to_string());
    Workpiece::of((mesh, &name), (origin_mm, placing), side, changed, pixels, (&Machine, progress))
}

/// The text of a side file that will lie at `path`, with the paths of its settings relative to it.
pub(super) fn text(side: &SideFile, path: &Path) -> Result<String, Failure> {
    let mut side = side.clone();
    side.design.rename_files(|file| relative_to(file, path));
    side.to_text(&file_name(path))
}

/// Writes a side file.
pub(super) fn write(side: &SideFile, path: &Path) -> Result<(), Failure> {
    let text = text(side, path)?;
    write_atomically(path, |out| out.write_all(text.as_bytes())).map_err(Failure::writing)
}

/// The last part of a path.
pub(super) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// The name of a file without its extension.
pub(super) fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// The path of `file` as seen from the folder of `from`, absolute where they have no folder in
/// common.
fn relative_to(file: &Path, from: &Path) -> PathBuf {
    let folder = match from.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let (Ok(file), Ok(folder)) = (file.canonicalize(), folder.canonicalize()) else { return file.to_owned() };
    let shared = file.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    if shared <= 1 {
        return file;
    }
    let up = folder.components().skip(shared).map(|_| std::path::Component::ParentDir);
    up.chain(file.components().skip(shared)).collect()
}

/// The SHA-256 of a file; that it cannot be read is a failure.
pub(super) fn hash_of(path: &Path) -> Result<String, Failure> {
    glasswarp_files::sha256(path).map_err(|source| Failure::reading(path, source))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_written_relative_to_the_side_file() {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path();
        std::fs::create_dir_all(root.join("a/b")).unwrap();
        std::fs::write(root.join("a/p.png"), "x").unwrap();
        let relative = relative_to(&root.join("a/p.png"), &root.join("a/b/block.toml"));
        assert_eq!(relative, Path::new("../p.png"));
        assert_eq!(relative_to(&root.join("a/p.png"), &root.join("a/block.toml")), Path::new("p.png"));
    }
}
