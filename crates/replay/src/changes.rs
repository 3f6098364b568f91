//! Changes that were made while a run was recorded, made again.

use std::collections::VecDeque;

use slate_blackboard::is_within;
use slate_runtime::Agent;
use slate_runtime::configuration::Database;
use slate_runtime::playback::Excerpt;
use slate_runtime::recording::Change;
use slate_sorted::SortedSet;

/// A change that was made while a run was recorded.
#[derive(Clone, Debug)]
pub(super) struct PastChange {
    /// Cycle after which it was made, or its time on the wall clock, ns.
    pub after: u64,
    /// Number of the changes that were made at once; 0 if it is not recorded.
    /// It counts those of the run.
    pub number: u32,
    pub change: Change,
}

impl PastChange {
    /// Returns true for a change that a module requested, and for its answer.
    fn is_requested(&self) -> bool {
        matches!(self.change, Change::Own { .. } | Change::Asked { .. })
    }
}

/// Returns the module that a change switches on or off, past the configuration.
fn switched(path: &str) -> Option<&str> {
    path.strip_suffix("/enabled").filter(|module| !module.contains('.'))
}

/// Returns the setting that a change sets or removes, and its new value.
/// `None` for a switch or an option of a link.
fn setting(change: &Change) -> Option<(&str, Option<&str>)> {
    match change {
        Change::Setting { path, .. } if switched(path).is_some() => None,
        Change::Setting { path, value: Some(value) } => Some((path, Some(value))),
        Change::Setting { path, value: None } if path.starts_with("links.") && linked(path).is_none() => None,
        Change::Setting { path, value: None } => Some((path, None)),
        _ => None,
    }
}

/// Returns the input that the path of a link leads to.
fn linked(path: &str) -> Option<&str> {
    path.strip_prefix("links.\"")?.strip_suffix('"').filter(|input| !input.contains('"'))
}

/// Settings that were changed at once, and are therefore changed at once again.
/// An input that loses its link has its value in the same moment.
#[derive(Default)]
struct Edit {
    taken_back: Vec<String>,
    set: Vec<(String, String)>,
}

impl Edit {
    /// Returns true if a setting can be changed together with those already there.
    /// All removals come first.
    fn fits(&self, (path, value): (&str, Option<&str>)) -> bool {
        let concerns = |set: &str| set == path || is_below(set, path) || is_below(path, set);
        value.is_some() || !self.set.iter().any(|(set, _)| concerns(set))
    }

    fn add(&mut self, (path, value): (&str, Option<&str>)) {
        match value {
            Some(value) => self.set.push((path.to_owned(), value.to_owned())),
            None => self.taken_back.push(path.to_owned()),
        }
    }

    fn make(self, agent: &Agent) -> Result<(), String> {
        let Self { taken_back, mut set } = self;
        let database = database(agent)?;
        let paths: Vec<&str> = taken_back.iter().map(String::as_str).collect();
        let propose = |set: &[(String, String)]| {
            database.propose_instead(&paths, set).map_err(|report| report.to_string())
        };
        let mut proposal = propose(&set)?;
        // A link that a file has is overlaid.
        let links = proposal.configuration().links();
        let stays = |path: &&String| {
            linked(path).is_some_and(|input| links.iter().any(|link| link.to.value == input))
        };
        let is_set = |path: &&String| set.iter().any(|(own, _)| own == *path);
        let overlaid: Vec<_> = taken_back.iter().filter(stays).filter(|path| !is_set(path)).collect();
        if !overlaid.is_empty() {
            let removed = overlaid.into_iter().map(|path| (path.clone(), "false".to_owned()));
            // A value set instead of a link comes after it.
            set.splice(0..0, removed);
            proposal = propose(&set)?;
        }
        proposal.commit().map(drop).map_err(|report| report.to_string())
    }
}

/// Returns true if a path is that of a setting within another path.
fn is_below(path: &str, other: &str) -> bool {
    path.strip_prefix(other).is_some_and(|rest| rest.starts_with('.'))
}

