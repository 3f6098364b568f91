//! A folder of the system's temporary files.

use std::io;
use std::path::{Path, PathBuf};
use std::process;

/// Folder of this process, removed with all that is in it when this is dropped.
pub struct ProcessFolder(PathBuf);

impl ProcessFolder {
    /// Makes one.
    ///
    /// # Errors
    /// It is there, or can't be made.
    pub fn new() -> io::Result<Self> {
        let path = std::env::temp_dir().join(format!("slate-instructions-{}", process::id()));
        std::fs::create_dir(&path)?;
        Ok(Self(path))
    }

    /// Returns where it is.
    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for ProcessFolder {
    fn drop(&mut self) {
        // What is left is among the temporary files, which the system removes.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
