//! Lock files, which show that a process runs.

use std::fs::{self, File, TryLockError};
use std::io::{Result, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// Lock file of one process at a time; removed when this is dropped.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    /// Locked file; the system releases the lock when the process ends.
    _locked: File,
}

impl Lock {
    /// Locks a file, created if missing; `None` if another process has locked it.
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

    /// Returns the process that has locked a file, if it is known.
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
