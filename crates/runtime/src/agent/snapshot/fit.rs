//! Check that an agent can restore a snapshot, before any change.

use std::sync::Arc;

use slate_blackboard::{Board, Placement};
use slate_sorted::{SortedMap, SortedSet};

use super::apply::at;
use super::capture::{SnapshotSubject, marks};
use crate::agent::assembly::Relinking;
use crate::agent::composition::Composition;
use crate::snapshot::{PluginMark, PortSnapshot, Snapshot, SnapshotImage};
use slate_configuration::{Configuration, Table, TableEntry, Value};
use slate_engine::main_loop::SharedLoop;

/// Returns all mismatches in words, except those of properties.
pub(super) fn problems(
    composition: &Composition,
    subjects: &[SnapshotSubject],
    snapshot: &Snapshot,
    shared: &SharedLoop,
) -> Vec<String> {
    let mut problems = Vec::new();
    plugins(composition, snapshot, &mut problems);
    modules(subjects, &snapshot.image, &mut problems);
    if snapshot.image.clock.driven != shared.clock.is_driven() {
        let clock = |driven| if driven { "a time source" } else { "the system's clock" };
        let (then, now) = (clock(snapshot.image.clock.driven), clock(shared.clock.is_driven()));
        problems.push(format!("it went by {then}, and this agent goes by {now}"));
    }
    let gates = shared.actuators();
    let names: Vec<&str> = gates.iter().map(|actuator| actuator.name()).collect();
    let saved = &snapshot.image.actuators;
    differing(names.iter().copied(), saved.keys().map(String::as_str), "actuator", &mut problems);
    for actuator in gates.iter() {
        if saved.get(actuator.name()).is_some_and(|saved| !actuator.fits(saved)) {
            problems.push(format!("actuator `{}` has other commanders or limits", actuator.name()));
        }
    }
    for (name, saved) in &snapshot.image.application_states {
        if let Some(state) = composition.snapshots.application_states.get(name)
            && let Err(error) = state.restore(&saved.0)
        {
            problems.push(format!("the saved state `{name}` can't be read: {error}"));
        }
    }
    problems
}

/// Returns the names that only one of the two has.
fn differing<'a>(
    here: impl Iterator<Item = &'a str>,
    there: impl Iterator<Item = &'a str>,
    what: &str,
    problems: &mut Vec<String>,
) {
    let (here, there): (SortedSet<_>, SortedSet<_>) = (here.collect(), there.collect());
    problems.extend(there.difference(&here).map(|name| format!("{what} `{name}` is not here")));
    problems.extend(here.difference(&there).map(|name| format!("{what} `{name}` is not in it")));
}

fn plugins(composition: &Composition, snapshot: &Snapshot, problems: &mut Vec<String>) {
    let here = marks(composition);
    for there in snapshot.plugins() {
        match here.iter().find(|mark| mark.name == there.name) {
            None => problems.push(format!("plugin `{}` is not loaded", there.name)),
            Some(here) if here.version != there.version => problems.push(format!(
                "plugin `{}` has version {} here and {} in it",
                there.name, here.version, there.version
            )),
            _ => {}
        }
    }
}

/// Returns plugins of the same version with other code.
pub(super) fn other_code(composition: &Composition, snapshot: &Snapshot) -> Vec<String> {
    let differs = |here: &PluginMark| {
        snapshot.plugins().iter().any(|there| there.name == here.name && there.hash != here.hash)
    };
    marks(composition).into_iter().filter(differs).map(|mark| mark.name).collect()
}

fn modules(subjects: &[SnapshotSubject], image: &SnapshotImage, problems: &mut Vec<String>) {
    let names = subjects.iter().map(|subject| subject.name.as_str());
    differing(names, image.modules.keys().map(String::as_str), "module", problems);
    for subject in subjects {
        let Some(saved) = image.modules.get(&subject.name) else { continue };
        let name = &subject.name;
        if saved.kind != subject.kind {
            problems.push(format!("module `{name}` is a {} here and a {} in it", subject.kind, saved.kind));
        }
        if saved.params != subject.params {
            problems.push(format!("the parameters of module `{name}` have another schema"));
        }
        let own = subject.port_snapshots();
        let by_name = |ports: &[PortSnapshot]| -> SortedMap<String, PortSnapshot> {
            ports.iter().map(|port| (port.name.clone(), port.clone())).collect()
        };
        let (here, there) = (by_name(&own), by_name(&saved.ports));
        let keys = |ports: &SortedMap<String, PortSnapshot>| -> Vec<String> {
            ports.keys().map(|port| format!("{name}/{port}")).collect()
        };
        let (own_keys, its_keys) = (keys(&here), keys(&there));
        differing(own_keys.iter().map(String::as_str), its_keys.iter().map(String::as_str), "port", problems);
        for (port, here) in &here {
            if let Some(there) = there.get(port).filter(|there| *there != here) {
                problems.push(format!(
                    "port `{name}/{port}` is {} {:016x} here and {} {:016x} in it",
                    here.interface, here.schema, there.interface, there.schema
                ));
            }
        }
    }
}

