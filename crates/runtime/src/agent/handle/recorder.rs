//! Reports of an agent's changes to its recorder.

use std::cell::RefCell;
use std::sync::Arc;
use std::time::Duration;

use crate::recording::{Change as Recorded, Recording};
use slate_configuration::{Change, Value};
use slate_engine::main_loop::SharedLoop;

/// Makes changes of an agent reproducibly, and reports them to the recorder.
#[derive(Clone)]
pub(in crate::agent) struct ChangeRecorder {
    shared: Arc<SharedLoop>,
    /// Recorder of the agent.
    pub recording: Option<Arc<dyn Recording>>,
}

/// Longest wait of a change for the end of a cycle.
const TIMEOUT: Duration = Duration::from_secs(1);

thread_local! {
    /// Module that requests the change which this thread makes, if any.
    static BY_MODULE: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Makes a change on a module's request; a rerun gets it from the module.
pub(in crate::agent) fn by_module<R>(module: &str, change: impl FnOnce() -> R) -> R {
    let before = BY_MODULE.replace(Some(module.to_owned()));
    let result = change();
    BY_MODULE.replace(before);
    result
}

impl ChangeRecorder {
    pub fn new(shared: Arc<SharedLoop>, recording: Option<Arc<dyn Recording>>) -> Self {
        Self { shared, recording }
    }

    /// Makes a change that a module requests, at a time set by the wall clock.
    /// The recorder is notified that the run can't be reproduced.
    pub fn make_for_module<R>(&self, module: &str, what: &str, make: impl FnOnce() -> R) -> R {
        self.record_unrepeatable(what);
        by_module(module, make)
    }

    /// Makes changes and reports them to the recorder.
    /// In lockstep they are made between two cycles, so that a rerun can make them again. They are reported before the
    /// next cycle and the next change, so that the recorder receives all changes in their order.
    pub fn make<R, E>(&self, changes: Vec<Recorded>, make: impl FnOnce() -> Result<R, E>) -> Result<R, E> {
        self.make_within(TIMEOUT, changes, make)
    }

    /// Makes changes as [`make`](ChangeRecorder::make), after at most `timeout`.
    pub fn make_within<R, E>(
        &self,
        timeout: Duration,
        changes: Vec<Recorded>,
        make: impl FnOnce() -> Result<R, E>,
    ) -> Result<R, E> {
        if self.recording.is_none() {
            return make();
        }
        let module = BY_MODULE.with_borrow(Option::clone);
        let make_and_report = |cycle: Option<u64>, has_gap: bool| {
            let before = self.shared.order();
            let result = make();
            let mut made = match module {
                // In lockstep the loop applies it between two cycles. Only the module receives a failure.
                Some(module) => {
                    let settings = changes.into_iter().filter(|_| result.is_ok());
                    settings.filter_map(|change| change.of(&module)).collect()
                }
                None if result.is_err() => vec![other("a change that failed")],
                None if has_gap && cycle.is_none() => vec![other("a change in the middle of a cycle")],
                None => changes,
            };
            let stages = self.shared.order();
            if stages != before {
                made.push(Recorded::Order { stages });
            }
            self.report(cycle, &made);
            result
        };
        match self.shared.lockstep && BY_MODULE.with_borrow(Option::is_none) {
            true => self.shared.hold_between_cycles(timeout, |cycle| make_and_report(cycle, true)),
            false => make_and_report(None, false),
        }
    }

    /// Reports changes that were made at once, after that cycle or the present one.
    fn report(&self, cycle: Option<u64>, changes: &[Recorded]) {
        if let Some(recording) = self.recording.as_ref().filter(|_| !changes.is_empty()) {
            recording.changed(
                cycle.unwrap_or_else(|| self.shared.cycles()),
                self.shared.clock.now(),
                changes,
            );
        }
    }

    /// Reports the answer to a module's change of settings to the recorder.
    pub fn record_request(&self, module: &str, lines: &str, answer: &Result<String, String>) {
        let (module, lines, answer) = (module.to_owned(), lines.to_owned(), answer.clone());
        self.report(None, &[Recorded::Asked { module, lines, answer }]);
    }

    /// Waits for a short time until the recorder has stored all changes.
    pub fn settle(&self) {
        if let Some(recording) = &self.recording {
            recording.settle();
        }
    }

    /// Reports a change that can't be reproduced to the recorder.
    pub fn record_unrepeatable(&self, what: &str) {
        self.report(None, &[other(what)]);
    }
}

/// Returns a change that can't be reproduced.
fn other(what: &str) -> Recorded {
    Recorded::Other { what: what.into() }
}

impl Recorded {
    /// Returns a change of a setting as one requested by a module.
    fn of(self, module: &str) -> Option<Self> {
        let Self::Setting { path, value } = self else { return None };
        Some(Self::Own { module: module.into(), path, value })
    }
}

impl From<&Change> for Recorded {
    fn from(change: &Change) -> Self {
        let value = change.after.as_ref().map(Value::to_string);
        Self::Setting { path: change.path.clone(), value }
    }
}
