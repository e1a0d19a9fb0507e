//! What a handler of Ctrl-C does to files that are being written. Alone in its process, since it
//! concerns all of its files.

use glasswarp::export::{WriteError, remove_unfinished, write_atomically};
use std::{fs, io::Write};

#[test]
fn an_interrupted_write_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("block.stl");
    let error = write_atomically(&path, |w| {
        w.write_all(b"half")?;
        drop(remove_unfinished());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        Ok(())
    });
    assert!(matches!(error, Err(WriteError::Io { .. })));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}
