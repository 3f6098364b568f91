use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use slate_interfaces::FactHead;
use slate_module::blackboard::interface::Plain;
use slate_module::{Output, Text};

use super::table::FactTable;

/// Bytes of a key.
const KEY: usize = 124;

/// What one robot states about a topic: keep it in the state of the block that does, and write it to an output.
///
/// The output holds what is stated now, and what was taken back lately. That a block forgets something takes nothing back, so
/// a block that is started anew with an empty state states less and retracts nothing. Allocates when a key
/// is new and never else.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Statements<T> {
    entries: BTreeMap<String, Statement<T>>,
    /// Counts the changes.
    revision: u64,
    /// The revision that was written last.
    written: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Statement<T> {
    time: u64,
    certainty: f64,
    /// Nothing when it was taken back.
    value: Option<T>,
}

/// How many retractions are kept: whoever passes them on looks several times a second.
const RETRACTIONS: usize = 32;

impl<T> Default for Statements<T> {
    fn default() -> Self {
        Self { entries: BTreeMap::new(), revision: 0, written: 0 }
    }
}

impl<T: Plain + PartialEq> Statements<T> {
    /// States something about a key, with a certainty from 0 to 1, at a time of this agent in nanoseconds. Saying the same
    /// again is nothing new. False when the key is empty or longer than 124 bytes, or the certainty is none.
    pub fn state(&mut self, now: u64, key: &str, certainty: f64, value: T) -> bool {
        if !(1..=KEY).contains(&key.len()) || !(0.0..=1.0).contains(&certainty) {
            return false;
        }
        let statement = Statement { time: now, certainty, value: Some(value) };
        match self.entries.get_mut(key) {
            Some(known) if known.certainty == certainty && known.value == statement.value => return true,
            Some(known) => *known = statement,
            None => drop(self.entries.insert(key.into(), statement)),
        }
        self.revision += 1;
        true
    }

    /// Takes back what this robot states about a key, also if it did so in an earlier life and this block knows nothing of
    /// it. What other robots state about the key stays.
    pub fn retract(&mut self, now: u64, key: &str) {
        if !(1..=KEY).contains(&key.len()) || self.entries.get(key).is_some_and(|known| known.value.is_none())
        {
            return;
        }
        self.entries.insert(key.into(), Statement { time: now, certainty: 0.0, value: None });
        let retracted = self.entries.iter().filter(|(_, known)| known.value.is_none());
        if retracted.clone().count() > RETRACTIONS {
            let oldest = retracted.min_by_key(|(_, known)| known.time).map(|(key, _)| key.clone());
            oldest.map(|key| self.entries.remove(&key));
        }
        self.revision += 1;
    }

    /// What is stated about a key.
    pub fn get(&self, key: &str) -> Option<&T> {
        self.entries.get(key)?.value.as_ref()
    }

    /// The keys about which something is stated, with the values, in order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &T)> {
        self.entries.iter().filter_map(|(key, known)| Some((key.as_str(), known.value.as_ref()?)))
    }

    /// Writes them if they were changed since; false when they have no room there, and then nothing is written.
    pub fn write(&mut self, output: &Output<FactTable<T>>) -> bool {
        if self.written == self.revision {
            return true;
        }
        let (entries, revision) = (&self.entries, self.revision);
        let written = output.write(entries.len(), |table| {
            table.head.revision = revision;
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
        });
        if written {
            self.written = revision;
        }
        written
    }
}
