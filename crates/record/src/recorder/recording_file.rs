//! File of a recording, which never overwrites another one.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// A file that no other run writes while it is open.
#[derive(Debug)]
pub(super) struct RecordingFile {
    pub file: File,
    pub path: PathBuf,
    /// New path of an earlier recording that had the name.
    pub earlier: Option<PathBuf>,
}

impl RecordingFile {
    /// Creates the file of that name.
    /// An existing recording gets the next number, `run-1.mcap`; while another run still writes it, the new one gets
    /// the number.
    pub fn open(path: &Path) -> io::Result<Self> {
        let mut earlier = None;
        loop {
            match create(path) {
                Ok(file) => return Ok(Self { file, path: path.into(), earlier }),
                Err(error) if error.kind() != ErrorKind::AlreadyExists => return Err(error),
                // A device keeps nothing.
                Err(_) if !path.is_file() => {
                    return Ok(Self { file: File::create(path)?, path: path.into(), earlier });
                }
                Err(_) => {}
            }
            let before = OpenOptions::new().read(true).open(path)?;
            if matches!(before.try_lock_shared(), Err(TryLockError::WouldBlock)) {
                let (file, path) = numbered(path)?;
                return Ok(Self { file, path, earlier });
            }
            // The empty file keeps the number, as a rename takes the place of what is there.
            let (_, place) = numbered(path)?;
            std::fs::rename(path, &place)?;
            earlier = Some(place);
        }
    }
}

fn create(path: &Path) -> io::Result<File> {
    let file = OpenOptions::new().write(true).create_new(true).open(path)?;
    // Where a file system has no locks, a second run takes this one for an earlier recording, and still mixes nothing.
    let _ = file.try_lock();
    Ok(file)
}

/// Creates the first free file of that name with a number.
fn numbered(path: &Path) -> io::Result<(File, PathBuf)> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let extension = path.extension().map_or_else(String::new, |name| format!(".{}", name.to_string_lossy()));
    let mut number = 1_u64;
    loop {
        let place = path.with_file_name(format!("{stem}-{number}{extension}"));
        match create(&place) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => number += 1,
            made => return made.map(|file| (file, place)),
        }
    }
}
