use std::fs;
use std::io::{self, Write};
use std::path::Path;

use crate::replacement::Replacement;

/// Replaces a file by a text atomically: the old or the new one is there whole.
pub(super) fn replace(path: &Path, text: &str) -> io::Result<()> {
    let old = fs::metadata(path)?;
    let mut new = Replacement::create(path)?;
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        // An agent that runs as root leaves the file to its owner; another one may not, and need not.
        let _ = std::os::unix::fs::fchown(new.file(), Some(old.uid()), Some(old.gid()));
    }
    new.file().set_permissions(old.permissions())?;
    new.write_all(text.as_bytes())?;
    new.keep()
}
