//! Path of a line from a module to the logger's thread.

use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use slate_module::{Host, Level};

use super::buffer::Sender;
use super::tail::Tail;
use super::{Counts, LogTarget, Record};
use crate::clock::Clock;

/// Number of shared places in the buffer, for all modules beside their own.
pub(super) const SHARED_CAPACITY: u32 = 1024;

/// Maximum number of shared places that one module may take.
const MODULE_SHARE_LIMIT: u32 = SHARED_CAPACITY / 2;

/// Number of reserved places in the buffer for each module.
pub(super) const MODULE_CAPACITY: u32 = 8;

/// Message to the logger's thread.
#[allow(clippy::large_enum_variant, reason = "a line in a box would be an allocation of the tick")]
pub(super) enum LogMessage {
    Line(SentLine),
    Target(Box<dyn LogTarget>),
    Tail(Box<Tail>),
    /// Write all there is to write.
    Flush,
}

/// Line in the buffer; its text is in place, so that sending it allocates nothing.
pub(super) struct SentLine {
    time: u64,
    level: Level,
    source: Arc<LogSource>,
    dropped: u64,
    slot: BufferSlot,
    length: usize,
    text: [u8; 512],
}

/// Kind of the place that a line takes in the buffer.
#[derive(Clone, Copy, PartialEq, Eq)]
enum BufferSlot {
    /// Any: the module waits for one.
    Any,
    Reserved,
    Shared,
}

/// Module as a source of lines, shared with the logger's thread.
pub(super) struct LogSource {
    pub name: Arc<str>,
    level: AtomicU32,
    /// Lines in the buffer.
    waiting: AtomicU32,
    /// Lines dropped since the last one that was not.
    unreported: AtomicU64,
    dropped: AtomicU64,
}

impl LogSource {
    pub fn new(name: &Arc<str>, level: Level) -> Self {
        Self {
            name: Arc::clone(name),
            level: AtomicU32::new(level as u32),
            waiting: AtomicU32::new(0),
            unreported: AtomicU64::new(0),
            dropped: AtomicU64::new(0),
        }
    }

    pub fn set_level(&self, level: Level) {
        self.level.store(level as u32, Ordering::Relaxed);
    }

    /// Returns the number of dropped lines.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// Takes the number of dropped lines that no line has reported yet.
    pub fn take_unreported(&self) -> u64 {
        self.unreported.swap(0, Ordering::Relaxed)
    }

    fn includes(&self, level: Level) -> bool {
        level as u32 <= self.level.load(Ordering::Relaxed)
    }

    /// Takes a place in the buffer: a reserved one, else a shared one.
    /// `None` if those are all taken.
    fn take_slot(&self, counts: &Counts) -> Option<BufferSlot> {
        let waiting = self.waiting.fetch_add(1, Ordering::Relaxed);
        if waiting < MODULE_CAPACITY {
            return Some(BufferSlot::Reserved);
        }
        if waiting < MODULE_CAPACITY + MODULE_SHARE_LIMIT {
            if counts.shared.fetch_add(1, Ordering::Relaxed) < SHARED_CAPACITY {
                return Some(BufferSlot::Shared);
            }
            counts.shared.fetch_sub(1, Ordering::Relaxed);
        }
        self.waiting.fetch_sub(1, Ordering::Relaxed);
        None
    }

    fn free_slot(&self, slot: BufferSlot, counts: &Counts) {
        if slot != BufferSlot::Any {
            self.waiting.fetch_sub(1, Ordering::Relaxed);
        }
        if slot == BufferSlot::Shared {
            counts.shared.fetch_sub(1, Ordering::Relaxed);
        }
    }

    fn drop_line(&self, reported: u64, counts: &Counts) {
        self.unreported.fetch_add(reported + 1, Ordering::Relaxed);
        self.dropped.fetch_add(1, Ordering::Relaxed);
        counts.dropped.fetch_add(1, Ordering::Relaxed);
    }
}

impl SentLine {
    /// Converts the line to a record for the targets; frees its place in the buffer.
    pub fn into_record(self, counts: &Counts) -> (Arc<LogSource>, Record) {
        self.source.free_slot(self.slot, counts);
        let text = String::from_utf8_lossy(&self.text[..self.length]);
        let mut record = Record::from_message(self.time, self.level, &self.source.name, &text);
        record.dropped = self.dropped;
        (self.source, record)
    }
}

/// Value for no time stamp.
const NO_TIME_STAMP: u64 = u64::MAX;

