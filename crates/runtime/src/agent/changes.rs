//! Changes of the configuration that modules ask for, and how changes are told.

use std::cell::Cell;
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
        let changes = by_module(|| self.commit(|| database.propose_instead(&taken_back, &changes)))?;
        self.say_changes(&format!("{module} has changed"), &changes);
        let changed: Vec<_> = changes.iter().map(|change| self.told(change)).collect();
        Ok(changed.join(", "))
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
    /// Whether this thread makes a change that a module has asked for.
    static BY_MODULE: Cell<bool> = const { Cell::new(false) };
}

/// Makes a change that a module has asked for: who makes the run again has it from the module.
fn by_module<R>(change: impl FnOnce() -> R) -> R {
    let before = BY_MODULE.replace(true);
    let result = change();
    BY_MODULE.set(before);
    result
}

impl Composer {
    /// Makes a change that a module has asked for, but at a moment that depends on the wall clock: what records the agent is
    /// told that the run can't be made again.
    pub(crate) fn make_for_module<R>(&self, what: &str, make: impl FnOnce() -> R) -> R {
        self.tell_recording(what);
        by_module(make)
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
        let recording = self.shared.recording.as_ref().filter(|_| !BY_MODULE.get());
        let Some(recording) = recording else { return make() };
        let (cycle, result) = match self.shared.lockstep {
            true => self.shared.between_two(patience, make),
            false => (None, make()),
        };
        let (now, cycles) = (self.now(), self.shared.cycles());
        if result.is_err() {
            self.tell_recording("a change that failed");
        } else if self.shared.lockstep && cycle.is_none() {
            self.tell_recording("a change in the middle of a cycle");
        } else {
            changes.iter().for_each(|change| recording.changed(cycle.unwrap_or(cycles), now, change));
        }
        result
    }

    /// Waits until the changes that were made are in what records the agent, but not for long.
    pub(crate) fn settle_changes(&self) {
        if let Some(recording) = &self.shared.recording {
            recording.settle();
        }
    }

    /// Tells what records the agent of a change that can't be made again.
    pub(super) fn tell_recording(&self, what: &str) {
        if let Some(recording) = &self.shared.recording {
            let change = Recorded::Other { what: what.into() };
            recording.changed(self.shared.cycles(), self.now(), &change);
        }
    }
}

impl From<&Change> for Recorded {
    fn from(change: &Change) -> Self {
        let value = change.after.as_ref().map(Value::to_string);
        Self::Setting { path: change.path.clone(), value }
    }
}
