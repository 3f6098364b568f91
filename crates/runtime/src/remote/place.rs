//! Where the sockets are, and whose they are.

use std::fs::{self, DirBuilder, File, TryLockError};
use std::io::{Error, ErrorKind, Result};
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

/// How many agents of one name there may be.
const MOST: u32 = 100;

/// The folder of this user's sockets; it need not be there.
fn folder() -> PathBuf {
    let runtime = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from).filter(|path| path.is_absolute());
    let user = rustix::process::geteuid().as_raw();
    runtime.map_or_else(|| std::env::temp_dir().join(format!("slate-{user}")), |path| path.join("slate"))
}

/// The folder, if it is there; nobody else could have made it or looks into it.
fn safe_folder() -> Result<PathBuf> {
    let folder = folder();
    // What a link leads to could be exchanged.
    let metadata = fs::symlink_metadata(&folder)?;
    let user = rustix::process::geteuid().as_raw();
    if metadata.is_dir() && metadata.uid() == user && metadata.mode() & 0o077 == 0 {
        return Ok(folder);
    }
    let message =
        format!("{} is not a folder that only its owner {user} may enter", crate::printable(&folder));
    Err(Error::new(ErrorKind::PermissionDenied, message))
}

/// The socket of that agent.
pub(super) fn socket(name: &str) -> Result<PathBuf> {
    Ok(safe_folder()?.join(format!("{name}.sock")))
}

/// The agents of this user that run, by the names under which they are reached.
pub fn agents() -> Vec<String> {
    let entries = safe_folder().and_then(fs::read_dir).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries
        .filter_map(|entry| entry.file_name().to_str()?.strip_suffix(".sock").map(str::to_owned))
        // One that nobody listens at was left by an agent that was killed.
        .filter(|name| socket(name).is_ok_and(|socket| UnixStream::connect(socket).is_ok()))
        .collect();
    names.sort();
    names
}

/// A socket that is bound, and a name that nobody else takes as long as this lives.
pub(super) struct Place {
    pub name: String,
    pub socket: PathBuf,
    lock: PathBuf,
    /// The system ends a lock with its process, however that dies.
    _locked: File,
}

impl Place {
    /// Binds the socket of an agent, or of the first free number behind its name. What an agent left that was killed
    /// makes room.
    pub fn take(agent: &str) -> Result<(Self, UnixListener)> {
        let folder = folder();
        match DirBuilder::new().recursive(true).mode(0o700).create(&folder) {
            Err(error) if error.kind() != ErrorKind::AlreadyExists => return Err(error),
            _ => safe_folder()?,
        };
        for number in 1..=MOST {
            let name = if number == 1 { agent.to_owned() } else { format!("{agent}-{number}") };
            let lock = folder.join(format!("{name}.lock"));
            let Some(locked) = lock_file(&lock)? else { continue };
            let socket = folder.join(format!("{name}.sock"));
            match fs::remove_file(&socket) {
                Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
                _ => {}
            }
            let listener = UnixListener::bind(&socket)?;
            return Ok((Self { name, socket, lock, _locked: locked }, listener));
        }
        Err(Error::new(ErrorKind::AddrInUse, format!("there are {MOST} agents called `{agent}` already")))
    }
}

/// Locks a file, which is made; nothing when somebody else has locked it.
fn lock_file(path: &Path) -> Result<Option<File>> {
    loop {
        let file = File::options().create(true).truncate(false).write(true).open(path)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Ok(None),
            Err(TryLockError::Error(error)) => return Err(error),
        }
        // Its last owner may have removed it since it was opened, and then it locks nothing.
        let found = fs::metadata(path).map(|found| found.ino());
        if found.is_ok_and(|found| file.metadata().is_ok_and(|own| own.ino() == found)) {
            return Ok(Some(file));
        }
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        // Who removed them before did the same; the lock goes last.
        let _ = fs::remove_file(&self.socket);
        let _ = fs::remove_file(&self.lock);
    }
}