/// Log of one module, to which its frame's host points.
pub struct ModuleLog {
    lines: Sender<LogMessage>,
    counts: Arc<Counts>,
    source: Arc<LogSource>,
    lossless: bool,
    /// Clock of the time stamps; `None` for callers that set them.
    clock: Option<Arc<Clock>>,
    /// Time stamp of the lines, ns; [`NO_TIME_STAMP`] for the present time.
    time: AtomicU64,
    /// True while lines are held, as the step runs beside others.
    /// They follow when it is committed.
    is_holding: AtomicBool,
    held: Mutex<Vec<SentLine>>,
}

/// Suffix of a truncated line.
/// A character that is cut before it is shown as an unknown one.
const TRUNCATION_MARK: &[u8] = b" ...";

impl ModuleLog {
    /// Returns the log of a module.
    /// A `lossless` one waits for a full buffer rather than drop a line.
    pub(super) fn new(
        lines: Sender<LogMessage>,
        counts: Arc<Counts>,
        source: Arc<LogSource>,
        lossless: bool,
        clock: Option<Arc<Clock>>,
    ) -> Self {
        Self {
            lines,
            counts,
            source,
            lossless,
            clock,
            time: AtomicU64::new(NO_TIME_STAMP),
            is_holding: AtomicBool::new(false),
            held: Mutex::default(),
        }
    }

    /// Returns the host to which a frame points.
    pub fn host(&self) -> Host {
        Host { context: std::ptr::from_ref(self).cast(), log: receive_line }
    }

    /// Sets the time stamp of the next lines, ns, for steps run later than planned.
    pub fn set_time(&self, time: u64) {
        self.time.store(time, Ordering::Relaxed);
    }

    /// Writes a line.
    pub fn write(&self, level: Level, text: &str) {
        self.write_now(level, text.as_bytes());
    }

    fn write_now(&self, level: Level, bytes: &[u8]) {
        let time = match self.time.load(Ordering::Relaxed) {
            NO_TIME_STAMP => self.clock.as_ref().map_or(0, |clock| clock.now()),
            time => time,
        };
        self.write_at(time, level, bytes);
    }

    /// Begins a step that runs beside others.
    /// In lockstep, keeps lines until [`release`](ModuleLog::release), so that they follow the order of the modules.
    pub fn hold(&self) {
        self.is_holding.store(true, Ordering::Relaxed);
    }

    /// Writes the lines of a step that was made beside others.
    pub fn release(&self) {
        if self.is_holding.swap(false, Ordering::Relaxed) {
            self.held
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .drain(..)
                .for_each(|line| self.forward(line));
        }
    }

    pub(super) fn write_at(&self, time: u64, level: Level, bytes: &[u8]) {
        if !self.source.includes(level) {
            return;
        }
        let length = bytes.len().min(512);
        let mut text = [0; 512];
        text[..length].copy_from_slice(&bytes[..length]);
        if length < bytes.len() {
            // A reader must see that the line was truncated.
            text[length - TRUNCATION_MARK.len()..].copy_from_slice(TRUNCATION_MARK);
        }
        let source = Arc::clone(&self.source);
        let line = SentLine { time, level, source, dropped: 0, slot: BufferSlot::Any, length, text };
        if self.lossless && self.is_holding.load(Ordering::Relaxed) {
            self.held.lock().unwrap_or_else(PoisonError::into_inner).push(line);
        } else {
            self.forward(line);
        }
    }

    fn forward(&self, mut line: SentLine) {
        if self.lossless {
            if self.lines.send(LogMessage::Line(line)) {
                self.counts.sent.fetch_add(1, Ordering::Release);
            }
            return;
        }
        let Some(slot) = self.source.take_slot(&self.counts) else {
            return self.source.drop_line(0, &self.counts);
        };
        line.slot = slot;
        line.dropped = self.source.unreported.swap(0, Ordering::Relaxed);
        let reported = line.dropped;
        if self.lines.try_send(LogMessage::Line(line)).is_ok() {
            self.counts.sent.fetch_add(1, Ordering::Release);
        } else {
            // More modules have come than the buffer was made for.
            self.source.free_slot(slot, &self.counts);
            self.source.drop_line(reported, &self.counts);
        }
    }
}

unsafe extern "C" fn receive_line(context: *const (), level: u32, text: *const u8, length: usize) {
    // SAFETY: the context is the `ModuleLog` that made the host, which the runner keeps beside it.
    let log = unsafe { &*context.cast::<ModuleLog>() };
    let text = match length {
        // A plugin in C may say nothing with a null pointer.
        0 => &[],
        // SAFETY: the text lives during the call.
        length => unsafe { std::slice::from_raw_parts(text, length) },
    };
    log.write_now(Level::from_number(level), text);
}
