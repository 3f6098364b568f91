use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use slate_module::Level;

use super::repeat::{Repeats, WINDOW};
use super::source::{Line, Message, Source};
use super::tail::{LogCounts, Tail};
use super::{Counts, LogTarget, Record};

/// How long the thread waits for a line before it looks after the targets, if one of them has something left to do.
const SOON: Duration = Duration::from_millis(20);

/// The same if none has: the window in which repetitions are counted, so that on the wall clock they are summed up
/// when it is over.
const LATER: Duration = Duration::from_nanos(WINDOW);

/// The thread that writes to the targets.
pub(super) struct Thread {
    pub targets: Vec<Box<dyn LogTarget>>,
    pub repeats: Repeats,
    pub counts: Arc<Counts>,
    pub lockstep: bool,
    tail: Option<Box<Tail>>,
    /// The modules that have logged, to ask them for lines dropped since.
    sources: BTreeMap<Arc<str>, Arc<Source>>,
    written: u64,
    /// The time of the newest line, nanoseconds.
    time: u64,
}

impl Thread {
    pub fn new(
        targets: Vec<Box<dyn LogTarget>>,
        repeats: Repeats,
        counts: Arc<Counts>,
        lockstep: bool,
    ) -> Self {
        let sources = BTreeMap::new();
        Self { targets, repeats, counts, lockstep, tail: None, sources, written: 0, time: 0 }
    }

    /// Takes what comes until nobody can send any more.
    pub fn run(mut self, messages: &Receiver<Message>) {
        let mut quiet = Duration::ZERO;
        let mut busy = false;
        loop {
            let patience = if busy { SOON } else { LATER };
            match messages.recv_timeout(patience) {
                Ok(message) => {
                    quiet = Duration::ZERO;
                    busy |= self.take(message);
                    self.counts.written.fetch_add(1, Ordering::Release);
                }
                Err(RecvTimeoutError::Timeout) => {
                    busy = self.targets.iter_mut().fold(false, |busy, target| target.idle() || busy);
                    quiet += patience;
                    // In lockstep the wall clock must not decide where a line stands.
                    if quiet >= LATER && !self.lockstep {
                        quiet = Duration::ZERO;
                        self.settle();
                    }
                }
                Err(RecvTimeoutError::Disconnected) => break,
            }
        }
        self.settle();
    }

    /// True when targets may have something left to do.
    fn take(&mut self, message: Message) -> bool {
        match message {
            Message::Line(line) => self.line(line),
            Message::Target(target) => self.targets.push(target),
            Message::Tail(tail) => self.tail = Some(tail),
            Message::Settle => self.settle(),
        }
        self.count();
        true
    }

    fn line(&mut self, line: Line) {
        let (source, record) = line.into_record(&self.counts);
        self.time = self.time.max(record.time);
        if !self.sources.contains_key(&source.name) {
            self.sources.insert(Arc::clone(&source.name), source);
        }
        let mut output =
            Output { targets: &mut self.targets, tail: &mut self.tail, written: &mut self.written };
        self.repeats.pass(record, &mut |record| output.write(record));
    }

    /// Writes what would come with the next lines.
    fn settle(&mut self) {
        let mut output =
            Output { targets: &mut self.targets, tail: &mut self.tail, written: &mut self.written };
        self.repeats.settle(&mut |record| output.write(record));
        for source in self.sources.values() {
            let dropped = source.take_untold();
            if dropped > 0 {
                let text = "lines of the log were dropped, as its targets are too slow";
                let record = Record { dropped, ..Record::new(self.time, Level::Warn, &source.name, text) };
                output.write(&record);
            }
        }
        self.count();
    }

    fn count(&mut self) {
        let dropped = self.counts.dropped.load(Ordering::Relaxed);
        let counts = LogCounts { written: self.written, dropped, suppressed: self.repeats.suppressed };
        if let Some(tail) = &mut self.tail {
            tail.count(counts, self.time);
        }
    }
}

/// Where records go.
struct Output<'a> {
    targets: &'a mut Vec<Box<dyn LogTarget>>,
    tail: &'a mut Option<Box<Tail>>,
    written: &'a mut u64,
}

impl Output<'_> {
    fn write(&mut self, record: &Record) {
        let mut complaints = self.pass_on(record);
        for target in self.targets.iter_mut() {
            complaints.extend(target.complaint());
        }
        for text in complaints {
            if self.targets.len() < 2 {
                // Nobody else would say it.
                say(&text);
            }
            self.pass_on(&Record::new(record.time, Level::Warn, &Arc::from("agent"), text));
        }
    }

    /// Returns complaints about targets that are no more.
    fn pass_on(&mut self, record: &Record) -> Vec<String> {
        *self.written += 1;
        if let Some(tail) = self.tail {
            tail.write(record);
        }
        let before = self.targets.len();
        self.targets.retain_mut(|target| {
            // A target of the application that panics must not take the others with it.
            catch_unwind(AssertUnwindSafe(|| target.write(record))).is_ok()
        });
        let lost = before - self.targets.len();
        (0..lost).map(|_| "a target of the log panicked and gets no more lines".into()).collect()
    }
}

/// Writes to standard error, if there is one.
fn say(text: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "{text}");
}
