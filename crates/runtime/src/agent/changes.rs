//! Changes of the configuration that modules ask for, and how changes are told.

use std::cell::RefCell;
use std::time::Duration;

use toml_edit::Key;

use super::composer::Composer;
use crate::configuration::{Change, Report, Value};
use crate::recording::Change as Recorded;

impl Composer {
    /// Makes the changes that a module asks for, a line each: `path=value`, or a path alone, which takes back what was
    /// changed there. Says what has changed.
    ///
    /// # Errors
    /// What does not fit; nothing is changed then.
    pub(crate) fn change_for(&self, module: &str, lines: &str) -> Result<String, Report> {
        let database = self.composition().database()?;
        let lines = lines.lines().filter(|line| !line.trim().is_empty());
        let (set, taken_back): (Vec<&str>, Vec<&str>) = lines.partition(|line| line.contains('='));
        let mut changes = Vec::new();
        for line in set {
            changes.push(crate::configuration::parse_change(line)?);
        }
        let changes = by_module(module, || self.commit(|| database.propose_instead(&taken_back, &changes)))?;
        self.say_changes(&format!("{module} has changed"), &changes);
        let changed: Vec<_> = changes.iter().map(|change| self.told(change)).collect();
        Ok(changed.join(", "))
    }

    /// What came of such a request when the recording was made that is played, if one is and it has that request.
    pub(crate) fn recorded_answer(&self, module: &str, lines: &str) -> Option<Result<String, String>> {
        self.shared.recorded_answer(module, lines)
    }

    /// Tells what records the agent what came of such a request.
    pub(crate) fn tell_asked(&self, module: &str, lines: &str, answer: &Result<String, String>) {
        if let Some(recording) = &self.recording {
            let (module, lines, answer) = (module.to_owned(), lines.to_owned(), answer.clone());
            let change = Recorded::Asked { module, lines, answer };
            recording.changed(self.shared.cycles(), self.now(), &change);
        }
    }

    /// Tells who reads the log later why the robot is another one from here on.
    pub(crate) fn say_changes(&self, what: &str, changes: &[Change]) {
        changes.iter().for_each(|change| self.say(&format!("{what} {}", self.told(change))));
    }

    /// A change with what holds where nothing is said.
    fn told(&self, Change { path, before, after, .. }: &Change) -> String {
        let default =
            || self.default_at(path).map_or("none".into(), |default| format!("{default} (default)"));
        let value = |value: &Option<Value>| value.as_ref().map_or_else(default, Value::to_string);
        format!("{path}: {} -> {}", value(before), value(after))
    }

    /// The value that a module has where nothing says another.
    pub(crate) fn default_at(&self, path: &str) -> Option<String> {
        let names = Key::parse(path).ok()?;
        let names: Vec<&str> = names.iter().map(Key::get).collect();
        let [section, module, part, name] = names[..] else { return None };
        let value = self.default_of(module, name).filter(|_| (section, part) == ("modules", "params"))?;
        serde_json::to_string(&value).ok()
    }
}

/// How long a change waits for the end of a cycle.
const PATIENCE: Duration = Duration::from_secs(1);

thread_local! {
    /// The module that has asked for the change that this thread makes, if one has.
    static BY_MODULE: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Makes a change that a module has asked for: who makes the run again has it from the module.
fn by_module<R>(module: &str, change: impl FnOnce() -> R) -> R {
    let before = BY_MODULE.replace(Some(module.to_owned()));
    let result = change();
    BY_MODULE.replace(before);
    result
}

impl Composer {
    /// Makes a change that a module has asked for, but at a moment that depends on the wall clock: what records the agent is
    /// told that the run can't be made again.
    pub(crate) fn make_for_module<R>(&self, module: &str, what: &str, make: impl FnOnce() -> R) -> R {
        self.tell_recording(what);
        by_module(module, make)
    }

    /// Makes changes; what records the agent is told. In lockstep they are made between two cycles, so that they can be made
    /// again.
    pub(super) fn make_recorded<R, E>(
        &self,
        changes: Vec<Recorded>,
        make: impl FnOnce() -> Result<R, E>,
    ) -> Result<R, E> {
        self.make_recorded_within(PATIENCE, changes, make)
    }

    /// As [`make_recorded`](Composer::make_recorded), but made so much later at most.
    pub(super) fn make_recorded_within<R, E>(
        &self,
        patience: Duration,
        changes: Vec<Recorded>,
        make: impl FnOnce() -> Result<R, E>,
    ) -> Result<R, E> {
        let Some(recording) = &self.recording else { return make() };
        let module = BY_MODULE.with_borrow(Option::clone);
        let before = self.shared.order();
        let (cycle, result) = match self.shared.lockstep && module.is_none() {
            true => self.shared.between_two(patience, make),
            false => (None, make()),
        };
        let (now, cycles) = (self.now(), self.shared.cycles());
        let tell = |change: &Recorded| recording.changed(cycle.unwrap_or(cycles), now, change);
        match module {
            // The loop makes it itself in lockstep, and is between two cycles. Of a failure only the module is told.
            Some(module) => {
                let settings = changes.into_iter().filter(|_| result.is_ok());
                settings.filter_map(|change| change.of(&module)).for_each(|change| tell(&change));
            }
            None if result.is_err() => self.tell_recording("a change that failed"),
            None if self.shared.lockstep && cycle.is_none() => {
                self.tell_recording("a change in the middle of a cycle");
            }
            None => changes.iter().for_each(tell),
        }
        let stages = self.shared.order();
        if stages != before {
            tell(&Recorded::Order { stages });
        }
        result
    }

    /// Waits until the changes that were made are in what records the agent, but not for long.
    pub(crate) fn settle_changes(&self) {
        if let Some(recording) = &self.recording {
            recording.settle();
        }
    }

    /// Tells what records the agent of a change that can't be made again.
    pub(super) fn tell_recording(&self, what: &str) {
        if let Some(recording) = &self.recording {
            let change = Recorded::Other { what: what.into() };
            recording.changed(self.shared.cycles(), self.now(), &change);
        }
    }
}

impl Recorded {
    /// The change of a setting, as one that a module has asked for.
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
