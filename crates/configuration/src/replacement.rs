//! Atomic replacement of a file.

use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// File that replaces another one atomically once it is complete.
/// It is written beside the other as `FILE.part`, and removed unless it is kept.
///
/// At any moment either the older file is there or the new one, whole, also after a loss of power. Of two writers of the
/// same file, one is refused; the remains of a killed process are replaced.
///
/// ```
/// use std::io::Write;
/// use slate_configuration::replacement::Replacement;
/// # let folder = std::env::temp_dir().join(format!("slate-replacement-{}", std::process::id()));
/// # std::fs::create_dir_all(&folder)?;
/// # let path = folder.join("figures.txt");
///
/// let mut new = Replacement::create(&path)?;
/// writeln!(new, "42")?;
/// new.keep()?;
/// # assert_eq!(std::fs::read_to_string(&path)?, "42\n");
/// # std::fs::remove_dir_all(&folder)?;
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Debug)]
pub struct Replacement {
    path: PathBuf,
    part: PathBuf,
    /// Locked file; of two writers of the same file one is refused.
    file: File,
    is_kept: bool,
}

impl Replacement {
    /// Begins to write the new file of a path.
    ///
    /// # Errors
    /// When the folder can't be written to, another process is writing there, or the path leads to no regular file.
    pub fn create(path: &Path) -> io::Result<Self> {
        match fs::metadata(path) {
            Ok(found) if found.is_dir() => return Err(ErrorKind::IsADirectory.into()),
            Ok(found) if !found.is_file() => {
                return Err(io::Error::new(
                    ErrorKind::InvalidInput,
                    "it is a device or another special file",
                ));
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
            // Its earlier owner may have put it in its place since it was opened: then it is complete, and stays so.
            if is_at(&file, &part)? {
                let replacement = Self { path: path.into(), part, file, is_kept: false };
                if replacement.file.metadata()?.len() > 0 {
                    // Left by a process that was killed.
                    replacement.file.set_len(0)?;
                }
                return Ok(replacement);
            }
        }
    }

    /// New file, such as to give it the permissions of the old one.
    pub fn file(&self) -> &File {
        &self.file
    }

    /// Replaces the old file by the new one.
    ///
    /// # Errors
    /// When it can't be; the older file is then as it was. Or when its name can't be written to the disk; the new file is then
    /// there, and a loss of power may bring the older one back.
    pub fn keep(mut self) -> io::Result<()> {
        self.file.sync_all()?;
        fs::rename(&self.part, &self.path)?;
        // A later file of that name belongs to another process.
        self.is_kept = true;
        let folder = self.path.parent().filter(|folder| !folder.as_os_str().is_empty());
        match File::open(folder.unwrap_or(Path::new("."))).and_then(|folder| folder.sync_all()) {
            // Not all systems can do that, and not all folders that may be written to may be opened.
            Err(error) if is_beyond(error.kind()) => Ok(()),
            synced => synced,
        }
    }
}

fn is_beyond(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::InvalidInput | ErrorKind::Unsupported | ErrorKind::PermissionDenied)
}

/// Returns true if a path leads to a file.
fn is_at(file: &File, path: &Path) -> io::Result<bool> {
    let own = file.metadata()?;
    match fs::metadata(path) {
        Ok(there) => Ok((own.dev(), own.ino()) == (there.dev(), there.ino())),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
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
