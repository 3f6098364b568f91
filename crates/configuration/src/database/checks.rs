//! Checks of proposals, added by users of the database.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex};

use slate_sorted::SortedSet;

use super::{Change, Configuration, Diagnostic, Report, lock};

/// Check that a configuration can be used.
pub(super) type Validator = dyn Fn(&Configuration, &[Change]) -> Result<(), Report> + Send + Sync;

/// Check for the changes of an edited file that need a restart.
/// It returns their indices in the list.
pub(super) type RestartCheck = dyn Fn(&Configuration, &[Change]) -> SortedSet<usize> + Send + Sync;

/// Checks of a database, in the order in which they were added.
#[derive(Default)]
pub(super) struct Checks {
    validators: Mutex<Vec<Arc<Validator>>>,
    restarts: Mutex<Vec<Arc<RestartCheck>>>,
}

impl Checks {
    pub(super) fn add_validator(&self, validator: Arc<Validator>) {
        lock(&self.validators).push(validator);
    }

    pub(super) fn add_restart_check(&self, check: Arc<RestartCheck>) {
        lock(&self.restarts).push(check);
    }

    /// Collects the objections of the validators.
    pub(super) fn validate(&self, configuration: &Configuration, changes: &[Change]) -> Result<(), Report> {
        let validators = lock(&self.validators).clone();
        let mut diagnostics = Vec::new();
        for validator in validators {
            match catch_unwind(AssertUnwindSafe(|| validator(configuration, changes))) {
                Ok(Ok(())) => {}
                Ok(Err(report)) => diagnostics.extend_from_slice(report.diagnostics()),
                Err(_) => diagnostics.push(Diagnostic::without_place(
                    "a check of the configuration panicked",
                    Some("this is an error in the program, not in the configuration".into()),
                )),
            }
        }
        if diagnostics.is_empty() { Ok(()) } else { Err(diagnostics.into()) }
    }

    /// Returns the changes that wait for the next start.
    pub(super) fn waiting(&self, configuration: &Configuration, changes: &[Change]) -> Vec<Change> {
        let checks = lock(&self.restarts).clone();
        let places: SortedSet<usize> =
            checks.iter().flat_map(|check| check(configuration, changes)).collect();
        places.into_iter().filter_map(|place| changes.get(place).cloned()).collect()
    }
}
