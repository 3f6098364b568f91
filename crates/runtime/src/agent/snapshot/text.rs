//! The configuration of an agent as it is, in one text.

use std::path::{Path, PathBuf};

use crate::agent::composition::Composition;
use crate::configuration::{PluginEntry, Value};

/// All settings, a line each, with what the command line has set and what was changed since. The libraries of plugins are
/// named by absolute paths, and loaded at the start if they are loaded now.
pub(super) fn of(composition: &Composition, agent: &str) -> String {
    let configuration = &composition.configuration;
    let mut lines = vec![format!("agent.name = {}", quoted(agent))];
    // An empty path is one.
    for setting in configuration.settings("").unwrap_or_default() {
        if setting.path != "agent.name" && !setting.path.starts_with("plugins.") {
            lines.push(format!("{} = {}", setting.path, setting.value));
        }
    }
    for module in configuration.modules().iter().filter(|module| configuration.is_loaded(module)) {
        lines.push(format!("modules.{}.plugin = {}", quoted(&module.name), quoted(&module.plugin)));
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
                let origin = composition.origins.get(entry.name.value.as_str());
                let file = origin.map(|origin| &origin.file).or(file.as_deref());
                lines.extend(file.map(|file| format!("plugins.{name}.file = {}", path(file))));
                lines.push(format!("plugins.{name}.load = {}", is_loaded(&entry.name)));
            }
        }
    }
    let configured = |name: &str| configuration.plugins().iter().any(|entry| entry.name.value == name);
    for (name, origin) in composition.origins.iter().filter(|(name, _)| !configured(name)) {
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
