//! Copies of libraries, and removal of those of killed processes.

use std::fs::{self, DirBuilder, File, Metadata};
use std::io::{self, BufRead, BufReader, ErrorKind};
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::sync::Once;
use std::sync::atomic::{AtomicU64, Ordering};

use xxhash_rust::xxh3::Xxh3Default;

/// Copy of a file in a folder of its own, so that debuggers find its name.
/// It is removed on drop.
#[derive(Debug)]
pub(super) struct PrivateCopy {
    folder: PathBuf,
    file: PathBuf,
    /// Locked folder, so that it is not removed while this process lives.
    _lock: File,
}

/// Counts copies.
static COPIES: AtomicU64 = AtomicU64::new(1);

/// Removal of old copies, once before the first copy.
static STALE_REMOVAL: Once = Once::new();

impl PrivateCopy {
    /// Copies the file.
    ///
    /// # Errors
    /// When there is no room for it, or it can't be read.
    pub fn create(file: &Path) -> io::Result<Self> {
        let temporary_folder = std::env::temp_dir();
        STALE_REMOVAL.call_once(|| remove_stale(&temporary_folder));
        loop {
            let number = COPIES.fetch_add(1, Ordering::Relaxed);
            let folder = temporary_folder.join(format!("slate-{}-{number}", std::process::id()));
            match DirBuilder::new().mode(0o700).create(&folder) {
                Ok(()) => {}
                // Of a process that had this number before, or of another user.
                Err(error) if error.kind() == ErrorKind::AlreadyExists => continue,
                Err(error) => return Err(error),
            }
            let opened = File::open(&folder).and_then(|lock| lock.lock().map(|()| lock));
            let lock = match opened {
                Ok(lock) if is_at(&lock, &folder) => lock,
                // Swept before it was locked.
                Ok(_) => continue,
                Err(error) if error.kind() == ErrorKind::NotFound => continue,
                Err(error) => return Err(error),
            };
            let name = file.file_name().unwrap_or("plugin.so".as_ref());
            let copy = Self { file: folder.join(name), folder, _lock: lock };
            fs::copy(file, &copy.file)?;
            return Ok(copy);
        }
    }

    /// Returns the path of the copy.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Returns a hash of the copy.
    ///
    /// # Errors
    /// When it can't be read.
    pub fn hash(&self) -> io::Result<u64> {
        let mut file = BufReader::with_capacity(1 << 18, File::open(&self.file)?);
        let mut hash = Xxh3Default::new();
        loop {
            let part = file.fill_buf()?;
            if part.is_empty() {
                return Ok(hash.digest());
            }
            hash.update(part);
            let length = part.len();
            file.consume(length);
        }
    }
}

impl Drop for PrivateCopy {
    fn drop(&mut self) {
        // A remaining file is in a temporary folder.
        let _ = fs::remove_file(&self.file);
        let _ = fs::remove_dir(&self.folder);
    }
}

/// Returns true if an open folder is still at that path.
fn is_at(open: &File, path: &Path) -> bool {
    let same = |own: Metadata, found: Metadata| own.dev() == found.dev() && own.ino() == found.ino();
    open.metadata().ok().zip(fs::symlink_metadata(path).ok()).is_some_and(|(own, found)| same(own, found))
}

/// Removes the copies of this user's processes that were killed.
/// Their folders are not locked, which also holds for processes in containers, and no process has their number, as
/// agents of older versions lock nothing.
fn remove_stale(temporary_folder: &Path) {
    let Ok(entries) = fs::read_dir(temporary_folder) else { return };
    let user = rustix::process::geteuid().as_raw();
    let is_stale = |name: &str| process_of(name).is_some_and(|id| !Path::new("/proc").join(id).exists());
    for entry in entries.flatten().filter(|entry| entry.file_name().to_str().is_some_and(is_stale)) {
        let path = entry.path();
        let own = fs::symlink_metadata(&path).is_ok_and(|found| found.is_dir() && found.uid() == user);
        let Some(folder) = own.then(|| File::open(&path).ok()).flatten() else { continue };
        if folder.try_lock().is_ok() && is_at(&folder, &path) {
            // A remaining file is left to the next process.
            let _ = fs::remove_dir_all(&path);
        }
    }
}

/// Returns the id of the process that owns a folder, from the folder's name.
/// `None` for other folders.
fn process_of(name: &str) -> Option<&str> {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let (process, number) = name.strip_prefix("slate-")?.split_once('-')?;
    (is_number(process) && is_number(number)).then_some(process)
}
