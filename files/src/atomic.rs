//! Files that appear whole or not at all.

use crate::{error::WriteError, guard};
use std::{
    collections::BTreeSet,
    fs::{self, File},
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
};

/// What the names of temporary files begin and end with.
const PREFIX: &str = ".glasswarp-";
const SUFFIX: &str = ".part";

/// Temporary files that stand for files in the making.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    // A set of paths is as good after a panic elsewhere as before.
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Holds off every [`write_atomically`] of the process from beginning or finishing a file.
#[must_use = "files can be begun again as soon as this is dropped"]
pub struct Held(#[allow(dead_code)] MutexGuard<'static, BTreeSet<PathBuf>>);

/// Removes the temporary files of all unfinished writes: for a handler of Ctrl-C, which keeps the
/// result until the process has exited, so that no further file appears.
pub fn remove_unfinished() -> Held {
    let mut paths = unfinished();
    for path in std::mem::take(&mut *paths) {
        // Nobody is left who could be told, and the next file may yet be removed.
        let _ = fs::remove_file(path);
    }
    Held(paths)
}

/// Writes a file that appears whole or not at all: `write` fills a temporary file in the same
/// folder through a buffer; it is flushed, handed to the disk, and only then renamed to `path`. A
/// file that stood there is replaced by one with its permissions; where a link stood, what it
/// points at is. A new file has those that the user's mask leaves.
///
/// # Errors
/// A folder that is missing or takes no files, a path that is no regular file, a file that the
/// [plan](crate::Plan) in force does not let be replaced, or an error of `write` or of the disk.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>,
) -> Result<(), WriteError> {
    let failed = |source| WriteError::Io { path: path.to_path_buf(), source };
    let (target, folder) = destination(path)?;
    guard::may_replace(path).map_err(|refusal| WriteError::Refused { refusal: refusal.into() })?;
    let mut temporary = begin(path, &folder)?;
    let outcome = fill(temporary.as_file_mut(), write).and_then(|()| keep_permissions(temporary.as_file(), &target));
    // Recorded before it has its name: whenever the run ends, what stands there is known.
    let outcome = outcome.and_then(|()| guard::about_to_take(&target, temporary.path()));
    finish(temporary, |file| outcome.and_then(|()| file.persist(&target).map(drop).map_err(|e| e.error)))
        .map_err(failed)
}

/// Gives a file the permissions of the one that it replaces.
#[cfg(unix)]
fn keep_permissions(file: &File, target: &Path) -> io::Result<()> {
    fs::metadata(target).map_or(Ok(()), |found| file.set_permissions(found.permissions()))
}

#[cfg(not(unix))]
fn keep_permissions(_: &File, _: &Path) -> io::Result<()> {
    Ok(())
}

/// Begins a temporary file that an interruption removes.
fn begin(path: &Path, folder: &Path) -> Result<tempfile::NamedTempFile, WriteError> {
    let failed = |source| WriteError::Folder { path: path.to_path_buf(), folder: folder.to_path_buf(), source };
    let mut unfinished = unfinished();
    loop {
        let file = create(folder).map_err(failed)?;
        // As long as it is locked, it is no orphan. File systems without locks keep their orphans.
        let _ = file.as_file().lock();
        // Another process may have taken it for one before the lock.
        if file.path().exists() {
            unfinished.insert(file.path().to_path_buf());
            return Ok(file);
        }
    }
}

/// Removes temporary files whose writers have died: after a power cut or a `kill -9` nobody else
/// does.
fn remove_orphans(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for path in entries.flatten().map(|entry| entry.path()) {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.starts_with(PREFIX) && name.ends_with(SUFFIX) {
            let orphan = File::options().read(true).write(true).open(&path).is_ok_and(|file| {
                // Removed while the lock is held, so that its writer, should it just begin, sees
                // that it is gone.
                file.try_lock().is_ok() && fs::remove_file(&path).is_ok()
            });
            tracing::debug!(path = %path.display(), orphan, "temporary file found");
        }
    }
}

/// Ends a temporary file. If `end` does not take it, it is removed.
fn finish(
    file: tempfile::NamedTempFile,
    end: impl FnOnce(tempfile::NamedTempFile) -> io::Result<()>,
) -> io::Result<()> {
    let mut unfinished = unfinished();
    unfinished.remove(file.path());
    end(file)
}

/// Where a file will really be written, and in which folder it is made.
fn destination(path: &Path) -> Result<(PathBuf, PathBuf), WriteError> {
    let failed = |source| WriteError::Io { path: path.to_path_buf(), source };
    // A link stays a link: what it points at is replaced. A device must not be replaced by a file.
    let target = if path.is_symlink() { fs::canonicalize(path).map_err(failed)? } else { path.to_path_buf() };
    if target.file_name().is_none() || fs::metadata(&target).is_ok_and(|found| !found.is_file()) {
        return Err(WriteError::NoFile { path: path.to_path_buf() });
    }
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        return Err(WriteError::NoFolder { path: path.to_path_buf(), folder: folder.to_path_buf() });
    }
    let folder = folder.to_path_buf();
    Ok((target, folder))
}

