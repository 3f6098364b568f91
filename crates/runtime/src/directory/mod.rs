//! Directory of this user's agents: one socket per agent, named after it.
//!
//! The folder is `$XDG_RUNTIME_DIR/slate`, or `slate-<uid>` among the temporary files without that variable. Only its owner may
//! enter it.

mod lock;

use std::fs::{self, DirBuilder};
use std::io::{Error, ErrorKind, Result};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

use rustix::fs::{Access, access};

use crate::stop_line;
pub use lock::Lock;

/// Most agents of one name.
const MAX_SAME_NAME: u32 = 100;

/// Returns the folder of this user's sockets; it may not exist.
pub fn folder() -> PathBuf {
    let runtime = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from).filter(|path| path.is_absolute());
    let user = rustix::process::geteuid().as_raw();
    runtime.map_or_else(|| std::env::temp_dir().join(format!("slate-{user}")), |path| path.join("slate"))
}

/// Returns the folder if it exists and is private to this user.
fn safe_folder() -> Result<PathBuf> {
    let folder = folder();
    // The target of a symbolic link could be exchanged.
    let metadata = fs::symlink_metadata(&folder)?;
    let user = rustix::process::geteuid().as_raw();
    if metadata.is_dir() && metadata.uid() == user && metadata.mode() & 0o077 == 0 {
        return Ok(folder);
    }
    let message = format!(
        "{} is not a folder that only its owner {user} may enter",
        slate_configuration::printable(&folder)
    );
    Err(Error::new(ErrorKind::PermissionDenied, message))
}

/// Returns the socket of an agent.
///
/// # Errors
/// When the folder is missing or not private.
pub fn socket(name: &str) -> Result<PathBuf> {
    Ok(safe_folder()?.join(format!("{name}.sock")))
}

/// Returns the running agents of this user, by their socket names.
pub fn agents() -> Vec<String> {
    let entries = safe_folder().and_then(fs::read_dir).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries
        .filter_map(|entry| entry.file_name().to_str()?.strip_suffix(".sock").map(str::to_owned))
        // A socket without a listener was left by a killed agent.
        .filter(|name| {
            let is_there =
                |socket: PathBuf| stop_line::is_there(&socket) || UnixStream::connect(socket).is_ok();
            socket(name).is_ok_and(is_there)
        })
        .collect();
    names.sort();
    names
}

/// The longest path of a socket, bytes.
const LONGEST: usize = 107;

/// Checks that tools could reach an agent of that name; creates nothing.
///
/// # Errors
/// The obstacle, such as a folder that can't be written to.
pub fn check_reach(agent: &str) -> Result<()> {
    let folder = folder();
    check_length(&folder, agent)?;
    if folder.exists() {
        safe_folder()?;
    }
    let there = folder.ancestors().find(|place| place.exists()).unwrap_or(&folder);
    access(there, Access::WRITE_OK | Access::EXEC_OK).map_err(|error| {
        let error = Error::from(error);
        Error::new(
            error.kind(),
            format!("{} can't be written to: {error}", slate_configuration::printable(there)),
        )
    })
}

fn check_length(folder: &Path, agent: &str) -> Result<()> {
    // Another one of that name gets a number.
    let length = folder.join(format!("{agent}-{MAX_SAME_NAME}.sock")).as_os_str().len();
    if length <= LONGEST {
        return Ok(());
    }
    let message = format!(
        "the path of its socket in {} would have {length} bytes, and {LONGEST} is the most",
        slate_configuration::printable(folder)
    );
    Err(Error::new(ErrorKind::InvalidInput, message))
}

/// Bound socket and its name, reserved until this is dropped.
#[derive(Debug)]
pub struct AgentSocket {
    name: String,
    socket: PathBuf,
    /// Dropped last.
    _lock: Lock,
}

impl AgentSocket {
    /// The name under which the agent is reached.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The path of the socket.
    pub fn socket(&self) -> &Path {
        &self.socket
    }

    /// Binds the socket of an agent, mode 0600; returns it with its listener.
    /// If the name is taken, the first free number is appended. The socket of a killed agent is replaced.
    ///
    /// # Errors
    /// When the folder is not private, or the socket can't be made.
    pub fn take(agent: &str) -> Result<(Self, UnixListener)> {
        let folder = folder();
        check_length(&folder, agent)?;
        match DirBuilder::new().recursive(true).mode(0o700).create(&folder) {
            Err(error) if error.kind() != ErrorKind::AlreadyExists => return Err(error),
            _ => safe_folder()?,
        };
        for number in 1..=MAX_SAME_NAME {
            let name = if number == 1 { agent.to_owned() } else { format!("{agent}-{number}") };
            let Some(lock) = Lock::take(&folder.join(format!("{name}.lock")))? else { continue };
            let socket = folder.join(format!("{name}.sock"));
            match fs::remove_file(&socket) {
                Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
                _ => {}
            }
            let listener = UnixListener::bind(&socket)?;
            fs::set_permissions(&socket, fs::Permissions::from_mode(0o600))?;
            return Ok((Self { name, socket, _lock: lock }, listener));
        }
        Err(Error::new(ErrorKind::AddrInUse, format!("{MAX_SAME_NAME} agents are already called `{agent}`")))
    }
}

impl Drop for AgentSocket {
    fn drop(&mut self) {
        // Another process may have removed it already.
        let _ = fs::remove_file(&self.socket);
    }
}
