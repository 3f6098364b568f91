//! A checksum behind a library, so that one that was damaged on its way to the robot is not opened.
//!
//! The system's loader believes what a file says, and a changed byte in a table of its own ends the process later, where nobody
//! finds out why. What stands behind the last section of a library is read by no loader.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

use xxhash_rust::xxh3::Xxh3Default;

/// With what a seal begins; behind it is the hash over all before it, little endian.
pub(super) const MARK: &[u8; 8] = b"SLATESUM";

/// Bytes of a seal.
const LENGTH: u64 = 16;

/// The hash over so many bytes.
pub(super) fn hash(file: &mut impl Read, length: u64) -> io::Result<u64> {
    let (mut hash, mut part) = (Xxh3Default::new(), vec![0; 1 << 18]);
    let mut rest = file.take(length);
    loop {
        match rest.read(&mut part)? {
            0 => return Ok(hash.digest()),
            length => hash.update(&part[..length]),
        }
    }
}

/// The hash that a library's seal says, if it has one, and how many bytes are before it.
pub(super) fn seal_of(file: &mut File) -> io::Result<Option<(u64, u64)>> {
    let Some(before) = file.metadata()?.len().checked_sub(LENGTH) else { return Ok(None) };
    let mut seal = [0; LENGTH as usize];
    file.seek(SeekFrom::Start(before))?;
    file.read_exact(&mut seal)?;
    file.rewind()?;
    let said = seal.strip_prefix(MARK).and_then(|said| said.try_into().ok());
    Ok(said.map(|said| (u64::from_le_bytes(said), before)))
}

/// Whether a library is as it was sealed; also if it has no seal.
pub(super) fn holds(file: &mut File) -> io::Result<bool> {
    let Some((said, before)) = seal_of(file)? else { return Ok(true) };
    let found = hash(file, before)?;
    file.rewind()?;
    Ok(found == said)
}
