//! Refused agents and strangers, on the board for tools and in the log.
//! The entries are bounded, regardless of the number of attempts and names.

use std::sync::Arc;

use slate_blackboard::channel::{Budget, Writer};
use slate_blackboard::interface::{Interface, View};
use slate_blackboard::{Access, Board, Store};
use slate_module::{Text, interface};
use slate_runtime::printable_text;

/// Refused agent or stranger.
#[interface]
#[derive(PartialEq)]
pub struct Rejected {
    /// Number of refusals.
    pub count: u64,
    /// Time of the last refusal, by this agent's clock.
    #[unit("ns")]
    pub last: u64,
    /// Identity, as far as known.
    pub from: Text<124>,
    /// Reason.
    pub reason: Text<252>,
}

/// Number of kept entries; the least recently seen one makes room.
const MAX_ENTRIES: usize = 8;

/// Shortest interval between log lines about the same refusal, ns.
const LOG_INTERVAL: u64 = 60_000_000_000;

/// Largest number of such log lines in that interval.
const MAX_LOG_LINES: u32 = 16;

pub(super) struct Refusals {
    board: Arc<Board>,
    entries: Vec<RefusalEntry>,
    /// Beginning of the interval, ns, and log lines since.
    lines: (u64, u32),
}

struct RefusalEntry {
    from: String,
    reason: String,
    count: u64,
    last: u64,
    logged: Option<(u64, u64)>,
    writer: Option<Writer>,
}

impl Refusals {
    pub fn new(board: &Arc<Board>) -> Self {
        Self { board: Arc::clone(board), entries: Vec::new(), lines: (0, 0) }
    }

    /// Notes a refusal; returns a line for the log, if one is due.
    pub fn record(&mut self, now: u64, from: &str, reason: &str) -> Option<String> {
        // The text comes from strangers, and terminals show it.
        let (from, reason) = (&*printable_text(from), &*printable_text(reason));
        let known = self.entries.iter().position(|entry| entry.from == *from && entry.reason == *reason);
        let at = known.unwrap_or_else(|| self.begin(from, reason));
        let entry = self.entries.get_mut(at)?;
        (entry.count, entry.last) = (entry.count + 1, now);
        if let Some(writer) = &mut entry.writer {
            let (from, reason) = (Text::new(from), Text::new(reason));
            let mut shown = Rejected { count: entry.count, last: now, from, reason };
            // The state is only informative.
            let _ = writer.write(View::of(&mut shown).bytes(), 0, now);
        }
        if now.saturating_sub(self.lines.0) >= LOG_INTERVAL {
            self.lines = (now, 0);
        }
        let before = entry.logged;
        if self.lines.1 >= MAX_LOG_LINES
            || before.is_some_and(|(time, _)| now.saturating_sub(time) < LOG_INTERVAL)
        {
            return None;
        }
        self.lines.1 += 1;
        entry.logged = Some((now, entry.count));
        let suffix = before.map(|(_, count)| format!(" ({} times more)", entry.count - count));
        Some(format!("{from}: {reason}{}", suffix.unwrap_or_default()))
    }

    fn begin(&mut self, from: &str, reason: &str) -> usize {
        let fresh = |writer| RefusalEntry {
            from: from.into(),
            reason: reason.into(),
            count: 0,
            last: 0,
            logged: None,
            writer,
        };
        if self.entries.len() < MAX_ENTRIES {
            let store = Store { capacity: 0, depth: 1, budget: Budget { latest: 8, queues: 1, window: 4 } };
            let path = format!("share/rejected/{}", self.entries.len() + 1);
            let doc = "A refused connection.";
            let made = self.board.add_channel(&path, doc, Rejected::DESCRIPTOR, store, Access::Output);
            let writer = made.ok().and_then(|made| made.channel()?.writer().ok());
            self.entries.push(fresh(writer));
            return self.entries.len() - 1;
        }
        let oldest = (0..self.entries.len()).min_by_key(|at| self.entries[*at].last).unwrap_or_default();
        self.entries[oldest] = fresh(self.entries[oldest].writer.take());
        oldest
    }
}
