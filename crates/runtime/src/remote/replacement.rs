//! A file that takes the place of an older one when it is whole.

use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// Is written beside a file, as `FILE.part`, and takes its place when it is kept; else it is removed.
#[derive(Debug)]
pub(super) struct Replacement {
    path: PathBuf,
    part: PathBuf,
    /// Locked, so that of two that write the same file one is refused.
    file: File,
    is_kept: bool,
}

impl Replacement {
    /// Begins to write what shall be at that path.
    ///
    /// # Errors
    /// When the folder can't be written to, somebody else just writes there, or what is there is no regular file.
    pub fn create(path: &Path) -> io::Result<Self> {
        match fs::metadata(path) {
            Ok(found) if found.is_dir() => return Err(ErrorKind::IsADirectory.into()),
            Ok(found) if !found.is_file() => {
                return Err(io::Error::new(ErrorKind::InvalidInput, "there is a device or the like"));
            }
            _ => {}
        }
        let mut name = path.file_name().unwrap_or_default().to_owned();
        name.push(".part");
        let part = path.with_file_name(name);
        loop {
            let file = File::options().write(true).create(true).truncate(false).open(&part)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    return Err(io::Error::new(ErrorKind::AlreadyExists, "it is just being written"));
                }
                Err(TryLockError::Error(error)) => return Err(error),
            }
            // Since it was opened it may have become the file itself, which stays as it is.
            if fs::metadata(&part)
                .is_ok_and(|found| file.metadata().is_ok_and(|own| own.ino() == found.ino()))
            {
                let replacement = Self { path: path.into(), part, file, is_kept: false };
                // What a process left that was killed.
                replacement.file.set_len(0)?;
                return Ok(replacement);
            }
        }
    }

    /// Puts it in its place.
    ///
    /// # Errors
    /// When it can't be; the older file is then as it was.
    pub fn keep(mut self) -> io::Result<()> {
        fs::rename(&self.part, &self.path)?;
        self.is_kept = true;
        Ok(())
    }
}

impl Write for Replacement {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Drop for Replacement {
    fn drop(&mut self) {
        if !self.is_kept {
            let _ = fs::remove_file(&self.part);
        }
    }
}
