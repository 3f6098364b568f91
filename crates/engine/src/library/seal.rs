//! Sealing a library with a [checksum](super::checksum).

use std::fs::File;
use std::io::{self, Seek, Write};
use std::path::Path;

use slate_configuration::replacement::Replacement;

use super::checksum::{SEAL_MAGIC, hash, seal_of};
use super::{LibraryError, LibraryOutline};

/// Seals a plugin's library, so that a change of any byte is detected.
/// False if it was sealed already.
///
/// # Errors
/// When the file is not a plugin, is damaged, or can't be written; it is as it was then.
pub fn seal(path: &Path) -> Result<bool, LibraryError> {
    LibraryOutline::read(path)?;
    let failed = |error: io::Error| LibraryError {
        file: path.into(),
        problem: format!("can't be sealed: {error}"),
        help: "name a library in a folder that can be written to".into(),
    };
    let mut file = File::open(path).map_err(failed)?;
    if seal_of(&mut file).map_err(failed)?.is_some() {
        return Ok(false);
    }
    let mut write = || {
        let found = file.metadata()?;
        let sum = hash(&mut file, found.len())?;
        file.rewind()?;
        let mut sealed = Replacement::create(path)?;
        sealed.file().set_permissions(found.permissions())?;
        io::copy(&mut file, &mut sealed)?;
        sealed.write_all(SEAL_MAGIC)?;
        sealed.write_all(&sum.to_le_bytes())?;
        sealed.keep()
    };
    write().map_err(failed)?;
    Ok(true)
}
