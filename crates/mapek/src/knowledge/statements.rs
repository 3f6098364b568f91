use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use slate_interfaces::FactHead;
use slate_module::blackboard::interface::Plain;
use slate_module::{Output, Text};

use super::table::FactTable;

/// Bytes of a key.
const KEY: usize = 124;

/// Nanoseconds after which all is written once more: a host drops what a step writes that then fails or is late.
const AGAIN: u64 = 1_000_000_000;

/// How long a retraction is written, nanoseconds: whoever passes it on looks several times a second.
const KEPT: u64 = 10_000_000_000;

/// How many retractions there may be when another key is taken back about which nothing is stated.
const RETRACTIONS: usize = 1024;

/// What one robot states about a topic: keep it in the state of the block that does, and write it to an output in every tick.
///
/// The output holds what is stated now, and what was taken back in the last 10 s. That a block forgets something takes nothing
/// back, so a block that is started anew with an empty state states less and retracts nothing. Allocates when a key
/// is new and never else.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Statements<T> {
    entries: BTreeMap<String, Statement<T>>,
    /// When they were written last, as they are now.
    written: Option<u64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Statement<T> {
    time: u64,
    certainty: f64,
    /// Nothing when it was taken back.
    value: Option<T>,
    /// When the retraction was written first.
    written: Option<u64>,
}

impl<T> Default for Statements<T> {
    fn default() -> Self {
        Self { entries: BTreeMap::new(), written: None }
    }
}

impl<T: Plain + PartialEq> Statements<T> {
    /// States something about a key, with a certainty from 0 to 1, at a time of this agent in nanoseconds. Saying the same
    /// again is nothing new. False when the key is empty or longer than 124 bytes, or the certainty is none.
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

    /// Takes back what this robot states about a key, also if it did so in an earlier life and this block knows nothing of
    /// it. What other robots state about the key stays. False when the key is empty or longer than 124 bytes, or when this
    /// block states nothing about it and has taken back 1024 keys in the last 10 s: then try again later.
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

    /// What is stated about a key.
    pub fn get(&self, key: &str) -> Option<&T> {
        self.entries.get(key)?.value.as_ref()
    }

    /// The keys about which something is stated, with the values, in order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &T)> {
        self.entries.iter().filter_map(|(key, known)| Some((key.as_str(), known.value.as_ref()?)))
    }

    /// Writes them at a time of this agent in nanoseconds, if they were changed since or a second has passed. False when they
    /// have no room there, and then nothing is written: what was taken back leaves its place after a second at the earliest,
    /// and what has none yet waits for one.
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
                // What is not stated stays all zero.
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
    /// Whether it is written: what is stated always, what was taken back once there is room for it.
    fn has_place(&self) -> bool {
        self.value.is_some() || self.written.is_some()
    }
}

fn is_key(text: &str) -> bool {
    (1..=KEY).contains(&text.len())
}
