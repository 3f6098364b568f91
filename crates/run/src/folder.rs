//! Folder of a run's report, which one run writes at a time.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

use crate::RunError;
use crate::options::RunOptions;

/// Folder of a run's results.
pub struct ReportFolder {
    path: PathBuf,
    /// Folder, once a result is kept.
    folder: Option<Folder>,
}

impl ReportFolder {
    /// Returns the folder of a run.
    /// It is made now if the run `keeps` a report, or the user names it; else when something is kept.
    pub fn of(options: &RunOptions, name: &str, seed: u64, keeps: bool) -> Result<Self, RunError> {
        let usual = PathBuf::from("runs").join(format!("{name}-{seed}"));
        let folder = match &options.out {
            Some(out) => Folder::take(out)?,
            None if !keeps => return Ok(Self { path: usual, folder: None }),
            None => Folder::take_next(&usual)?,
        };
        if options.out.is_none() && folder.path != usual {
            let [usual, own] = [&usual, &folder.path].map(|path| slate_runtime::printable(path));
            eprintln!("another run is writing its report into {usual}: this one uses {own}");
        }
        Ok(Self { path: folder.path.clone(), folder: Some(folder) })
    }

    /// Returns the folder, which may not exist yet.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns whether the run keeps anything.
    pub fn is_there(&self) -> bool {
        self.folder.is_some() || self.path.is_dir()
    }
}

/// Exclusive lock of a folder, as long as this value lives.
/// The system releases it with the process, however that ends.
pub struct Folder {
    /// Path of the folder.
    pub path: PathBuf,
    /// Lock file; `None` on a file system without locks.
    _lock: Option<File>,
}

impl Folder {
    /// Makes a folder if it is missing, and takes it.
    ///
    /// # Errors
    /// It can't be made, or another run writes into it.
    pub fn take(path: &Path) -> Result<Self, RunError> {
        let failed = |source| RunError::Folder { path: path.into(), source };
        std::fs::create_dir_all(path).map_err(failed)?;
        // The folder itself is locked, so that no file is left behind.
        let folder = File::open(path).map_err(failed)?;
        let lock = match folder.try_lock() {
            Ok(()) => Some(folder),
            Err(TryLockError::WouldBlock) => return Err(RunError::FolderInUse { path: path.into() }),
            Err(TryLockError::Error(_)) => None,
        };
        Ok(Self { path: path.into(), _lock: lock })
    }

    /// Locks the folder as [`take`](Folder::take), or the next free numbered one.
    ///
    /// # Errors
    /// It can't be made.
    pub fn take_next(path: &Path) -> Result<Self, RunError> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let numbered = (2..).map(|number| path.with_file_name(format!("{name}-{number}")));
        for path in std::iter::once(path.to_owned()).chain(numbered) {
            match Self::take(&path) {
                Err(RunError::FolderInUse { .. }) => {}
                taken => return taken,
            }
        }
        Err(RunError::FolderInUse { path: path.into() })
    }
}
