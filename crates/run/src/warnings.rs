//! The newest warnings of a run, by module.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use slate_module::Level;
use slate_runtime::log::{LogTarget, Record};

/// How many of them the end of a run tells.
const TOLD: usize = 3;

/// Target of the log that keeps the newest warning or error of each module.
#[derive(Clone, Default)]
pub struct Warnings {
    /// By module: time, nanoseconds, and text.
    kept: Arc<Mutex<BTreeMap<Arc<str>, (u64, String)>>>,
}

impl Warnings {
    /// Returns module, time (nanoseconds) and text of the newest ones, oldest first.
    pub fn newest(&self) -> Vec<(String, u64, String)> {
        let kept = self.kept();
        let mut all: Vec<_> =
            kept.iter().map(|(module, (time, text))| (module.to_string(), *time, text.clone())).collect();
        all.sort_by_key(|(_, time, _)| *time);
        all.split_off(all.len().saturating_sub(TOLD))
    }

    fn kept(&self) -> MutexGuard<'_, BTreeMap<Arc<str>, (u64, String)>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl LogTarget for Warnings {
    fn write(&mut self, record: &Record) {
        if matches!(record.level, Level::Warn | Level::Error) {
            self.kept().insert(Arc::clone(&record.module), (record.time, record.message()));
        }
    }
}
