//! Persistent state of a module across runs, in a file of the configuration.
//!
//! The file is read before the run begins, as an input of it, and written at its end, all of it or nothing.

use std::io;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use slate_module::{CodecError, from_cbor, to_cbor};
use xxhash_rust::xxh3::xxh3_64_with_seed;

use crate::snapshot::Bytes;

/// The version of the format.
const VERSION: u64 = 1;

/// State of a module at the end of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ModuleMemory {
    /// The kind of module, such as `strategic_knowledge`.
    pub kind: String,
    /// State, as the module saves it.
    pub state: Vec<u8>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct MemoryDocument {
    /// The version of the format.
    slate_memory: u64,
    kind: String,
    /// Checksum of kind and state.
    checksum: u64,
    state: Bytes,
}

/// Version field of a memory file, read first.
/// A later version may have any other fields.
#[derive(Deserialize)]
struct MemoryVersion {
    slate_memory: u64,
}

impl ModuleMemory {
    fn checksum(&self) -> u64 {
        xxh3_64_with_seed(&self.state, xxh3_64_with_seed(self.kind.as_bytes(), VERSION))
    }

    /// Encodes the memory as the bytes of its file.
    ///
    /// # Errors
    /// When the encoder refuses it, which happens with no memory.
    pub fn to_bytes(&self) -> io::Result<Vec<u8>> {
        let document = MemoryDocument {
            slate_memory: VERSION,
            kind: self.kind.clone(),
            checksum: self.checksum(),
            state: Bytes(self.state.clone()),
        };
        to_cbor(&document).map_err(io::Error::other)
    }

    /// Reads the content of a file.
    ///
    /// # Errors
    /// The error, and its place if that is known.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let version =
            |found: u64| format!("it has version {found} of the format, and this program reads {VERSION}");
        let document: MemoryDocument =
            from_cbor(bytes).map_err(|error| match from_cbor::<MemoryVersion>(bytes) {
                Ok(MemoryVersion { slate_memory: found }) if found != VERSION => version(found),
                _ => match error {
                    CodecError::Short => format!("it ends too early, after byte {}", bytes.len()),
                    CodecError::Unfit(_) => "something else is in it".into(),
                    other => other.to_string(),
                },
            })?;
        if document.slate_memory != VERSION {
            return Err(version(document.slate_memory));
        }
        let memory = Self { kind: document.kind, state: document.state.0 };
        // CBOR has several ways to write some values, so a change may be none of the values.
        let again = memory.to_bytes().map_err(|error| error.to_string())?;
        if again != bytes {
            let same = again.iter().zip(bytes).take_while(|(own, found)| own == found).count();
            return Err(match memory.checksum() == document.checksum {
                true => format!("something else is in it from byte {same} on"),
                false => "its checksum is another one: it is damaged".into(),
            });
        }
        Ok(memory)
    }
}

/// Error of writing memories; the existing files are unchanged.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum MemoryError {
    /// The file can't be written.
    #[error("the memory of `{module}` can't be written to {}: {source}; it is as it was before this run", file.display())]
    #[diagnostic(help("{help}"))]
    File {
        /// The module.
        module: String,
        /// The file.
        file: PathBuf,
        /// Cause.
        source: io::Error,
        /// Remedy.
        help: &'static str,
    },
    /// No state, as the module has failed or is absent.
    #[error("`{module}` has failed or was unloaded, so its state was not saved: {} is as it was before this run", file.display())]
    #[diagnostic(help("look at the log for why it did"))]
    Lost {
        /// The module.
        module: String,
        /// The file.
        file: PathBuf,
    },
    /// The states can't be copied.
    #[error("the memory of the modules was not saved: {0}")]
    Unsaved(#[from] crate::snapshot::SnapshotError),
}

/// Returns the remedy for a memory that can't be written.
pub(crate) fn help(kind: io::ErrorKind) -> &'static str {
    match kind {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::FileTooLarge => {
            "make room on the disk, or name a file on another one"
        }
        io::ErrorKind::NotFound => "name a file in a folder that exists",
        io::ErrorKind::AlreadyExists => "wait for the other run that has this memory, or name another file",
        _ => "name a file in a folder that can be written to",
    }
}
