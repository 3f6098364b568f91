//! Log of a run whose display owns the terminal.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use slate_runtime::log::{LogTarget, MemoryTarget, Record};

/// Log target of the display.
/// It keeps the log for the report, and new lines until they are shown.
#[derive(Clone, Default)]
pub struct DisplayLog {
    pub kept: MemoryTarget,
    fresh: Arc<Mutex<VecDeque<Record>>>,
}

impl DisplayLog {
    /// Takes the lines since the last call.
    pub fn fresh(&self) -> VecDeque<Record> {
        std::mem::take(&mut self.fresh.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl LogTarget for DisplayLog {
    fn write(&mut self, record: &Record) {
        self.kept.write(record);
        let mut fresh = self.fresh.lock().unwrap_or_else(PoisonError::into_inner);
        // More lines than that can't be read in time.
        if fresh.len() < MemoryTarget::CAPACITY {
            fresh.push_back(record.clone());
        }
    }
}
