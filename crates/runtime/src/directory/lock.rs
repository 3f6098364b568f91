//! Files that say that somebody is there.

use std::fs::{self, File, TryLockError};
use std::io::{Result, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// A file that one process has locked at a time; it is removed with this.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    /// The system ends a lock with its process, however that dies.
    _locked: File,
}

impl Lock {
    /// Locks a file, which is made; nothing when somebody else has locked it.
    ///
    /// # Errors
    /// The file can't be made or locked.
    pub fn take(path: &Path) -> Result<Option<Self>> {
        loop {
            let file = File::options().create(true).truncate(false).write(true).open(path)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => return Ok(None),
                Err(TryLockError::Error(error)) => return Err(error),
            }
            // Its last owner may have removed it since it was opened, and then it locks nothing.
            let found = fs::metadata(path).map(|found| found.ino());
            if found.is_ok_and(|found| file.metadata().is_ok_and(|own| own.ino() == found)) {
                // For people, so it does not matter when there is no space for it.
                let _ = file
                    .set_len(0)
                    .and_then(|()| (&file).write_all(std::process::id().to_string().as_bytes()));
                return Ok(Some(Self { path: path.into(), _locked: file }));
            }
        }
    }

    /// The process that has locked a file, when it has said so.
    pub fn holder(path: &Path) -> Option<u32> {
        fs::read_to_string(path).ok()?.trim().parse().ok()
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // Another process may have removed it already.
        let _ = fs::remove_file(&self.path);
    }
}
