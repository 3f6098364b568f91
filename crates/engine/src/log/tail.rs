use slate_blackboard::channel::Writer;
use slate_blackboard::interface::View;
use slate_blackboard::{Access, Board, BoardError};
use slate_composition::Host;
use slate_composition::own::{LogCounts, LogLevel, LogLine};
use slate_module::{Level, Text};

use super::Record;

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
        let writer = |own: Host, doc| {
            let path = own.path();
            let property = board.add_channel(path, doc, own.descriptor(), own.store(), Access::Output)?;
            let writer = property.channel().and_then(|channel| channel.writer().ok());
            writer.ok_or_else(|| BoardError::Exists { url: format!("/{path}") })
        };
        Ok(Self {
            lines: writer(Host::LogTail, "The last lines of the log.")?,
            counts: writer(Host::LogCounts, "Written, dropped and suppressed lines.")?,
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
