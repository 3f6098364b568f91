use serde::{Deserialize, Serialize};
use slate_interfaces::FactHead;
use slate_module::blackboard::interface::Plain;
use slate_module::{Output, Text};
use slate_sorted::SortedMap;

use super::table::FactTable;

/// Bytes of a key.
const KEY: usize = 124;

/// Period of full writes, nanoseconds.
/// The host drops the outputs of a failed or late step.
const AGAIN: u64 = 1_000_000_000;

/// Duration for which a retraction is written, nanoseconds.
const KEPT: u64 = 10_000_000_000;

/// Maximum number of retractions of unknown keys.
const RETRACTIONS: usize = 1024;

/// Statements of a robot about a topic.
/// Keep it in the state of a block, and write it to an output in each tick.
///
/// The output holds present statements, and retractions of the last 10 s. A block with an empty state states less, but retracts
/// nothing. Allocates only for a new key.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Statements<T> {
    entries: SortedMap<String, Statement<T>>,
    /// Time of the newest write, if unchanged since.
    written: Option<u64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Statement<T> {
    time: u64,
    certainty: f64,
    /// `None` if retracted.
    value: Option<T>,
    /// Time of the first write of the retraction.
    written: Option<u64>,
}

impl<T> Default for Statements<T> {
    fn default() -> Self {
        Self { entries: SortedMap::new(), written: None }
    }
}

impl<T: Plain + PartialEq> Statements<T> {
    /// States a value of a key, with a certainty from 0 to 1.
    /// `now` is a time of this agent, nanoseconds. The same statement again has no effect.
    ///
    /// Returns false if the key is empty or longer than 124 bytes, or the certainty is invalid.
    pub fn state(&mut self, now: u64, key: &str, certainty: f64, value: T) -> bool {
        if !is_key(key) || !(0.0..=1.0).contains(&certainty) {
            return false;
        }
        let statement = Statement { time: now, certainty, value: Some(value), written: None };
        match self.entries.get_mut(key) {
            Some(known) if known.certainty == certainty && known.value == statement.value => return true,
            Some(known) => *known = statement,
            None => drop(self.entries.insert(key.into(), statement)),
        }
        self.written = None;
        true
    }

    /// Retracts this robot's statement about a key, also one of an earlier life.
    /// Statements of other robots stay.
    ///
    /// Returns false if the key is empty or longer than 124 bytes, or if the key is unknown and 1024 keys were retracted in the last 10 s: then
    /// try again later.
    pub fn retract(&mut self, now: u64, key: &str) -> bool {
        if !is_key(key) {
            return false;
        }
        let known = self.entries.get(key).map(|known| known.value.is_none());
        if known == Some(true) {
            return true;
        }
        let retractions = || self.entries.values().filter(|known| known.value.is_none()).count();
        if known.is_none() && retractions() >= RETRACTIONS {
            return false;
        }
        let retraction = Statement { time: now, certainty: 0.0, value: None, written: None };
        match self.entries.get_mut(key) {
            Some(known) => *known = retraction,
            None => drop(self.entries.insert(key.into(), retraction)),
        }
        self.written = None;
        true
    }

    /// Returns the stated value of a key.
    pub fn get(&self, key: &str) -> Option<&T> {
        self.entries.get(key)?.value.as_ref()
    }

    /// Iterates over keys and stated values, in order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &T)> {
        self.entries.iter().filter_map(|(key, known)| Some((key.as_str(), known.value.as_ref()?)))
    }

    /// Writes the table after a change or a second.
    /// `now` is a time of this agent, nanoseconds.
    ///
    /// Returns false, without writing, if the table is full: retractions keep their place for a second at least, and those without one wait.
    pub fn write(&mut self, now: u64, output: &Output<FactTable<T>>) -> bool {
        if self.written.is_some_and(|written| now.abs_diff(written) < AGAIN) {
            return true;
        }
        let limit = if self.entries.len() > output.capacity() { AGAIN } else { KEPT };
        self.entries.retain(|_, known| {
            known.value.is_some() || known.written.is_none_or(|first| now.abs_diff(first) < limit)
        });
        let placed = self.entries.values().filter(|known| known.has_place()).count();
        let Some(free) = output.capacity().checked_sub(placed) else { return false };
        let waiting = self.entries.values_mut().filter(|known| !known.has_place());
        waiting.take(free).for_each(|known| known.written = Some(now));
        let entries = self.entries.iter().filter(|(_, known)| known.has_place());
        let written = output.write(entries.clone().count(), |table| {
            for (fact, (key, known)) in table.facts.iter_mut().zip(entries) {
                let head = FactHead {
                    sequence: known.time,
                    time: known.time,
                    order: known.time,
                    heard: known.time,
                    certainty: known.certainty,
                    retracted: known.value.is_none().into(),
                    key: Text::new(key),
                    ..FactHead::default()
                };
                // Unstated entries stay all zero.
                fact.head = head;
                if let Some(value) = known.value {
                    fact.value = value;
                }
            }
            table.head.revision = table.hash();
        });
        if written {
            self.written = Some(now);
        }
        written
    }
}

impl<T> Statement<T> {
    /// Returns whether it is written: statements always, retractions if they fit.
    fn has_place(&self) -> bool {
        self.value.is_some() || self.written.is_some()
    }
}

fn is_key(text: &str) -> bool {
    (1..=KEY).contains(&text.len())
}
