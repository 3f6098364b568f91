//! Files that are replaced as a whole.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::fs;
use std::io::{ErrorKind, Write};
use std::path::PathBuf;

use slate_configuration::replacement::Replacement;

/// An empty folder.
fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("replacement-{name}"));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

#[test]
fn a_file_is_the_older_one_until_the_new_one_is_kept() {
    let folder = folder("kept");
    let path = folder.join("file");
    fs::write(&path, "older").unwrap();
    // What a process left that was killed.
    fs::write(folder.join("file.part"), "much longer than what comes").unwrap();
    let mut new = Replacement::create(&path).unwrap();
    new.write_all(b"new").unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), "older");
    drop(new);
    assert!(!folder.join("file.part").exists(), "it was not kept");
    let mut new = Replacement::create(&path).unwrap();
    new.write_all(b"new").unwrap();
    new.keep().unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), "new");
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
}

#[test]
fn of_two_that_write_one_file_the_second_is_refused() {
    let path = folder("two").join("file");
    let first = Replacement::create(&path).unwrap();
    assert_eq!(Replacement::create(&path).unwrap_err().kind(), ErrorKind::AlreadyExists);
    first.keep().unwrap();
    // The lock of the new file blocks no other process.
    let second = Replacement::create(&path).unwrap();
    drop(second);
    assert!(path.exists());
}

#[test]
fn non_file_is_refused() {
    let folder = folder("none");
    assert_eq!(Replacement::create(&folder).unwrap_err().kind(), ErrorKind::IsADirectory);
    let missing = folder.join("missing").join("file");
    assert_eq!(Replacement::create(&missing).unwrap_err().kind(), ErrorKind::NotFound);
    assert!(Replacement::create(std::path::Path::new("/dev/null")).is_err());
}
