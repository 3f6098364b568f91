use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use slate_module::Level;
use slate_sorted::SortedMap;

use super::LogCounts;
use super::buffer::{ReceiveError, Receiver};
use super::repeat::{Repeats, WINDOW};
use super::source::{LogMessage, LogSource, SentLine};
use super::tail::Tail;
use super::{Counts, LogTarget, Record};

/// Wait for a line while a target still has work, before the target is called.
const BUSY_TIMEOUT: Duration = Duration::from_millis(20);

/// Wait for a line while no target has work: the window of repetitions.
/// So on the wall clock they are summed up at its end.
const IDLE_TIMEOUT: Duration = Duration::from_nanos(WINDOW);

/// Thread that writes to the targets.
pub(super) struct Thread {
    output: Output,
    repeats: Repeats,
    counts: Arc<Counts>,
    lockstep: bool,
    /// Modules that have logged, for reports of lines dropped since.
    sources: SortedMap<Arc<str>, Arc<LogSource>>,
    /// Time of the newest line, ns.
    time: u64,
}

impl Thread {
    pub fn new(
        targets: Vec<Box<dyn LogTarget>>,
        repeats: Repeats,
        counts: Arc<Counts>,
        lockstep: bool,
    ) -> Self {
        let output = Output { targets, tail: None, written: 0 };
        Self { output, repeats, counts, lockstep, sources: SortedMap::new(), time: 0 }
    }

    /// Handles messages until all senders were dropped.
    pub fn run(mut self, messages: &Receiver<LogMessage>) {
        let mut quiet = Duration::ZERO;
        let mut busy = false;
        loop {
            let timeout = if busy { BUSY_TIMEOUT } else { IDLE_TIMEOUT };
            match messages.receive(timeout) {
                Ok(message) => {
                    quiet = Duration::ZERO;
                    busy = true;
                    self.handle(message);
                    self.counts.written.fetch_add(1, Ordering::Release);
                }
                Err(ReceiveError::Timeout) => {
                    busy = self.output.idle();
                    quiet += timeout;
                    // In lockstep the wall clock must not decide where a line stands.
                    if quiet >= IDLE_TIMEOUT && !self.lockstep {
                        quiet = Duration::ZERO;
                        self.write_reports();
                    }
                }
                Err(ReceiveError::Disconnected) => break,
            }
        }
        self.write_reports();
    }

    fn handle(&mut self, message: LogMessage) {
        match message {
            LogMessage::Line(line) => self.line(line),
            LogMessage::Target(target) => self.output.targets.push(target),
            LogMessage::Tail(tail) => self.output.tail = Some(tail),
            LogMessage::Flush => self.write_reports(),
        }
        self.count();
    }

    fn line(&mut self, line: SentLine) {
        let (source, record) = line.into_record(&self.counts);
        self.time = self.time.max(record.time);
        if !self.sources.contains_key(&source.name) {
            self.sources.insert(Arc::clone(&source.name), source);
        }
        self.repeats.pass(record, &mut |record| self.output.write(record));
    }

    /// Writes the reports that would come with the next lines.
    fn write_reports(&mut self) {
        self.repeats.write_summaries(&mut |record| self.output.write(record));
        for source in self.sources.values() {
            let dropped = source.take_unreported();
            if dropped > 0 {
                let text = "lines of the log were dropped, as its targets are too slow";
                let record = Record { dropped, ..Record::new(self.time, Level::Warn, &source.name, text) };
                self.output.write(&record);
            }
        }
        self.count();
    }

    fn count(&mut self) {
        let dropped = self.counts.dropped.load(Ordering::Relaxed);
        let counts = LogCounts { written: self.output.written, dropped, suppressed: self.repeats.suppressed };
        if let Some(tail) = &mut self.output.tail {
            tail.count(counts, self.time);
        }
    }
}

/// Targets of the records.
struct Output {
    targets: Vec<Box<dyn LogTarget>>,
    tail: Option<Box<Tail>>,
    written: u64,
}

impl Output {
    fn write(&mut self, record: &Record) {
        self.write_to_all(record);
        let mut diagnostics = Vec::new();
        self.for_each_target(&mut |target| diagnostics.extend(target.diagnostic()));
        for text in diagnostics {
            self.report_diagnostic(record.time, &text);
        }
    }

    fn report_diagnostic(&mut self, time: u64, text: &str) {
        if self.targets.len() < 2 {
            // No other target would report it.
            print_error(text);
        }
        self.write_to_all(&Record::new(time, Level::Warn, &Arc::from("agent"), text));
    }

    fn write_to_all(&mut self, record: &Record) {
        self.written += 1;
        if let Some(tail) = &mut self.tail {
            tail.write(record);
        }
        let lost = self.for_each_target(&mut |target| target.write(record));
        for _ in 0..lost {
            self.report_diagnostic(record.time, "a target of the log panicked and gets no more lines");
        }
    }

    /// Calls the targets' `idle`; true if one has work left.
    fn idle(&mut self) -> bool {
        let mut busy = false;
        self.for_each_target(&mut |target| busy |= target.idle());
        busy
    }

    /// Calls all targets, and removes those that panic; returns their number.
    /// A target of the application that panics must not stop the others.
    fn for_each_target(&mut self, call: &mut dyn FnMut(&mut dyn LogTarget)) -> usize {
        let before = self.targets.len();
        self.targets.retain_mut(|target| catch_unwind(AssertUnwindSafe(|| call(target.as_mut()))).is_ok());
        before - self.targets.len()
    }
}

/// Writes to standard error, if there is one.
fn print_error(text: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "{text}");
}
