use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

use slate_module::Level;

use super::Record;

/// Window in which repetitions of a message are counted, ns of the agent's time.
pub(super) const WINDOW: u64 = 1_000_000_000;

/// Maximum number of different messages remembered.
/// Beyond that, the oldest is dropped before its window ends.
const REMEMBERED: usize = 4096;

/// Sums up messages that are repeated too often.
///
/// It looks at the times of the lines alone, so that in lockstep the same lines come out in every run.
pub(super) struct Repeats {
    /// Maximum number of lines of one text in a window; 0 for no limit.
    limit: u64,
    seen: BTreeMap<Arc<Text>, Seen>,
    /// All that was seen, by the beginning of the window.
    windows: VecDeque<Arc<Text>>,
    /// Suppressed texts by module that were not summed up yet in this window.
    untold: BTreeSet<Arc<Text>>,
    pub suppressed: u64,
}

/// Key of repetition: lines with an equal key count as the same.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Text {
    module: Arc<str>,
    level: Level,
    text: String,
}

struct Seen {
    start: u64,
    count: u64,
    suppressed: u64,
    /// Lines that were dropped before suppressed ones.
    dropped: u64,
    last: u64,
    /// True once another message of the module brought a summary.
    /// That happens once in a window, as otherwise alternating messages would make as many summaries as lines.
    told: bool,
}

impl Repeats {
    pub fn new(limit: u64) -> Self {
        Self {
            limit,
            seen: BTreeMap::new(),
            windows: VecDeque::new(),
            untold: BTreeSet::new(),
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
            Text { module: Arc::clone(&record.module), level: record.level, text: record.text.clone() };
        if let Some(seen) = self.seen.get_mut(&text) {
            seen.count += 1;
            if seen.count > self.limit {
                self.suppressed += 1;
                seen.suppressed += 1;
                seen.dropped += record.dropped;
                seen.last = record.time;
                if seen.suppressed == 1 && !seen.told {
                    self.untold.insert(Arc::new(text));
                }
                return;
            }
        } else {
            if self.windows.len() == REMEMBERED {
                self.forget(write);
            }
            let (text, start) = (Arc::new(text), record.time);
            self.windows.push_back(Arc::clone(&text));
            let seen = Seen { start, count: 1, suppressed: 0, dropped: 0, last: start, told: false };
            self.seen.insert(text, seen);
        }
        let other: Vec<_> = self.untold.iter().filter(|text| text.module == record.module).cloned().collect();
        other.iter().for_each(|text| self.tell(text, write));
        write(&record);
    }

    /// Writes the pending summaries of suppressed lines.
    pub fn settle(&mut self, write: &mut dyn FnMut(&Record)) {
        for at in 0..self.windows.len() {
            let text = Arc::clone(&self.windows[at]);
            self.tell(&text, write);
        }
    }

    fn expire(&mut self, now: u64, write: &mut dyn FnMut(&Record)) {
        let over = |seen: &Seen| now.saturating_sub(seen.start) >= WINDOW;
        while self.windows.front().and_then(|text| self.seen.get(text)).is_some_and(over) {
            self.forget(write);
        }
    }

    /// Ends the oldest window.
    fn forget(&mut self, write: &mut dyn FnMut(&Record)) {
        if let Some(text) = self.windows.pop_front() {
            self.tell(&text, write);
            self.seen.remove(&text);
        }
    }

    fn tell(&mut self, text: &Arc<Text>, write: &mut dyn FnMut(&Record)) {
        let Some(seen) = self.seen.get_mut(text).filter(|seen| seen.suppressed > 0) else { return };
        let summary = match seen.suppressed {
            1 => format!("repeated once more: {}", text.text),
            count => format!("repeated {count} times: {}", text.text),
        };
        let mut record = Record::new(seen.last, text.level, &text.module, summary);
        record.dropped = std::mem::take(&mut seen.dropped);
        (seen.suppressed, seen.told) = (0, true);
        self.untold.remove(text);
        write(&record);
    }
}
