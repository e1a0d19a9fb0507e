//! The record of a folder: which contents this program has written under which names.

use crate::identity::{self, Stamp};
use sha2::{Digest, Sha256};
use std::{
    collections::{BTreeMap, HashMap},
    fs::{self, File},
    io::{self, Read, Seek, Write},
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

/// The name of a folder's record. Its lines are those of `sha256sum`.
pub const NAME: &str = ".glasswarp.sha256";

/// Lines after which the record keeps only the latest of every name.
const MANY: usize = 4096;
/// Those it then keeps of a name: of the file that stands there, and of one that takes its place.
const KEPT: usize = 2;

/// One writer of records at a time in this process; a lock of the file keeps other processes off.
static WRITER: Mutex<()> = Mutex::new(());

/// What this process has entered in records: by file, how it was then and its SHA-256.
static ENTERED: Mutex<BTreeMap<PathBuf, (Stamp, String)>> = Mutex::new(BTreeMap::new());

/// The SHA-256 of a file's content, in hexadecimal. It is known, and the file not read again, if
/// this process has entered the file in a record and it has kept its length and the time of its
/// last change.
///
/// # Errors
/// A file that cannot be read.
pub fn sha256(path: &Path) -> io::Result<String> {
    let entered = ENTERED.lock().unwrap_or_else(PoisonError::into_inner).get(&identity::location(path)).cloned();
    match entered {
        Some((then, hash)) if identity::stamp(path) == Some(then) => Ok(hash),
        _ => digest(path),
    }
}

fn digest(path: &Path) -> io::Result<String> {
    let mut file = File::open(path)?;
    let mut hasher = Sha256::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        match file.read(&mut buffer)? {
            0 => break,
            n => hasher.update(&buffer[..n]),
        }
    }
    Ok(hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

fn path_for(file: &Path) -> PathBuf {
    file.with_file_name(NAME)
}

/// A line of the record; anything else in it is passed over.
fn line(text: &str) -> Option<(&str, &str)> {
    let (hash, name) = text.split_once("  ")?;
    (hash.len() == 64 && hash.bytes().all(|byte| byte.is_ascii_hexdigit())).then_some((hash, name))
}

fn name_of(file: &Path) -> Option<&str> {
    file.file_name()?.to_str()
}

/// What the record of its folder knows of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Known {
    /// This program wrote it, and it is as it was written.
    Own,
    /// This program wrote a file of this name, and its content is another now.
    Changed,
    /// This program wrote no file of this name.
    Foreign,
}

/// Looks a file up. It must be there.
pub(crate) fn look_up(file: &Path) -> io::Result<Known> {
    let text = match fs::read(path_for(file)) {
        Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Known::Foreign),
        Err(error) => return Err(error),
    };
    let hashes: Vec<&str> =
        text.lines().filter_map(line).filter(|(_, name)| Some(*name) == name_of(file)).map(|(hash, _)| hash).collect();
    if hashes.is_empty() {
        return Ok(Known::Foreign);
    }
    let found = digest(file)?;
    Ok(if hashes.contains(&found.as_str()) { Known::Own } else { Known::Changed })
}

/// Records that `file` has, or is about to have, the content that is in `content`.
pub(crate) fn enter(file: &Path, content: &Path) -> io::Result<()> {
    let Some(name) = name_of(file) else { return Err(io::ErrorKind::InvalidFilename.into()) };
    let (stamp, hash) = (identity::stamp(content), digest(content)?);
    if let Some(stamp) = stamp {
        ENTERED.lock().unwrap_or_else(PoisonError::into_inner).insert(identity::location(file), (stamp, hash.clone()));
    }
    let _alone = WRITER.lock().unwrap_or_else(PoisonError::into_inner);
    let mut record = File::options().read(true).append(true).create(true).open(path_for(file))?;
    // File systems without locks have one writer as a rule.
    let _ = record.lock();
    let mut bytes = Vec::new();
    record.read_to_end(&mut bytes)?;
    let text = String::from_utf8_lossy(&bytes);
    if text.lines().filter_map(line).any(|known| known == (&hash, name)) {
        return Ok(());
    }
    if text.lines().count() >= MANY {
        let kept = latest(&text);
        record.set_len(0)?;
        record.rewind()?;
        record.write_all(kept.as_bytes())?;
    }
    // A line that was cut short by a power cut must not spoil the next.
    let torn = if text.is_empty() || text.ends_with('\n') { "" } else { "\n" };
    record.write_all(format!("{torn}{hash}  {name}\n").as_bytes())?;
    record.sync_data()
}

