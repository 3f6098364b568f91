use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// How much of a stop's reason is read back, bytes.
const REASON_LENGTH: u64 = 1024;

/// The software stop that all gates of an agent share.
///
/// A stop takes effect before any input or output, and so does not depend on a disk that is full or slow; then it
/// is written to a file, so that it survives a restart. Only [`reset`](Self::reset) ends it, and arms nothing.
/// Cloning gives another handle of the same latch.
#[derive(Clone, Debug)]
pub struct StopLatch {
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    /// Odd while stopped. It only grows, so that a gate which looks seldom sees a stop that came and went.
    word: AtomicU64,
    record: Mutex<Record>,
}

/// What is kept of a stop besides the flag. Its lock orders stops and resets; no gate takes it.
#[derive(Debug)]
struct Record {
    /// The file whose existence says that the agent is stopped.
    path: Option<PathBuf>,
    persisted: bool,
    reason: Option<String>,
}

impl StopLatch {
    /// A latch that is forgotten with the process, for simulation and tests.
    pub fn in_memory() -> Self {
        Self::with(Record { path: None, persisted: false, reason: None })
    }

    /// A latch that is kept in a file, whose folder is created if need be. It begins stopped if the file exists,
    /// whatever it holds: even a damaged one was written by a stop.
    ///
    /// # Errors
    /// When the folder can't be created, or it can't be told whether the file exists.
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

    /// Stops all gates, at once and first of all; then writes that to the file. While stopped, the first reason
    /// stays, and a file that could not be written is tried again.
    ///
    /// # Errors
    /// When the file can't be written: the agent is stopped, but would not be after a restart.
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

    /// Ends the stop. The gates stay disarmed: each needs an arming of its own.
    ///
    /// # Errors
    /// When the file can't be removed; the agent stays stopped then.
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
        // While stopped nobody but a reset changes the word, and resets hold the lock.
        self.shared.word.store(word.wrapping_add(1), Ordering::Release);
        Ok(())
    }

    /// Whether the agent is stopped.
    pub fn is_stopped(&self) -> bool {
        stopped(self.word())
    }

    /// Why the agent is stopped; nothing while it isn't. Waits for a stop or reset that is at work.
    pub fn reason(&self) -> Option<String> {
        self.record().reason.clone()
    }

    /// The state for a gate: another one each time the agent is stopped or reset.
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

/// Whether a latch's word says stopped.
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