/// Returns the properties that do not fit under the snapshot's links.
pub(super) fn properties(board: &Board, links: &Relinking, image: &SnapshotImage) -> Vec<String> {
    let mut problems = Vec::new();
    for (path, saved) in &image.properties {
        let property = match links.placement(path) {
            Some(Placement::Property(property)) => Some(Arc::clone(property)),
            Some(Placement::Alias { .. }) => None,
            None => at(board, path),
        };
        let Some(property) = property else {
            if saved.values.published() > 0 {
                problems.push(format!("there is no property /{path}"));
            }
            continue;
        };
        let own = property.descriptor();
        if own.hash != saved.schema {
            problems.push(format!(
                "/{path} is {} {:016x} here and {} {:016x} in it",
                own.name, own.hash, saved.interface, saved.schema
            ));
        } else if let Some(channel) = property.channel()
            && let Err(error) = saved.values.fits(channel.shape())
        {
            problems.push(format!("/{path}: {error}"));
        }
    }
    problems
}

/// Setting with different values in an agent and a snapshot.
/// The values are in the form of `--set`.
#[derive(Clone, Debug)]
pub(super) struct DifferentSetting {
    pub path: String,
    pub here: Option<String>,
    pub there: Option<String>,
}

impl DifferentSetting {
    /// Returns the differences between two configurations that affect states.
    /// The log is excluded, as are the end and the report of a run.
    pub fn between(here: &Configuration, there: &Configuration) -> Vec<Self> {
        let settings = |configuration: &Configuration| -> SortedMap<String, Value> {
            let all = configuration.settings("").unwrap_or_default();
            let counts = |path: &str| {
                let top = path.split('.').next().unwrap_or_default();
                matches!(top, "modules" | "actuators" | "time" | "world")
                    || matches!(path, "agent.seed" | "loop.period")
            };
            let counting = all.into_iter().filter(|setting| counts(&setting.path));
            let links = configuration.table("links").into_iter().flat_map(Table::iter);
            let link = |(to, entry): (&str, &TableEntry)| {
                (format!("links.{}", toml_edit::Key::new(to).display_repr()), entry.value.value.clone())
            };
            // One that was taken away is `false`.
            let links = links.map(link).filter(|(_, value)| *value != Value::Bool(false));
            let inferred = configuration.links().iter().filter(|link| link.is_inferred()).map(|link| {
                let source = || Value::Text(link.from.value.to_string());
                (link.setting().0, if link.carries_messages() { Value::Bool(true) } else { source() })
            });
            counting.map(|setting| (setting.path, setting.value)).chain(links).chain(inferred).collect()
        };
        let (here, there) = (settings(here), settings(there));
        let paths: SortedSet<&String> = here.keys().chain(there.keys()).collect();
        let text = |value: Option<&Value>| value.map(ToString::to_string);
        let all = paths.into_iter().map(|path| Self {
            path: path.clone(),
            here: text(here.get(path)),
            there: text(there.get(path)),
        });
        // A table without settings is as good as none.
        all.filter(|own| own.here != own.there && !own.is_empty_table()).collect()
    }

    fn is_empty_table(&self) -> bool {
        [&self.here, &self.there].into_iter().all(|text| text.as_deref().is_none_or(|text| text == "{}"))
    }

    /// Returns the property of the setting, if every snapshot contains it.
    /// This holds for parameters, `enabled` and inputs.
    pub fn property(&self) -> Option<String> {
        let keys = toml_edit::Key::parse(&self.path).ok()?;
        let names: Vec<&str> = keys.iter().map(toml_edit::Key::get).collect();
        match names[..] {
            ["modules", module, "params", ..] => Some(format!("{module}/params")),
            ["modules", module, "enabled"] => Some(format!("{module}/enabled")),
            ["modules", module, "inputs", port, ..] => Some(format!("{module}/{port}")),
            _ => None,
        }
    }

    /// Returns true for a link.
    pub fn is_link(&self) -> bool {
        self.path.starts_with("links.")
    }

    /// Returns the difference in words.
    pub fn describe(&self) -> String {
        let text = |text: &Option<String>| text.clone().unwrap_or_else(|| "not set".into());
        format!("{} is {} here and {} in it", self.path, text(&self.here), text(&self.there))
    }
}
