use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Maximum length of a stop's reason in the file, bytes.
const REASON_LENGTH: u64 = 1024;

/// Software stop of all gates of an agent.
///
/// A stop takes effect before any input or output, then is written to a file, so that it survives a restart. Only
/// [`reset`](Self::reset) ends it, and arms nothing. Clones are handles of the same latch.
#[derive(Clone, Debug)]
pub struct StopLatch {
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    /// Stop counter, odd while stopped.
    /// It only grows, so that a gate which looks seldom sees a stop that came and went.
    word: AtomicU64,
    record: Mutex<Record>,
}

/// Record of a stop besides the flag.
/// Its lock orders stops and resets; no gate takes it.
#[derive(Debug)]
struct Record {
    /// File that exists while the agent is stopped.
    path: Option<PathBuf>,
    persisted: bool,
    reason: Option<String>,
}

impl StopLatch {
    /// Returns a latch without a file, for simulation and tests.
    pub fn in_memory() -> Self {
        Self::with(Record { path: None, persisted: false, reason: None })
    }

    /// Returns a latch with a file; creates its folder.
    ///
    /// It is stopped initially if the file exists, even a damaged one.
    ///
    /// # Errors
    /// If the folder can't be created, or the file can't be examined.
    pub fn open(path: impl Into<PathBuf>) -> io::Result<Self> {
        let path = path.into();
        fs::create_dir_all(folder(&path))?;
        // A broken symbolic link exists too.
        let reason = match fs::symlink_metadata(&path) {
            Ok(_) => Some(read_reason(&path)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return Err(error),
        };
        Ok(Self::with(Record { path: Some(path), persisted: reason.is_some(), reason }))
    }

    fn with(record: Record) -> Self {
        let word = AtomicU64::new(record.persisted.into());
        Self { shared: Arc::new(Shared { word, record: Mutex::new(record) }) }
    }

    /// Stops all gates, then writes the file.
    ///
    /// While stopped, the first reason stays, and a failed write is retried.
    ///
    /// # Errors
    /// If the file can't be written: the agent is stopped, but not after a restart.
    pub fn stop(&self, reason: &str) -> io::Result<()> {
        self.raise();
        let mut record = self.record();
        // A reset may have run between; of the two the stop wins.
        self.raise();
        record.reason.get_or_insert_with(|| reason.into());
        let Record { path: Some(path), persisted: false, reason } = &*record else { return Ok(()) };
        persist(path, reason.as_deref().unwrap_or_default())?;
        record.persisted = true;
        Ok(())
    }

    /// Ends the stop; the gates stay disarmed.
    ///
    /// # Errors
    /// If the file can't be removed: the agent stays stopped.
    pub fn reset(&self) -> io::Result<()> {
        let mut record = self.record();
        let word = self.word();
        if !stopped(word) {
            return Ok(());
        }
        // Even after a failed write there may be a file.
        if let Some(path) = &record.path
            && let Err(error) = fs::remove_file(path)
            && error.kind() != io::ErrorKind::NotFound
        {
            return Err(error);
        }
        record.persisted = false;
        record.reason = None;
        // While stopped only a reset changes the word, and resets hold the lock.
        self.shared.word.store(word.wrapping_add(1), Ordering::Release);
        Ok(())
    }

    /// Returns whether the agent is stopped.
    pub fn is_stopped(&self) -> bool {
        stopped(self.word())
    }

    /// Returns the reason of the stop. Waits for a stop or reset in progress.
    pub fn reason(&self) -> Option<String> {
        self.record().reason.clone()
    }

    /// Returns a state that changes with each stop and reset.
    pub(crate) fn word(&self) -> u64 {
        self.shared.word.load(Ordering::Acquire)
    }

    fn raise(&self) {
        self.shared.word.fetch_or(1, Ordering::AcqRel);
    }

    fn record(&self) -> MutexGuard<'_, Record> {
        // The record is consistent after each line that changes it, also where a thread died.
        self.shared.record.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Returns whether a latch's word means stopped.
pub(crate) fn stopped(word: u64) -> bool {
    word & 1 == 1
}

fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

fn persist(path: &Path, reason: &str) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(reason.as_bytes())?;
    file.sync_all()?;
    // A new file survives a power failure only when its folder was written too.
    #[cfg(unix)]
    File::open(folder(path))?.sync_all()?;
    Ok(())
}

fn read_reason(path: &Path) -> String {
    let mut bytes = Vec::new();
    // Only a regular file is read: a pipe could wait for ever. The reason is for people; a stop needs none.
    if fs::metadata(path).is_ok_and(|metadata| metadata.is_file())
        && let Ok(file) = File::open(path)
        && file.take(REASON_LENGTH).read_to_end(&mut bytes).is_err()
    {
        bytes.clear();
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
