//! Statements of this robot's blocks.

use std::sync::Arc;

use slate_blackboard::{Board, Property};
use slate_sorted::SortedMap;

use super::{Layout, Member};

/// Property with this robot's statements about a topic.
pub(super) struct StatedTopic {
    pub topic: String,
    path: String,
    /// Passed-on statements, by key.
    forwarded: SortedMap<String, Vec<u8>>,
    /// Number and writer of the last table.
    stamp: (u64, u64),
    pub error: Option<String>,
}

impl StatedTopic {
    pub fn new(topic: &str, path: &str) -> Self {
        let (topic, path) = (topic.to_owned(), path.to_owned());
        Self { topic, path, forwarded: SortedMap::new(), stamp: (0, 0), error: None }
    }

    /// Returns the property and the layout of its table, if it exists.
    pub fn table(&self, board: &Board) -> Option<Result<(Arc<Property>, Layout), String>> {
        let (property, field) = board.get(&self.path)?;
        if !field.is_empty() {
            return Some(Err("it is a field, and not a whole property".into()));
        }
        let layout = Layout::of(property.descriptor());
        Some(layout.map(|layout| (property, layout)))
    }

    /// Passes on changed statements.
    /// `date` is the calendar time at this agent's time `now`, both in ns.
    pub fn forward(&mut self, board: &Board, member: &mut Member, now: u64, date: u64) {
        let table = self.table(board).unwrap_or_else(|| Err("there is no such property yet".into()));
        let (property, layout) = match table {
            Ok(table) => table,
            Err(reason) => {
                self.error = Some(format!("/{}: {reason}", self.path));
                return;
            }
        };
        self.error = None;
        let Ok(Some((bytes, items, stamp))) = property.newest() else { return };
        let stamp = (stamp.generation, stamp.sequence);
        if self.stamp == stamp {
            return;
        }
        self.stamp = stamp;
        for entry in layout.entries(&bytes, items) {
            if entry.key.is_empty()
                || self.forwarded.get(entry.key).is_some_and(|forwarded| forwarded == entry.bytes)
            {
                continue;
            }
            let time = date.saturating_sub(now.saturating_sub(entry.time));
            let done = if entry.retracted {
                member.retract(time, &self.topic, entry.key).map(drop)
            } else {
                member.state(time, (&self.topic, entry.key), &layout, entry.certainty, entry.value)
            };
            match done {
                Ok(()) => drop(self.forwarded.insert(entry.key.to_owned(), entry.bytes.to_vec())),
                Err(refusal) => {
                    self.error = Some(format!("/{}, `{}`: {refusal}", self.path, entry.key));
                    // Retries at the next call.
                    self.stamp = (0, 0);
                }
            }
        }
        let stays = |key: &str| layout.entries(&bytes, items).any(|entry| entry.key == key);
        if self.forwarded.len() > items {
            self.forwarded.retain(|key, _| stays(key));
        }
    }
}
