//! Present configuration of an agent, in one text or layer by layer.

use std::path::{Path, PathBuf};

use crate::agent::composition::Composition;
use slate_composition::{DiagnosticCollector, described_limits, survey};
use slate_configuration::{Configuration, Layered, PluginEntry, SourceKind, Value, limit_setting};

/// Returns all settings, one per line, as they are now.
/// They include the settings of the command line and all changes since. Libraries of plugins have absolute paths, and
/// are loaded at the start if they are loaded now. Inferred links are no settings.
pub(super) fn of(composition: &Composition, agent: &str) -> String {
    whole(composition, agent, Vec::new())
}

/// Returns the same with inferred links and gate limits of RobotModels.
/// They appear as if written, for readers without inference.
pub(super) fn expanded(composition: &Composition, agent: &str) -> String {
    let configuration = &composition.configuration;
    let links = configuration.links().iter().filter(|link| link.is_inferred());
    let links = links.map(|link| configuration.link_line(link));
    whole(composition, agent, links.chain(limits(composition)).collect())
}

/// Returns the gates' limits that are not written, a line each.
fn limits(composition: &Composition) -> Vec<String> {
    let configuration = &composition.configuration;
    let survey = survey(configuration, &composition.catalogue, &mut DiagnosticCollector::new(configuration));
    let mut lines = Vec::new();
    for actuator in configuration.actuators() {
        for limit in described_limits(&survey, actuator).iter().flat_map(|described| &described.limits) {
            let setting = limit_setting(&actuator.name, &limit.field);
            lines.push(format!("{setting} = [{:?}, {:?}]", limit.low, limit.high));
        }
    }
    lines
}

fn whole(composition: &Composition, agent: &str, inferred: Vec<String>) -> String {
    // An empty path is one.
    let settings = composition.configuration.settings("").unwrap_or_default().into_iter();
    let settings = settings.filter(|setting| !is_distinguished(&setting.path));
    let configuration = &composition.configuration;
    let lines = settings.map(|setting| format!("{} = {}", setting.path, setting.value));
    text(composition, agent, lines.map(|line| beside(configuration, line)).chain(inferred))
}

/// Returns the settings layer by layer.
pub(super) fn layers(composition: &Composition, agent: &str) -> Layered {
    let configuration = &composition.configuration;
    Layered {
        files: text(
            composition,
            agent,
            configuration.file_lines(&is_distinguished).into_iter().map(|line| beside(configuration, line)),
        ),
        sets: configuration.lines_of(SourceKind::Set, &is_distinguished),
        changes: configuration.lines_of(SourceKind::Change, &is_distinguished),
    }
}

/// Returns true for a setting that is stored with its present value.
/// Its origin does not matter.
fn is_distinguished(path: &str) -> bool {
    path == "agent.name" || path.starts_with("plugins.")
}

/// Returns settings as text, with the agent's present name and plugins.
fn text(composition: &Composition, agent: &str, settings: impl Iterator<Item = String>) -> String {
    let configuration = &composition.configuration;
    let mut lines = vec![format!("agent.name = {}", quoted(agent))];
    lines.extend(settings);
    for module in configuration.modules().iter().filter(|module| configuration.is_loaded(module)) {
        lines.push(format!("modules.{}.kind = {}", quoted(&module.name), quoted(&module.kind)));
    }
    let is_loaded = |name: &str| composition.catalogue.plugin(name).is_some();
    for entry in configuration.plugins() {
        let name = quoted(&entry.name);
        match entry {
            PluginEntry { members: Some(members), .. } => {
                let members: Vec<_> = members.iter().map(|member| quoted(member)).collect();
                lines.push(format!("plugins.{name}.plugins = [{}]", members.join(", ")));
            }
            PluginEntry { file, .. } => {
                let origin = composition.plugins.origins.get(entry.name.value.as_str());
                let file = origin.map(|origin| &origin.file).or(file.as_deref());
                lines.extend(file.map(|file| format!("plugins.{name}.file = {}", path(file))));
                lines.push(format!("plugins.{name}.load = {}", is_loaded(&entry.name)));
            }
        }
    }
    let configured = |name: &str| configuration.plugins().iter().any(|entry| entry.name.value == name);
    for (name, origin) in composition.plugins.origins.iter().filter(|(name, _)| !configured(name)) {
        lines.push(format!("plugins.{}.file = {}", quoted(name), path(&origin.file)));
    }
    lines.push(String::new());
    lines.join("\n")
}

fn quoted(text: &str) -> String {
    Value::Text(text.into()).to_string()
}

fn path(file: &Path) -> String {
    let absolute: PathBuf = std::path::absolute(file).unwrap_or_else(|_| file.into());
    quoted(&absolute.to_string_lossy())
}

/// Returns the line of a setting.
/// A path relative to the file that contains it becomes relative to this folder.
fn beside(configuration: &Configuration, line: String) -> String {
    let from_here = || {
        let (name, _) = line.split_once(" = ")?;
        let keys = toml_edit::Key::parse(name).ok()?;
        let names: Vec<&str> = keys.iter().map(toml_edit::Key::get).collect();
        let is_path = matches!(
            names[..],
            ["modules", _, "memory"]
                | ["log", "targets", "file"]
                | ["log", "targets", "file", "path"]
                | ["record" | "snapshot", "file"]
                | ["share", "knowledge", "save"]
        );
        let value = configuration.value(name).filter(|_| is_path)?;
        let folder = configuration.folder_of(value.span);
        let written = value.as_str().filter(|_| !folder.as_os_str().is_empty())?;
        Some(format!("{name} = {}", path(&folder.join(written))))
    };
    from_here().unwrap_or(line)
}