/// Finds out whether a file can be written, before the work whose result it shall hold. What
/// writers that were killed have left in its folder is removed.
///
/// # Errors
/// Those of [`write_atomically`] that are known beforehand.
pub fn probe(path: &Path) -> Result<(), WriteError> {
    let (_, folder) = destination(path)?;
    remove_orphans(&folder);
    let failed = |source| WriteError::Io { path: path.to_path_buf(), source };
    finish(begin(path, &folder)?, |_| Ok(())).map_err(failed)
}

fn fill(file: &mut File, write: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>) -> io::Result<()> {
    let mut buffer = BufWriter::with_capacity(1 << 18, &mut *file);
    write(&mut buffer)?;
    buffer.flush()?;
    drop(buffer);
    // A disk may report that it is full only now.
    file.sync_all()
}

fn create(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // What any new file gets, less the user's mask: temporary files are private otherwise.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_appears_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("block.stl");
        for text in ["first", "second"] {
            write_atomically(&path, |w| {
                assert!(fs::read_dir(folder.path()).unwrap().count() >= 1);
                w.write_all(text.as_bytes())
            })
            .unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
            assert_eq!(names(folder.path()), ["block.stl"]);
        }
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let plain = folder.path().join("plain");
            fs::write(&plain, "").unwrap();
            let mode = |p: &Path| fs::metadata(p).unwrap().permissions().mode();
            assert_eq!(mode(&path), mode(&plain));
        }
    }

    #[test]
    fn a_write_that_fails_on_the_way_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("block.stl");
        fs::write(&path, "old").unwrap();
        let error = write_atomically(&path, |w| {
            w.write_all(&[7; 1 << 20])?;
            Err(io::ErrorKind::StorageFull.into())
        })
        .unwrap_err();
        assert!(matches!(error, WriteError::Io { .. }) && error.to_string().contains("block.stl"), "{error}");
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(names(folder.path()), ["block.stl"]);
    }

    #[test]
    fn a_probe_leaves_nothing_and_touches_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("block.stl");
        probe(&path).unwrap();
        assert!(names(folder.path()).is_empty());
        fs::write(&path, "old").unwrap();
        probe(&path).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert!(matches!(probe(&folder.path().join("nowhere/block.stl")), Err(WriteError::NoFolder { .. })));
    }

    #[test]
    fn what_a_dead_writer_left_is_removed_and_what_a_living_one_writes_is_not() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(".glasswarp-orphan.part"), "half").unwrap();
        fs::write(folder.path().join(".somebody.part"), "else").unwrap();
        let path = folder.path().join("block.stl");
        write_atomically(&path, |w| {
            w.write_all(b"whole")?;
            probe(&folder.path().join("other.stl")).map_err(io::Error::other)
        })
        .unwrap();
        assert_eq!(names(folder.path()), [".somebody.part", "block.stl"]);
    }

    #[test]
    fn folders_that_are_missing_or_no_folders_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("nowhere");
        let error = write_atomically(&missing.join("block.stl"), |_| Ok(())).unwrap_err();
        assert!(matches!(&error, WriteError::NoFolder { folder, .. } if *folder == missing), "{error}");
        let file = folder.path().join("file");
        fs::write(&file, "").unwrap();
        assert!(matches!(write_atomically(&file.join("block.stl"), |_| Ok(())), Err(WriteError::NoFolder { .. })));
        for no_file in [folder.path(), Path::new("/"), Path::new(""), Path::new("..")] {
            assert!(matches!(write_atomically(no_file, |_| Ok(())), Err(WriteError::NoFile { .. })));
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_device_is_not_replaced_and_a_folder_of_the_kernel_takes_no_file() {
        assert!(matches!(write_atomically(Path::new("/dev/full"), |_| Ok(())), Err(WriteError::NoFile { .. })));
        let error = write_atomically(Path::new("/proc/block.stl"), |_| Ok(())).unwrap_err();
        assert!(matches!(error, WriteError::Folder { .. }), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn a_file_that_is_replaced_keeps_its_permissions() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("block.stl");
        for mode in [0o600, 0o664, 0o644] {
            fs::write(&path, "old").unwrap();
            fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
            write_atomically(&path, |w| w.write_all(b"new")).unwrap();
            assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, mode);
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_followed() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file.stl"), folder.path().join("link.stl"));
        fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_atomically(&link, |w| w.write_all(b"new")).unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read_to_string(&file).unwrap(), "new");
    }
}
