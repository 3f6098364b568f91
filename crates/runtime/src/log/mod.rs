//! One logger with several targets and a level per module.
//!
//! A tick formats into memory of its own; a thread of the logger writes to the targets, so no module ever waits for a
//! terminal or a disk. In lockstep nothing is lost and lines stand in the order of the modules; on the wall clock a
//! full buffer drops lines and counts them.

mod target;

use std::collections::BTreeMap;
use std::fmt;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use slate_module::{Host, Level};

pub use target::{ConsoleTarget, FileTarget, LogTarget, MemoryTarget};

/// A line of the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// The agent's time, nanoseconds.
    pub time: u64,
    /// How important.
    pub level: Level,
    /// Which module, or `agent`.
    pub module: Arc<str>,
    /// What happened.
    pub text: String,
}

impl fmt::Display for Record {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let level = match self.level {
            Level::Error => "error",
            Level::Warn => "warn ",
            Level::Info => "info ",
            Level::Debug => "debug",
            Level::Trace => "trace",
        };
        write!(f, "{:10.3} {level} {}: {}", self.time as f64 * 1e-9, self.module, self.text)
    }
}

/// What an agent logs with.
pub struct Logger {
    lines: Mutex<Option<SyncSender<Line>>>,
    thread: Mutex<Option<JoinHandle<()>>>,
    counts: Arc<Counts>,
    level: Level,
    levels: BTreeMap<String, Level>,
}

/// Lines so far.
#[derive(Default)]
struct Counts {
    sent: AtomicU64,
    written: AtomicU64,
    dropped: AtomicU64,
}

impl fmt::Debug for Logger {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Logger").field("level", &self.level).finish_non_exhaustive()
    }
}

/// A line on its way; text in place, so that sending it allocates nothing.
struct Line {
    time: u64,
    level: Level,
    module: Arc<str>,
    length: usize,
    text: [u8; 512],
}

impl Logger {
    /// A logger with those targets, the level of most modules, and levels of some.
    ///
    /// # Errors
    /// When its thread can't be started.
    pub fn new(
        targets: Vec<Box<dyn LogTarget>>,
        level: Level,
        levels: BTreeMap<String, Level>,
    ) -> std::io::Result<Self> {
        let (sender, receiver) = sync_channel(1024);
        let counts = Arc::new(Counts::default());
        let counter = Arc::clone(&counts);
        let thread = std::thread::Builder::new()
            .name("log".into())
            .spawn(move || write_lines(&receiver, targets, &counter))?;
        Ok(Self { lines: Mutex::new(Some(sender)), thread: Mutex::new(Some(thread)), counts, level, levels })
    }

    /// The level of a module.
    pub fn level(&self, module: &str) -> Level {
        self.levels.get(module).copied().unwrap_or(self.level)
    }

    /// Logs a line of the agent itself; it is dropped and counted when the targets are too slow.
    pub fn log(&self, time: u64, level: Level, text: &str) {
        if level <= self.level
            && let Some(lines) = self.sender()
        {
            self.counts.try_send(&lines, line(time, level, &Arc::from("agent"), text.as_bytes()));
        }
    }

    /// Waits until the targets have what was logged so far, but not longer than `limit`.
    pub fn flush(&self, limit: Duration) {
        let sent = self.counts.sent.load(Ordering::Acquire);
        let mut waited = Duration::ZERO;
        let has_ended = || {
            let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner);
            thread.as_ref().is_none_or(JoinHandle::is_finished)
        };
        while self.counts.written.load(Ordering::Acquire) < sent && waited < limit && !has_ended() {
            std::thread::sleep(LOOK);
            waited += LOOK;
        }
    }

    fn sender(&self) -> Option<SyncSender<Line>> {
        self.lines.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The log of a module; `lossless` waits for a full buffer rather than drop a line.
    pub(crate) fn module(&self, name: &Arc<str>, lossless: bool) -> Option<Box<ModuleLog>> {
        Some(Box::new(ModuleLog {
            lines: self.sender()?,
            counts: Arc::clone(&self.counts),
            module: Arc::clone(name),
            level: self.level(name),
            lossless,
            time: AtomicU64::new(0),
            holding: AtomicBool::new(false),
            held: Mutex::default(),
        }))
    }

    /// How many lines were dropped because the targets were too slow.
    pub fn dropped(&self) -> u64 {
        self.counts.dropped.load(Ordering::Relaxed)
    }
}

/// How often a flush looks whether it is done.
const LOOK: Duration = Duration::from_micros(500);

