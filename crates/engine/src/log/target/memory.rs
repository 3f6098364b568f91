use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use super::{LogTarget, Record};

/// Last lines in memory, for displays and tests.
#[derive(Clone, Debug, Default)]
pub struct MemoryTarget {
    lines: Arc<Mutex<VecDeque<Record>>>,
}

impl MemoryTarget {
    /// Number of lines kept.
    pub const CAPACITY: usize = 1000;

    /// Returns a copy of the lines.
    pub fn lines(&self) -> Vec<Record> {
        self.lines.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
    }
}

impl LogTarget for MemoryTarget {
    fn write(&mut self, record: &Record) {
        let mut lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        if lines.len() == Self::CAPACITY {
            lines.pop_front();
        }
        lines.push_back(record.clone());
    }
}
