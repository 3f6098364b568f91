use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

use slate_module::Level;

use super::Record;

/// How long repetitions of a message are counted together, nanoseconds of the agent's time.
pub(super) const WINDOW: u64 = 1_000_000_000;

/// How many different messages are remembered; beyond that, the oldest is forgotten before its window ends.
const REMEMBERED: usize = 4096;

/// Sums up messages that are repeated too often.
///
/// It looks at the times of the lines alone, so that in lockstep the same lines come out in every run.
pub(super) struct Repeats {
    /// How many lines of one text are written in a window; 0 for all.
    limit: u64,
    seen: BTreeMap<Arc<Text>, Seen>,
    /// All that was seen, by the beginning of the window.
    windows: VecDeque<Arc<Text>>,
    /// What was suppressed, by module, and not told yet in this window.
    untold: BTreeSet<Arc<Text>>,
    pub suppressed: u64,
}

/// What makes two lines the same.
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
    /// Whether another message of the module brought a sum. That happens once in a window, as else messages that
    /// alternate would make as many sums as there are lines.
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

    /// Writes a line, unless it is suppressed, and before it what is to be told by then.
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

    /// Tells of all that is suppressed and not told yet.
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
