use slate_blackboard::channel::{Budget, Writer};
use slate_blackboard::interface::View;
use slate_blackboard::{Access, Board, BoardError, Store};
use slate_composition::own::{LogCounts, LogLevel, LogLine};
use slate_module::{Interface, Level, Text};

use super::Record;

/// Number of lines kept for a late reader.
const DEPTH: usize = 256;

/// Properties of the log, written by the logger's thread.
///
/// Nothing can be linked to them, as a module's inputs must not depend on the speed of that thread.
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
            counts: writer("log/counts", "Written, dropped and suppressed lines.", LogCounts::DESCRIPTOR, 1)?,
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
        let mut line = LogLine {
            time: record.time,
            dropped: record.dropped,
            level,
            module: Text::new(&record.module),
            text: Text::new(&record.message()),
        };
        // A recorder that must see every value misses a line rather than hold up the log.
        let _ = self.lines.write(View::of(&mut line).bytes(), 0, record.time);
    }

    pub fn count(&mut self, mut counts: LogCounts, time: u64) {
        if counts != self.last {
            self.last = counts;
            // As above; the next count tells the same.
            let _ = self.counts.write(View::of(&mut counts).bytes(), 0, time);
        }
    }
}
