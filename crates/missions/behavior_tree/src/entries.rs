//! Entries of blackboards while a tree runs.

use crate::value::BoardValue;

/// Values of entries by number, and how often each was written.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct EntryValues {
    values: Vec<Option<BoardValue>>,
    writes: Vec<u64>,
}

impl EntryValues {
    /// Returns entries with their initial values.
    pub fn new(values: Vec<Option<BoardValue>>) -> Self {
        let writes = values.iter().map(|value| u64::from(value.is_some())).collect();
        Self { values, writes }
    }

    pub fn get(&self, slot: usize) -> Option<&BoardValue> {
        self.values[slot].as_ref()
    }

    /// Returns the number of writes since the entry had no value.
    pub fn writes(&self, slot: usize) -> u64 {
        self.writes[slot]
    }

    pub fn set(&mut self, slot: usize, value: BoardValue) {
        self.values[slot] = Some(value);
        self.writes[slot] += 1;
    }

    pub fn unset(&mut self, slot: usize) {
        (self.values[slot], self.writes[slot]) = (None, 0);
    }

    pub fn restore(&mut self, slot: usize, value: Option<BoardValue>, writes: u64) {
        (self.values[slot], self.writes[slot]) = (value, writes);
    }
}