impl Counts {
    fn try_send(&self, lines: &SyncSender<Line>, line: Line) {
        match lines.try_send(line) {
            Ok(()) => self.sent.fetch_add(1, Ordering::Release),
            // The logger's thread lives as long as a sender, so the buffer is full.
            Err(_) => self.dropped.fetch_add(1, Ordering::Relaxed),
        };
    }
}

impl Drop for Logger {
    fn drop(&mut self) {
        // Modules that hang keep a sender of their own, so the thread is not waited for if any is left.
        *self.lines.lock().unwrap_or_else(PoisonError::into_inner) = None;
        if let Some(thread) = self.thread.lock().unwrap_or_else(PoisonError::into_inner).take()
            && Arc::strong_count(&self.counts) <= 2
        {
            // A target that panicked has lost its lines already.
            let _ = thread.join();
        }
    }
}

fn line(time: u64, level: Level, module: &Arc<str>, bytes: &[u8]) -> Line {
    let length = bytes.len().min(512);
    let mut text = [0; 512];
    text[..length].copy_from_slice(&bytes[..length]);
    Line { time, level, module: Arc::clone(module), length, text }
}

fn write_lines(lines: &Receiver<Line>, mut targets: Vec<Box<dyn LogTarget>>, counts: &Counts) {
    let mut reported = 0;
    while let Ok(line) = lines.recv() {
        let text = String::from_utf8_lossy(&line.text[..line.length]).into_owned();
        let record = Record { time: line.time, level: line.level, module: line.module, text };
        targets.iter_mut().for_each(|target| target.write(&record));
        let lost = counts.dropped.load(Ordering::Relaxed);
        if lost > reported {
            let text =
                format!("{} lines of the log were dropped, as its targets are too slow", lost - reported);
            reported = lost;
            let record = Record { time: record.time, level: Level::Warn, module: Arc::from("agent"), text };
            targets.iter_mut().for_each(|target| target.write(&record));
        }
        counts.written.fetch_add(1, Ordering::Release);
    }
}

/// The log of one module, as its frame's host knows it.
pub(crate) struct ModuleLog {
    lines: SyncSender<Line>,
    counts: Arc<Counts>,
    module: Arc<str>,
    level: Level,
    lossless: bool,
    time: AtomicU64,
    /// Whether lines are kept, as the step is made beside others; they follow when it is committed.
    holding: AtomicBool,
    held: Mutex<Vec<Line>>,
}

impl ModuleLog {
    /// What a frame points to.
    pub fn host(&self) -> Host {
        Host { context: std::ptr::from_ref(self).cast(), log: take }
    }

    /// The time that the next lines carry.
    pub fn set_time(&self, time: u64) {
        self.time.store(time, Ordering::Relaxed);
    }

    /// Writes a line.
    pub fn write(&self, level: Level, text: &str) {
        self.send(level, text.as_bytes());
    }

    /// Before a step that is made beside others: in lockstep, keeps lines until [`release`](ModuleLog::release), so
    /// that they stand in the order of the modules.
    pub fn hold(&self) {
        self.holding.store(true, Ordering::Relaxed);
    }

    /// Writes the lines of a step that was made beside others.
    pub fn release(&self) {
        if self.holding.swap(false, Ordering::Relaxed) {
            self.held
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .drain(..)
                .for_each(|line| self.pass_on(line));
        }
    }

    fn send(&self, level: Level, text: &[u8]) {
        if level > self.level {
            return;
        }
        let line = line(self.time.load(Ordering::Relaxed), level, &self.module, text);
        if self.lossless && self.holding.load(Ordering::Relaxed) {
            self.held.lock().unwrap_or_else(PoisonError::into_inner).push(line);
        } else {
            self.pass_on(line);
        }
    }

    fn pass_on(&self, line: Line) {
        if self.lossless {
            // The receiver ends only after all senders.
            if self.lines.send(line).is_ok() {
                self.counts.sent.fetch_add(1, Ordering::Release);
            }
        } else {
            self.counts.try_send(&self.lines, line);
        }
    }
}

unsafe extern "C" fn take(context: *const (), level: u32, text: *const u8, length: usize) {
    // SAFETY: the context is the `ModuleLog` that made the host, which the runner keeps beside it; the text lives
    // during the call.
    let (log, text) = unsafe { (&*context.cast::<ModuleLog>(), std::slice::from_raw_parts(text, length)) };
    let level = match level {
        0 => Level::Error,
        1 => Level::Warn,
        2 => Level::Info,
        3 => Level::Debug,
        _ => Level::Trace,
    };
    log.send(level, text);
}
