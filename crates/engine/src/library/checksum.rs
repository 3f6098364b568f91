//! Checksum appended to a library, against damage on its way to the robot.
//! A damaged library is not opened.
//!
//! The system's loader trusts a file, and a changed byte in a table of its own ends the process later, where the cause
//! is hard to find. No loader reads data behind the last section of a library.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

use xxhash_rust::xxh3::Xxh3Default;

/// Magic bytes of a seal; the hash of all bytes before it follows, little endian.
pub(super) const SEAL_MAGIC: &[u8; 8] = b"SLATESUM";

/// Size of a seal, bytes.
const SEAL_LENGTH: u64 = 16;

/// Returns the hash of the first `length` bytes.
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

/// Returns the hash in a library's seal and the number of bytes before the seal.
/// `None` if it has no seal.
pub(super) fn seal_of(file: &mut File) -> io::Result<Option<(u64, u64)>> {
    let Some(before) = file.metadata()?.len().checked_sub(SEAL_LENGTH) else { return Ok(None) };
    let mut seal = [0; SEAL_LENGTH as usize];
    file.seek(SeekFrom::Start(before))?;
    file.read_exact(&mut seal)?;
    file.rewind()?;
    let expected = seal.strip_prefix(SEAL_MAGIC).and_then(|expected| expected.try_into().ok());
    Ok(expected.map(|expected| (u64::from_le_bytes(expected), before)))
}

/// Verifies a library against its seal; true if it has none.
pub(super) fn matches_seal(file: &mut File) -> io::Result<bool> {
    let Some((expected, before)) = seal_of(file)? else { return Ok(true) };
    let found = hash(file, before)?;
    file.rewind()?;
    Ok(found == expected)
}
