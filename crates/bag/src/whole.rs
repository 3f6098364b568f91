//! Files that are there whole, or not at all.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use slate_configuration::replacement::Replacement;

use super::Error;

/// File that takes its name once it is complete and on the disk.
/// An older file of that name is there until then, and stays after an error.
pub struct PartialFile {
    path: PathBuf,
    out: BufWriter<Replacement>,
}

impl PartialFile {
    /// Begins the file under another name.
    ///
    /// # Errors
    ///
    /// When the folder can't be written.
    pub fn create(path: &Path) -> Result<Self, Error> {
        let new = Replacement::create(path).map_err(|source| Error::Write { path: path.into(), source })?;
        Ok(Self { path: path.into(), out: BufWriter::with_capacity(1 << 16, new) })
    }

    /// Gives the file its name.
    ///
    /// # Errors
    ///
    /// When the file can't be written.
    pub fn finish(self) -> Result<(), Error> {
        let whole = self.out.into_inner().map_err(io::IntoInnerError::into_error);
        whole.and_then(Replacement::keep).map_err(|source| Error::Write { path: self.path, source })
    }
}

impl Write for PartialFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.out.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// Writes a whole file.
pub fn write<T>(path: &Path, write: impl FnOnce(&mut PartialFile) -> Result<T, Error>) -> Result<T, Error> {
    let mut part = PartialFile::create(path)?;
    let done = write(&mut part)?;
    part.finish()?;
    Ok(done)
}
