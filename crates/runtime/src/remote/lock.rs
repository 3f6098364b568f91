//! Files that say that somebody is there.

use std::fs::{self, File, TryLockError};
use std::io::Result;
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
                return Ok(Some(Self { path: path.into(), _locked: file }));
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // Who removed it before did the same.
        let _ = fs::remove_file(&self.path);
    }
}
