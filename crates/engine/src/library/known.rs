//! Checksums of libraries at their last load, to detect changes before opening.

use std::fs::{self, DirBuilder, File, Metadata};
use std::io::{self, Write};
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use slate_configuration::replacement::Replacement;

use super::{LibraryError, checksum};

/// Maximum number of known libraries; the least recently loaded is dropped first.
const LIBRARY_LIMIT: usize = 256;

/// Largest file that is read, bytes.
const FILE_SIZE_LIMIT: u64 = 1 << 20;

/// Libraries of a user's agents by their checksums, in a file.
///
/// One that was written since is another one. One that was not, and has other bytes nevertheless, is damaged: so does a disk
/// that fails.
#[derive(Debug)]
pub struct KnownLibraries {
    file: PathBuf,
}

/// Record of a library at its last load.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
struct KnownLibrary {
    path: PathBuf,
    /// Hexadecimal.
    checksum: String,
    written: FileStamp,
}

/// Changes whenever a file is written or replaced, whatever sets its date.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
struct FileStamp {
    inode: u64,
    length: u64,
    /// Seconds and nanoseconds.
    modified: (i64, i64),
    changed: (i64, i64),
}

impl FileStamp {
    fn from_metadata(found: &Metadata) -> Self {
        Self {
            inode: found.ino(),
            length: found.len(),
            modified: (found.mtime(), found.mtime_nsec()),
            changed: (found.ctime(), found.ctime_nsec()),
        }
    }
}

impl KnownLibraries {
    /// Returns the records in that file, which the first load creates.
    pub fn at(file: PathBuf) -> Self {
        Self { file }
    }

    /// Returns true if a library was rewritten since its record; updates the record.
    ///
    /// # Errors
    /// It is damaged. It stays known as it was.
    pub fn check(&self, library: &Path) -> Result<bool, LibraryError> {
        // An unreadable file is refused at load.
        let Ok(present) = KnownLibrary::read(library) else { return Ok(false) };
        let mut known = self.read();
        let before = known.iter().position(|known| known.path == present.path).map(|at| known.remove(at));
        if before.as_ref() == Some(&present) {
            return Ok(false);
        }
        if before.as_ref().is_some_and(|before| before.written == present.written) {
            return Err(LibraryError {
                file: library.into(),
                problem:
                    "is damaged: its bytes have changed since it was last loaded, without a write to the file"
                        .into(),
                help: "build or copy it again, and look after the disk".into(),
            });
        }
        let is_changed = before.is_some_and(|before| before.checksum != present.checksum);
        known.push(present);
        // Where this can't be written, nothing is known the next time.
        let _ = self.write(&known[known.len().saturating_sub(LIBRARY_LIMIT)..]);
        Ok(is_changed)
    }

    fn read(&self) -> Vec<KnownLibrary> {
        // Any other file is replaced.
        let is_small =
            fs::metadata(&self.file).is_ok_and(|found| found.is_file() && found.len() <= FILE_SIZE_LIMIT);
        let text = is_small.then(|| fs::read(&self.file).ok()).flatten();
        text.and_then(|text| serde_json::from_slice(&text).ok()).unwrap_or_default()
    }

    fn write(&self, known: &[KnownLibrary]) -> io::Result<()> {
        if let Some(folder) = self.file.parent() {
            // Only the user may read it, as the XDG base directory specification says.
            DirBuilder::new().recursive(true).mode(0o700).create(folder)?;
        }
        let mut new = Replacement::create(&self.file)?;
        new.write_all(&serde_json::to_vec(known)?)?;
        new.keep()
    }
}

impl KnownLibrary {
    fn read(library: &Path) -> io::Result<Self> {
        let path = fs::canonicalize(library)?;
        let mut file = File::open(&path)?;
        let found = file.metadata()?;
        if !found.is_file() {
            return Err(io::ErrorKind::InvalidInput.into());
        }
        let checksum = format!("{:016x}", checksum::hash(&mut file, found.len())?);
        Ok(Self { path, checksum, written: FileStamp::from_metadata(&found) })
    }
}
