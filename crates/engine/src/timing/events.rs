//! File for Perfetto: Chrome's JSON trace events.

use std::io::{self, Write};

use super::json::{Microseconds, Quoted};
use super::span::Span;

/// Writes events one after the other, in any order of their times.
#[derive(Debug)]
pub(super) struct Events<W> {
    writer: W,
    /// Buffer of one event, so that the writer is called once for it.
    line: Vec<u8>,
}

impl<W: Write> Events<W> {
    /// Begins the file.
    pub fn begin(mut writer: W) -> io::Result<Self> {
        writer.write_all(b"{\"displayTimeUnit\":\"ns\",\"traceEvents\":[\n")?;
        write!(
            writer,
            "{{\"ph\":\"M\",\"pid\":1,\"tid\":0,\"name\":\"process_name\",\"args\":{{\"name\":\"slate\"}}}}"
        )?;
        Ok(Self { writer, line: Vec::with_capacity(256) })
    }

    /// Writes the name of a track.
    pub fn track(&mut self, track: usize, name: &str) -> io::Result<()> {
        write!(
            self.writer,
            ",\n{{\"ph\":\"M\",\"pid\":1,\"tid\":{track},\"name\":\"thread_name\",\"args\":{{\"name\":{}}}}}",
            Quoted(name)
        )
    }

    /// Writes a span; its label is a JSON string.
    pub fn span(&mut self, track: usize, label: &str, span: &Span) -> io::Result<()> {
        self.line.clear();
        write!(
            self.line,
            ",\n{{\"ph\":\"X\",\"pid\":1,\"tid\":{track},\"name\":{label},\"ts\":{},\"dur\":{},\"args\":{{\"cycle\":{}}}}}",
            Microseconds(span.start),
            Microseconds(span.duration),
            span.cycle
        )?;
        self.writer.write_all(&self.line)
    }

    /// Records that spans are missing until a time, ns, with their number if known.
    pub fn gap(&mut self, track: usize, until: u64, missing: Option<u64>) -> io::Result<()> {
        let count = missing.map_or(String::new(), |missing| format!("{missing} "));
        write!(
            self.writer,
            ",\n{{\"ph\":\"i\",\"s\":\"t\",\"pid\":1,\"tid\":{track},\"name\":\"{count}spans are missing until here\",\"ts\":{}}}",
            Microseconds(until)
        )
    }

    /// Flushes the writer.
    pub fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }

    /// Ends the file.
    pub fn end(mut self) -> io::Result<W> {
        self.writer.write_all(b"\n]}\n")?;
        self.writer.flush()?;
        Ok(self.writer)
    }
}
