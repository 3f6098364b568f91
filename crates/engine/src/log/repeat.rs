use std::collections::VecDeque;
use std::sync::Arc;

use slate_module::Level;
use slate_sorted::{SortedMap, SortedSet};

use super::Record;

/// Window in which repetitions of a message are counted, ns of the agent's time.
pub(super) const WINDOW: u64 = 1_000_000_000;

/// Maximum number of different messages remembered.
/// Beyond that, the oldest is dropped before its window ends.
const MESSAGE_LIMIT: usize = 4096;

/// Sums up messages that are repeated too often.
///
/// It looks at the times of the lines alone, so that in lockstep the same lines come out in every run.
pub(super) struct Repeats {
    /// Maximum number of lines of one text in a window; 0 for no limit.
    limit: u64,
    counts: SortedMap<Arc<MessageKey>, RepetitionCount>,
    /// All that was seen, by the beginning of the window.
    windows: VecDeque<Arc<MessageKey>>,
    /// Suppressed texts by module that were not summed up yet in this window.
    unreported: SortedSet<Arc<MessageKey>>,
    pub suppressed: u64,
}

/// Key of repetition: lines with an equal key count as the same.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct MessageKey {
    module: Arc<str>,
    level: Level,
    text: String,
}

struct RepetitionCount {
    start: u64,
    count: u64,
    suppressed: u64,
    /// Lines that were dropped before suppressed ones.
    dropped: u64,
    last: u64,
    /// True once another message of the module brought a summary.
    /// That happens once in a window, as otherwise alternating messages would make as many summaries as lines.
    is_reported: bool,
}

impl Repeats {
    pub fn new(limit: u64) -> Self {
        Self {
            limit,
            counts: SortedMap::new(),
            windows: VecDeque::new(),
            unreported: SortedSet::new(),
            suppressed: 0,
        }
    }

    /// Writes a line unless it is suppressed, after the summaries that are due.
    pub fn pass(&mut self, record: Record, write: &mut dyn FnMut(&Record)) {
        if self.limit == 0 {
            return write(&record);
        }
        self.expire(record.time, write);
        let text =
            MessageKey { module: Arc::clone(&record.module), level: record.level, text: record.text.clone() };
        if let Some(repetition) = self.counts.get_mut(&text) {
            repetition.count += 1;
            if repetition.count > self.limit {
                self.suppressed += 1;
                repetition.suppressed += 1;
                repetition.dropped += record.dropped;
                repetition.last = record.time;
                if repetition.suppressed == 1 && !repetition.is_reported {
                    self.unreported.insert(Arc::new(text));
                }
                return;
            }
        } else {
            if self.windows.len() == MESSAGE_LIMIT {
                self.end_oldest_window(write);
            }
            let (text, start) = (Arc::new(text), record.time);
            self.windows.push_back(Arc::clone(&text));
            let repetition = RepetitionCount {
                start,
                count: 1,
                suppressed: 0,
                dropped: 0,
                last: start,
                is_reported: false,
            };
            self.counts.insert(text, repetition);
        }
        let other: Vec<_> =
            self.unreported.iter().filter(|text| text.module == record.module).cloned().collect();
        other.iter().for_each(|text| self.write_summary(text, write));
        write(&record);
    }

    /// Writes the pending summaries of suppressed lines.
    pub fn write_summaries(&mut self, write: &mut dyn FnMut(&Record)) {
        for at in 0..self.windows.len() {
            let text = Arc::clone(&self.windows[at]);
            self.write_summary(&text, write);
        }
    }

    fn expire(&mut self, now: u64, write: &mut dyn FnMut(&Record)) {
        let over = |repetition: &RepetitionCount| now.saturating_sub(repetition.start) >= WINDOW;
        while self.windows.front().and_then(|text| self.counts.get(text)).is_some_and(over) {
            self.end_oldest_window(write);
        }
    }

    /// Ends the oldest window.
    fn end_oldest_window(&mut self, write: &mut dyn FnMut(&Record)) {
        if let Some(text) = self.windows.pop_front() {
            self.write_summary(&text, write);
            self.counts.remove(&text);
        }
    }

    fn write_summary(&mut self, text: &Arc<MessageKey>, write: &mut dyn FnMut(&Record)) {
        let Some(repetition) = self.counts.get_mut(text).filter(|repetition| repetition.suppressed > 0)
        else {
            return;
        };
        let summary = match repetition.suppressed {
            1 => format!("repeated once more: {}", text.text),
            count => format!("repeated {count} times: {}", text.text),
        };
        let mut record = Record::new(repetition.last, text.level, &text.module, summary);
        record.dropped = std::mem::take(&mut repetition.dropped);
        (repetition.suppressed, repetition.is_reported) = (0, true);
        self.unreported.remove(text);
        write(&record);
    }
}