/// Repeats and removes the changes until a cycle or time, `until`.
/// Each is made after the cycle of its number, or at its time; messages name the present one as `moment`.
///
/// # Errors
/// Why one of them can't be made.
pub(super) fn make_until(
    agent: &Agent,
    changes: &mut VecDeque<PastChange>,
    until: u64,
    moment: &str,
) -> Result<(), String> {
    let mut edit = Edit::default();
    while let Some(PastChange { number, change, .. }) = changes.pop_front_if(|own| own.after <= until) {
        let made = match setting(&change) {
            Some(own) => {
                edit.add(own);
                let next = changes.front().filter(|next| next.after <= until && next.number == number);
                if next.and_then(|next| setting(&next.change)).is_some_and(|next| edit.fits(next)) {
                    continue;
                }
                std::mem::take(&mut edit).make(agent)
            }
            None => make(agent, &change),
        };
        made.map_err(|error| format!("a change {moment} can't be made again: {error}"))?;
    }
    Ok(())
}

/// Changes after one cycle, in their place among those that modules request.
pub(super) struct CycleChanges<'a> {
    changes: &'a mut VecDeque<PastChange>,
    cycle: u64,
    /// True once the rerun carries out a request.
    has_request: bool,
}

impl<'a> CycleChanges<'a> {
    pub fn new(changes: &'a mut VecDeque<PastChange>, cycle: u64) -> Self {
        Self { changes, cycle, has_request: false }
    }

    /// Repeats the changes that came before the next request of a module.
    /// The module makes those that it requests itself.
    ///
    /// # Errors
    /// Why one of them can't be made.
    pub fn make_before_request(&mut self, agent: &Agent) -> Result<(), String> {
        let cycle = self.cycle;
        let due = || self.changes.iter().take_while(move |own| own.after <= cycle);
        // The answer to a request is behind its changes.
        let is_answer = |own: &PastChange| matches!(own.change, Change::Asked { .. });
        let answered = if self.has_request { due().position(is_answer).map_or(0, |at| at + 1) } else { 0 };
        let rest = due().skip(answered);
        let count = answered + rest.take_while(|own| !own.is_requested()).count();
        self.has_request = true;
        let mut made = self.changes.drain(..count).collect();
        make_until(agent, &mut made, self.cycle, &after_cycle(self.cycle))
    }

    /// Repeats all that are left.
    ///
    /// # Errors
    /// Why one of them can't be made.
    pub fn make_rest(self, agent: &Agent) -> Result<(), String> {
        make_until(agent, self.changes, self.cycle, &after_cycle(self.cycle))
    }
}

/// Names the moment after a cycle in messages.
pub(super) fn after_cycle(cycle: u64) -> String {
    format!("after cycle {cycle}")
}

fn database(agent: &Agent) -> Result<&Database, String> {
    agent.database().ok_or_else(|| "the agent was loaded without a database".into())
}

fn make(agent: &Agent, change: &Change) -> Result<(), String> {
    let composer = agent.composer();
    match change {
        Change::Setting { path, value: Some(value) } => {
            let module = switched(path).unwrap_or_default();
            composer.enable(module, value == "true").map_err(|error| error.to_string())
        }
        Change::Setting { path, value: None } if path.starts_with("links.") => {
            database(agent)?.set(&[(path, "false")]).map(drop).map_err(|report| report.to_string())
        }
        Change::Setting { path, value: None } => {
            database(agent)?.take_back(path).map(drop).map_err(|report| report.to_string())
        }
        Change::Reload { plugin, file, hash } => {
            composer.reload(plugin, Some(file)).map_err(|error| error.to_string())?;
            let marks = composer.plugin_marks();
            let is_same = marks.iter().any(|mark| mark.name == *plugin && mark.hash == *hash);
            let file = slate_runtime::printable(file);
            if is_same { Ok(()) } else { Err(format!("{file} is another library than it was then")) }
        }
        Change::Load { name, file, hash } => {
            let loaded = match file {
                Some(file) => composer.load_library(file),
                None => composer.load(name),
            };
            let loaded = loaded.map_err(|error| error.to_string())?;
            let marks = composer.plugin_marks().into_iter();
            let came = |name: &str| loaded.plugins.iter().any(|(own, file)| own == name && file.is_some());
            let codes = marks.filter(|mark| came(&mark.name)).map(|mark| mark.hash);
            let is_same = codes.fold(0, u64::wrapping_add) == *hash;
            if is_same { Ok(()) } else { Err("a library is another one than it was then".into()) }
        }
        Change::Unload { name } => composer.unload(name).map(drop).map_err(|error| error.to_string()),
        Change::Stop { reason } => {
            composer.stop_actuators(reason);
            Ok(())
        }
        Change::Reset => {
            composer.reset();
            Ok(())
        }
        // Whether they were all armed is seen from what they get.
        Change::Arm { actuator: None } => {
            composer.arm();
            Ok(())
        }
        Change::Arm { actuator: Some(name) } => {
            composer.arm_one(name).map(drop).ok_or_else(|| format!("no actuator is called `{name}`"))
        }
        // A module makes them itself, or they follow from others.
        Change::Own { .. } | Change::Asked { .. } | Change::Order { .. } => Ok(()),
        Change::Other { what } => Err(what.clone()),
    }
}

