//! Snapshot file: one CBOR document, with a head readable without the rest.

use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use slate_module::{CodecError, from_cbor, to_cbor};
use xxhash_rust::xxh3::xxh3_64_with_seed;

use super::{Bytes, Snapshot, SnapshotError};
use slate_configuration::replacement::Replacement;

/// The version of the format.
const VERSION: u64 = 1;

/// A plugin that was loaded when a snapshot was taken.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PluginMark {
    /// Name.
    pub name: String,
    /// Version.
    pub version: String,
    /// Library of its code; `None` if it was linked in.
    pub file: Option<PathBuf>,
    /// Hash of the plugin.
    /// For a library it is over the whole file as loaded. For a linked plugin it is over the names of its kinds of
    /// modules, and over its modules: their names, parameters and ports.
    pub hash: u64,
}

/// Head of a snapshot, shown before the rest is used.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct SnapshotHead {
    pub agent: String,
    pub time: u64,
    pub cycle: u64,
    pub plugins: Vec<PluginMark>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SnapshotDocument {
    /// The version of the format.
    slate_snapshot: u64,
    head: SnapshotHead,
    /// Checksum of the head and the image.
    checksum: u64,
    /// The image, as CBOR.
    image: Bytes,
}

fn checksum(head: &SnapshotHead, image: &[u8]) -> io::Result<u64> {
    let bytes = to_cbor(&(VERSION, head)).map_err(io::Error::other)?;
    Ok(xxh3_64_with_seed(image, xxh3_64_with_seed(&bytes, 0)))
}

fn encode(snapshot: &Snapshot) -> io::Result<Vec<u8>> {
    let image = to_cbor(&snapshot.image).map_err(io::Error::other)?;
    let head = snapshot.head.clone();
    let checksum = checksum(&head, &image)?;
    let document = SnapshotDocument { slate_snapshot: VERSION, head, checksum, image: Bytes(image) };
    to_cbor(&document).map_err(io::Error::other)
}

pub(super) fn write(snapshot: &Snapshot, path: &Path) -> Result<(), SnapshotError> {
    let failed = |source: io::Error| SnapshotError::File {
        file: path.into(),
        what: "written",
        help: match source.kind() {
            io::ErrorKind::StorageFull => "make room on the disk, or name a file on another one",
            io::ErrorKind::NotFound => "name a file in a folder that exists",
            io::ErrorKind::AlreadyExists => "another snapshot is just written there: wait for it",
            _ => "name a file in a folder that can be written to",
        },
        source,
    };
    let bytes = encode(snapshot).map_err(failed)?;
    let mut new = Replacement::create(path).map_err(failed)?;
    new.write_all(&bytes).and_then(|()| new.keep()).map_err(failed)
}

pub(super) fn read(path: &Path) -> Result<Snapshot, SnapshotError> {
    let failed = |source| SnapshotError::File {
        file: path.into(),
        what: "read",
        help: "name a file that `slate snapshot save` has written",
        source,
    };
    let mut file = fs::File::open(path).map_err(failed)?;
    let found = file.metadata().map_err(failed)?;
    // A pipe or a device may have no end.
    if !found.is_file() {
        return Err(failed(io::Error::new(io::ErrorKind::InvalidInput, "it is not a file")));
    }
    let mut bytes = Vec::new();
    if found.len() > SMALL {
        // Other files are not read into memory.
        (&mut file).take(HEAD).read_to_end(&mut bytes).map_err(failed)?;
        if !bytes.windows(FIRST.len()).any(|part| part == FIRST) {
            return Err(damaged(path, "something else is in it".into()));
        }
    }
    file.read_to_end(&mut bytes).map_err(failed)?;
    decode(&bytes, path)
}

/// Size below which files are read without a check of the marker, bytes.
const SMALL: u64 = 1 << 20;

/// Marker at the start of a snapshot; [`HEAD`] limits its place, in bytes.
const FIRST: &[u8] = b"slate_snapshot";
const HEAD: u64 = 64;

fn damaged(path: &Path, problem: String) -> SnapshotError {
    SnapshotError::Damaged { file: path.into(), problem }
}

/// Version field of a snapshot, read first.
/// A later version may have any other fields.
#[derive(Deserialize)]
struct SnapshotVersion {
    slate_snapshot: u64,
}

fn decode(bytes: &[u8], path: &Path) -> Result<Snapshot, SnapshotError> {
    let damaged = |problem: String| damaged(path, problem);
    let document: SnapshotDocument = match from_cbor(bytes) {
        Ok(document) => document,
        Err(error) => {
            return Err(match from_cbor::<SnapshotVersion>(bytes) {
                Ok(SnapshotVersion { slate_snapshot: found }) if found != VERSION => version(path, found),
                Err(CodecError::Unfit(_) | CodecError::Syntax(_)) => {
                    damaged("something else is in it".into())
                }
                _ => damaged(error.to_string()),
            });
        }
    };
    if document.slate_snapshot != VERSION {
        return Err(version(path, document.slate_snapshot));
    }
    // CBOR has several ways to write some values, so a change may be none of the values.
    let again = to_cbor(&document).map_err(|error| damaged(error.to_string()))?;
    let SnapshotDocument { head, checksum: said, image, .. } = document;
    let found = checksum(&head, &image.0).map_err(|error| damaged(error.to_string()))?;
    if found == said && bytes.len() > again.len() && bytes.starts_with(&again) {
        return Err(damaged("something else follows behind it".into()));
    }
    if found != said || again != bytes {
        return Err(damaged("its checksum is another one".into()));
    }
    let image = from_cbor(&image.0).map_err(|error| damaged(error.to_string()))?;
    Ok(Snapshot { head, image })
}

fn version(path: &Path, found: u64) -> SnapshotError {
    SnapshotError::Version { file: path.into(), found, expected: VERSION }
}
