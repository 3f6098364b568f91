//! Paths of settings, as of `--set`.

use slate_blackboard::Url;

use super::diagnostic::{Diagnostic, Report};
use super::scope::{SECTIONS, flatten_path};

/// Returns the names of a path, as written.
///
/// Paths in the agent's own table lead to the same settings, if `agent` is one of several.
pub(super) fn names(path: &str, agent: Option<&str>) -> Result<Vec<String>, Report> {
    let keys = toml_edit::Key::parse(path).map_err(|error| {
        let message = format!("`{path}` is not a path: {}", error.message().trim());
        let help = "write names with dots between them, such as loop.period or log.levels.\"r2/planner\"";
        Diagnostic::without_place(message, Some(help.into()))
    })?;
    let mut names: Vec<_> = keys.iter().map(|key| key.get().to_owned()).collect();
    if agent.is_some_and(|agent| names.starts_with(&["agents".to_owned(), agent.to_owned()])) {
        names.drain(..2);
    }
    Ok(names)
}

/// Returns the text of a path, which reads as the same path.
pub(super) fn render(names: &[String]) -> String {
    let texts: Vec<String> =
        names.iter().map(|name| toml_edit::Key::new(name).display_repr().into_owned()).collect();
    texts.join(".")
}

/// Part of the settings: those at a path and below it.
#[derive(Clone, Debug)]
pub(super) struct Prefix(Vec<String>);

impl Prefix {
    /// Parses the path of a part, possibly of a robot, such as `robots.r2`.
    /// An empty text selects all settings.
    pub(super) fn parse(path: &str, agent: Option<&str>) -> Result<Self, Report> {
        if path.trim().is_empty() {
            return Ok(Self(Vec::new()));
        }
        let names = names(path, agent)?;
        // Only a name inside a section of a robot has a form without it.
        let whole = names.first().is_some_and(|first| first == "robots") && names.len() <= 3;
        Ok(Self(if whole { names } else { flatten_path(names) }))
    }

    /// Returns true if the part contains a flat path.
    pub(super) fn holds(&self, path: &[String]) -> bool {
        path.starts_with(&self.0) || of_robot(path).is_some_and(|path| path.starts_with(&self.0))
    }
}

/// Returns a flat path as written inside of its robot; `None` without a robot.
fn of_robot(path: &[String]) -> Option<Vec<String>> {
    let [section, name, ..] = path else { return None };
    let (robot, name) = name.split_once('/').filter(|_| SECTIONS.contains(&section.as_str()))?;
    let start = ["robots", robot, section, name].map(String::from);
    Some(start.into_iter().chain(path[2..].iter().cloned()).collect())
}

/// Returns the path of a setting as written in its robot's table.
/// An example is `robots.r2.modules.planner`. Other paths are unchanged.
pub fn robot_setting(path: &str) -> String {
    let names = names(path, None).unwrap_or_default();
    of_robot(&names).map_or_else(|| path.to_owned(), |names| render(&names))
}

/// Returns the path of a link's setting.
pub fn link_setting(to: &str) -> String {
    format!("links.{}", toml_edit::Key::new(to).display_repr())
}

/// Returns the path of the limits of a field of a gate's command.
pub fn limit_setting(actuator: &str, field: &str) -> String {
    let [actuator, field] =
        [actuator, field].map(|name| toml_edit::Key::new(name).display_repr().into_owned());
    format!("actuators.{actuator}.limits.{field}")
}

/// Returns the path of one of the senders of an inbox.
pub fn sender_setting(to: &str, from: &str) -> String {
    format!("{}.{}", link_setting(to), toml_edit::Key::new(from).display_repr())
}

/// Returns the URL without a scope, and without the agent if it is this one.
pub(super) fn absolute(url: &Url, agent: &str) -> Url {
    if url.agent().is_some_and(|other| other != agent) {
        return url.clone();
    }
    Url::parse(&format!("/{}", url.path_in(""))).unwrap_or_else(|_| url.clone())
}
