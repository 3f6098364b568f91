//! Newest warnings of a run, by module.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use slate_module::Level;
use slate_runtime::log::{LogTarget, Record};
use slate_sorted::SortedMap;

/// Maximum number of warnings in the end message of a run.
const MAX_WARNINGS: usize = 3;

/// Warning or an error of a module.
#[derive(Clone)]
pub struct RunWarning {
    pub module: Arc<str>,
    /// Time, ns of the agent's time.
    pub time: u64,
    pub text: String,
}

/// Target of the log that keeps the newest warning or error of each module.
#[derive(Clone, Default)]
pub struct Warnings {
    kept: Arc<Mutex<SortedMap<Arc<str>, RunWarning>>>,
}

impl Warnings {
    /// Returns the newest ones, oldest first.
    pub fn newest(&self) -> Vec<RunWarning> {
        let mut all: Vec<_> = self.kept().values().cloned().collect();
        all.sort_by_key(|warning| warning.time);
        all.split_off(all.len().saturating_sub(MAX_WARNINGS))
    }

    fn kept(&self) -> MutexGuard<'_, SortedMap<Arc<str>, RunWarning>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl LogTarget for Warnings {
    fn write(&mut self, record: &Record) {
        if matches!(record.level, Level::Warn | Level::Error) {
            let module = Arc::clone(&record.module);
            let warning = RunWarning { module, time: record.time, text: record.message() };
            self.kept().insert(Arc::clone(&record.module), warning);
        }
    }
}