/// Converts a change for modules that run without the one that has made it.
pub(super) fn played(change: Change) -> Change {
    match change {
        Change::Own { path, value, .. } => Change::Setting { path, value },
        other => other,
    }
}

/// Returns true if a change concerns the given modules, plugins or gates.
/// For plugins, these are changes of their code.
pub(super) fn concerns(
    change: &Change,
    modules: &SortedSet<String>,
    plugins: &SortedSet<String>,
    gates: &SortedSet<String>,
    excerpt: &Excerpt,
) -> bool {
    let (path, value) = match change {
        Change::Setting { path, value } => (path, value),
        Change::Order { .. } => return true,
        Change::Reload { plugin: name, .. } | Change::Load { name, .. } | Change::Unload { name } => {
            return plugins.contains(name);
        }
        // Commands and outputs of a gate are compared, so the rerun repeats its stops.
        Change::Stop { .. } | Change::Reset | Change::Arm { actuator: None } => return !gates.is_empty(),
        Change::Arm { actuator: Some(name) } => return gates.contains(name),
        _ => return false,
    };
    if let Some((to, rest)) = link(path) {
        let owns = |path: &str| modules.iter().any(|module| path != module && is_within(path, module));
        return match rest.strip_prefix(".\"/") {
            // Messages belong to their sender.
            Some(sender) => owns(sender),
            // Without a link no module sends there.
            None if value.as_deref().is_none_or(|value| value == "false") => {
                owns(to) || excerpt.outboxes.values().any(|inbox| inbox == to)
            }
            // Messages taken there are sent there again.
            None => owns(to) && !excerpt.inboxes.contains(to),
        };
    }
    let names = |module: &String| {
        let own = [format!("modules.\"{module}\"."), format!("modules.{module}.")];
        own.iter().any(|own| path.starts_with(own.as_str())) || *path == format!("{module}/enabled")
    };
    modules.iter().any(names)
}

/// Returns the changes of the readers' links for a change of an input's link.
/// The readers are modules that run and read by the name of that input.
pub(super) fn of_readers(change: &Change, excerpt: &Excerpt) -> Vec<Change> {
    let Change::Setting { path, value } = change else { return Vec::new() };
    let Some(readers) =
        link(path).filter(|(_, rest)| rest.is_empty()).and_then(|(to, _)| excerpt.aliases.get(to))
    else {
        return Vec::new();
    };
    let with = |field: &str| {
        let value = value.as_ref()?;
        Some(value.strip_suffix('"').map_or_else(|| value.clone(), |url| format!("{url}{field}\"")))
    };
    let own = |(to, field): &(String, String)| Change::Setting {
        path: format!("links.\"{to}\""),
        value: with(field),
    };
    readers.iter().map(own).collect()
}

/// Returns the destination of a link setting, and the rest of its path.
/// The rest is empty, an option, or a sender.
fn link(path: &str) -> Option<(&str, &str)> {
    path.strip_prefix("links.\"")?.split_once('"')
}
