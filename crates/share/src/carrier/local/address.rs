//! Paths of sockets and their owners.

use std::fs::{self, DirBuilder};
use std::io::ErrorKind;
use std::os::unix::fs::{DirBuilderExt, FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};

use slate_runtime::directory::{Lock, folder};

use crate::carrier::CarrierError;

const EXPECTED_ENDPOINT: &str = "local:NAME (letters, digits, _ and -) or local:/a/path";

/// Returns the path of an endpoint's socket.
pub(super) fn path(endpoint: &str) -> Result<PathBuf, CarrierError> {
    let wrong = || CarrierError::NoEndpoint { endpoint: endpoint.into(), expected: EXPECTED_ENDPOINT };
    let name = endpoint.strip_prefix("local:").ok_or_else(wrong)?;
    if name.starts_with('/') {
        return Ok(name.into());
    }
    let is_name = |c: u8| c.is_ascii_alphanumeric() || c == b'_' || c == b'-';
    if name.is_empty() || !name.bytes().all(is_name) {
        return Err(wrong());
    }
    Ok(folder().join(format!("{name}.share")))
}

/// Path of a socket, locked against other listeners.
#[derive(Debug)]
pub(super) struct LocalAddress {
    path: PathBuf,
    /// Lock of the path; dropped last.
    _lock: Lock,
}

impl LocalAddress {
    /// Takes an endpoint; replaces the socket of an agent that was killed.
    pub fn take(endpoint: &str) -> Result<Self, CarrierError> {
        let path = path(endpoint)?;
        let system = |error| CarrierError::System { endpoint: endpoint.into(), error };
        let bad = |reason: String| CarrierError::Unsafe { endpoint: endpoint.into(), reason };
        if let Some(parent) = path.parent() {
            // A named folder must exist: a typing error must not create one.
            if parent == folder() {
                match DirBuilder::new().recursive(true).mode(0o700).create(parent) {
                    Err(error) if error.kind() != ErrorKind::AlreadyExists => return Err(system(error)),
                    _ => {}
                }
            } else if !parent.exists() {
                return Err(bad(format!("there is no folder {}", parent.display())));
            }
            // In a folder where others may write, they could put a socket of theirs in the place of this one.
            let found = fs::symlink_metadata(parent).map_err(system)?;
            let user = rustix::process::geteuid().as_raw();
            let others_write = found.mode() & 0o022 != 0 && found.mode() & 0o1000 == 0;
            if !found.is_dir() || others_write || found.uid() != user && found.mode() & 0o1000 == 0 {
                let reason =
                    format!("{} is not a folder that only its owner {user} writes to", parent.display());
                return Err(bad(reason));
            }
        }
        let mut lock = path.clone().into_os_string();
        lock.push(".lock");
        let lock = Path::new(&lock);
        let in_use = || CarrierError::InUse { endpoint: endpoint.into(), process: Lock::holder(lock) };
        let lock = Lock::take(lock).map_err(system)?.ok_or_else(in_use)?;
        match fs::symlink_metadata(&path) {
            Ok(found) if !found.file_type().is_socket() => {
                return Err(bad(format!("{} is there and no socket", path.display())));
            }
            // Its owner would hold the lock if it were alive.
            Ok(_) => fs::remove_file(&path).map_err(system)?,
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) => return Err(system(error)),
        }
        Ok(Self { path, _lock: lock })
    }

    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for LocalAddress {
    fn drop(&mut self) {
        // It may be removed already.
        let _ = fs::remove_file(&self.path);
    }
}
