//! Files that are there whole, or not at all.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::Error;

/// A file that is written under a name with `.part`, which it loses when it is whole and on the disk. An older file of
/// its name is there until then, and stays when something goes wrong.
pub(crate) struct Part {
    path: PathBuf,
    part: PathBuf,
    out: BufWriter<File>,
    is_whole: bool,
}

impl Part {
    pub fn create(path: &Path) -> Result<Self, Error> {
        let mut name = path.file_name().unwrap_or_default().to_owned();
        name.push(".part");
        let part = path.with_file_name(name);
        let file = File::create(&part).map_err(|source| Error::Write { path: path.into(), source })?;
        Ok(Self { path: path.into(), part, out: BufWriter::with_capacity(1 << 16, file), is_whole: false })
    }

    pub fn finish(mut self) -> Result<(), Error> {
        let written = self
            .out
            .flush()
            .and_then(|()| self.out.get_ref().sync_all())
            .and_then(|()| std::fs::rename(&self.part, &self.path));
        written.map_err(|source| Error::Write { path: self.path.clone(), source })?;
        self.is_whole = true;
        Ok(())
    }
}

impl Write for Part {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.out.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        if !self.is_whole {
            // What went wrong is told already.
            let _ = std::fs::remove_file(&self.part);
        }
    }
}

/// Writes a whole file.
pub(crate) fn write<T>(path: &Path, write: impl FnOnce(&mut Part) -> Result<T, Error>) -> Result<T, Error> {
    let mut part = Part::create(path)?;
    let done = write(&mut part)?;
    part.finish()?;
    Ok(done)
}
