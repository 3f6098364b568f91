use slate_blackboard::channel::{Budget, Writer};
use slate_blackboard::interface::View;
use slate_blackboard::{Access, Board, BoardError, Store};
use slate_module::{Interface, Level, Text, interface};

use super::Record;

/// A line of the log: `/log/tail`, which keeps the last 256.
#[interface]
pub struct LogLine {
    /// The agent's time.
    #[unit("ns")]
    pub time: u64,
    /// How many lines of the same module were dropped right before this one.
    pub dropped: u64,
    /// How important.
    pub level: LogLevel,
    /// Not used.
    pub reserved: [u8; 7],
    /// Which module, or `agent`.
    pub module: Text<64>,
    /// What happened, with its fields.
    pub text: Text<512>,
}

/// How important a line of the log is.
#[interface]
pub enum LogLevel {
    /// Something is broken.
    Error,
    /// Something is wrong but the robot goes on.
    Warn,
    /// What a user wants to know.
    Info,
    /// What a developer wants to know.
    Debug,
    /// Everything.
    Trace,
}

/// What became of the lines of the log: `/log/counts`.
#[interface]
#[derive(PartialEq)]
pub struct LogCounts {
    /// Lines that the targets got.
    pub written: u64,
    /// Lines dropped because the targets were too slow.
    pub dropped: u64,
    /// Lines summed up as repetitions.
    pub suppressed: u64,
}

/// How many lines a late reader still sees.
const DEPTH: usize = 256;

/// The log as properties, written by the logger's thread.
///
/// What a module reads must not depend on how fast that thread is, so nothing can be linked to them.
pub(super) struct Tail {
    lines: Writer,
    counts: Writer,
    last: LogCounts,
}

impl Tail {
    /// Adds the properties.
    ///
    /// # Errors
    /// When a module has one of that name.
    pub fn new(board: &Board) -> Result<Self, BoardError> {
        let writer = |path, doc, descriptor, depth| {
            let store = Store { capacity: 0, depth, budget: Budget { latest: 8, queues: 8, window: 16 } };
            let property = board.add_channel(path, doc, descriptor, store, Access::Output)?;
            let writer = property.channel().and_then(|channel| channel.writer().ok());
            writer.ok_or_else(|| BoardError::Exists { url: format!("/{path}") })
        };
        Ok(Self {
            lines: writer("log/tail", "The last lines of the log.", LogLine::DESCRIPTOR, DEPTH)?,
            counts: writer("log/counts", "What became of the lines of the log.", LogCounts::DESCRIPTOR, 1)?,
            last: LogCounts { written: 0, dropped: 0, suppressed: 0 },
        })
    }

    pub fn write(&mut self, record: &Record) {
        let level = match record.level {
            Level::Error => LogLevel::ERROR,
            Level::Warn => LogLevel::WARN,
            Level::Info => LogLevel::INFO,
            Level::Debug => LogLevel::DEBUG,
            Level::Trace => LogLevel::TRACE,
        };
        let line = LogLine {
            time: record.time,
            dropped: record.dropped,
            level,
            reserved: [0; 7],
            module: Text::new(&record.module),
            text: Text::new(&record.message()),
        };
        // A recorder that must see every value misses a line rather than hold up the log.
        let _ = self.lines.write(View::of(&line).bytes(), 0, record.time);
    }

    pub fn count(&mut self, counts: LogCounts, time: u64) {
        if counts != self.last {
            self.last = counts;
            // As above; the next count tells the same.
            let _ = self.counts.write(View::of(&counts).bytes(), 0, time);
        }
    }
}
