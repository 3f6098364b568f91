//! Files that are there whole, or not at all.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use super::Error;

/// Writes a file under a name with `.part`, which it loses when it is whole and on the disk. An older file of that name
/// is there until then, and stays when something goes wrong.
pub(super) fn write<T>(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<T, Error>,
) -> Result<T, Error> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    let part = path.with_file_name(name);
    let written = write_part(path, &part, write);
    if written.is_err() {
        // It may never have been made.
        let _ = std::fs::remove_file(&part);
    }
    written
}

fn write_part<T>(
    path: &Path,
    part: &PathBuf,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<T, Error>,
) -> Result<T, Error> {
    let failed = |source| Error::Write { path: path.into(), source };
    let mut out = BufWriter::with_capacity(1 << 16, File::create(part).map_err(failed)?);
    let done = write(&mut out)?;
    out.flush().map_err(failed)?;
    out.get_ref().sync_all().map_err(failed)?;
    std::fs::rename(part, path).map_err(failed)?;
    Ok(done)
}
