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
        self.tell(what);
        by_module(module, make)
    }

    /// Makes changes and reports them to the recorder.
    /// In lockstep they are made between two cycles, so that a rerun can make them again.
    pub fn make<R, E>(&self, changes: Vec<Recorded>, make: impl FnOnce() -> Result<R, E>) -> Result<R, E> {
        self.make_within(TIMEOUT, changes, make)
    }

    /// Makes changes as [`make`](ChangeRecorder::make), after at most `patience`.
    pub fn make_within<R, E>(
        &self,
        timeout: Duration,
        changes: Vec<Recorded>,
        make: impl FnOnce() -> Result<R, E>,
    ) -> Result<R, E> {
        let Some(recording) = &self.recording else { return make() };
        let module = BY_MODULE.with_borrow(Option::clone);
        let before = self.shared.order();
        let (cycle, result) = match self.shared.lockstep && module.is_none() {
            true => self.shared.hold_between_cycles(timeout, make),
            false => (None, make()),
        };
        let (now, cycles) = (self.shared.clock.now(), self.shared.cycles());
        let tell = |change: &Recorded| recording.changed(cycle.unwrap_or(cycles), now, change);
        match module {
            // The loop makes it itself in lockstep, and is between two cycles. Of a failure only the module is told.
            Some(module) => {
                let settings = changes.into_iter().filter(|_| result.is_ok());
                settings.filter_map(|change| change.of(&module)).for_each(|change| tell(&change));
            }
            None if result.is_err() => self.tell("a change that failed"),
            None if self.shared.lockstep && cycle.is_none() => {
                self.tell("a change in the middle of a cycle");
            }
            None => changes.iter().for_each(tell),
        }
        let stages = self.shared.order();
        if stages != before {
            tell(&Recorded::Order { stages });
        }
        result
    }

    /// Reports the answer to a module's change of settings to the recorder.
    pub fn tell_asked(&self, module: &str, lines: &str, answer: &Result<String, String>) {
        if let Some(recording) = &self.recording {
            let (module, lines, answer) = (module.to_owned(), lines.to_owned(), answer.clone());
            let change = Recorded::Asked { module, lines, answer };
            recording.changed(self.shared.cycles(), self.shared.clock.now(), &change);
        }
    }

    /// Waits for a short time until the recorder has stored all changes.
    pub fn settle(&self) {
        if let Some(recording) = &self.recording {
            recording.settle();
        }
    }

    /// Reports a change that can't be reproduced to the recorder.
    pub fn tell(&self, what: &str) {
        if let Some(recording) = &self.recording {
            let change = Recorded::Other { what: what.into() };
            recording.changed(self.shared.cycles(), self.shared.clock.now(), &change);
        }
    }
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