/// The last lines of every name.
fn latest(text: &str) -> String {
    let mut seen: HashMap<&str, usize> = HashMap::new();
    let mut kept: Vec<(&str, &str)> = Vec::new();
    for (hash, name) in text.lines().rev().filter_map(line) {
        let count = seen.entry(name).or_default();
        *count += 1;
        if *count <= KEPT {
            kept.push((hash, name));
        }
    }
    kept.iter().rev().map(|(hash, name)| format!("{hash}  {name}\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_known_by_its_name_and_its_content() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("a.stl"), "one").unwrap();
        assert_eq!(look_up(&at("a.stl")).unwrap(), Known::Foreign);
        for _ in 0..3 {
            enter(&at("a.stl"), &at("a.stl")).unwrap();
        }
        assert_eq!(look_up(&at("a.stl")).unwrap(), Known::Own);
        assert_eq!(fs::read_to_string(at(NAME)).unwrap().lines().count(), 1, "the same is entered once");
        fs::copy(at("a.stl"), at("b.stl")).unwrap();
        assert_eq!(look_up(&at("b.stl")).unwrap(), Known::Foreign, "a copy under another name is somebody's");
        fs::write(at("a.stl"), "two").unwrap();
        assert_eq!(look_up(&at("a.stl")).unwrap(), Known::Changed);
    }

    #[test]
    fn the_hash_of_what_was_entered_is_known_until_the_file_changes() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("part"), "one").unwrap();
        enter(&at("a.stl"), &at("part")).unwrap();
        fs::rename(at("part"), at("a.stl")).unwrap();
        assert_eq!(sha256(&at("a.stl")).unwrap(), digest(&at("a.stl")).unwrap());
        fs::write(at("a.stl"), "another").unwrap();
        assert_eq!(sha256(&at("a.stl")).unwrap(), digest(&at("a.stl")).unwrap());
        fs::remove_file(at("a.stl")).unwrap();
        assert!(sha256(&at("a.stl")).is_err());
    }

    #[test]
    fn a_damaged_record_knows_what_is_whole_in_it_and_is_written_on() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("a.stl"), "one").unwrap();
        enter(&at("a.stl"), &at("a.stl")).unwrap();
        let whole = fs::read(at(NAME)).unwrap();
        fs::write(at(NAME), [&whole[..], b"\xff\x00 nonsense\n0123"].concat()).unwrap();
        fs::write(at("b.stl"), "two").unwrap();
        enter(&at("b.stl"), &at("b.stl")).unwrap();
        assert_eq!(look_up(&at("a.stl")).unwrap(), Known::Own);
        assert_eq!(look_up(&at("b.stl")).unwrap(), Known::Own);
    }

    #[test]
    fn a_long_record_keeps_the_latest_of_every_name() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let old: String = (0..MANY).map(|k| format!("{k:064x}  a.stl\n")).collect();
        fs::write(at(NAME), old).unwrap();
        fs::write(at("b.stl"), "two").unwrap();
        enter(&at("b.stl"), &at("b.stl")).unwrap();
        let text = fs::read_to_string(at(NAME)).unwrap();
        assert_eq!(text.lines().count(), KEPT + 1);
        assert!(text.contains(&format!("{:064x}  a.stl", MANY - 1)) && text.contains("  b.stl"), "{text}");
    }
}
