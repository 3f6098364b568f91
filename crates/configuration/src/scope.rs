use slate_blackboard::Url;
use slate_sorted::MapEntry as Slot;

use super::external::ExternalUrl;
use super::problems::Problems;
use super::senders;
use super::source::Spanned;
use super::value::{Table, TableEntry, Value};
use crate::error_code::ErrorCode;

/// Sections of a robot; the same sections at the top belong to the agent itself.
pub(super) const SECTIONS: [&str; 3] = ["modules", "links", "actuators"];

/// Moves the sections of `robots` to the top.
/// Names get the robot's as a prefix, and URLs become absolute.
///
/// Done for each layer before they are merged, so that a module may be named either way in any of them.
pub(super) fn flatten(layer: Table, problems: &mut Problems) -> Table {
    let mut flat = Table::default();
    let mut robots = None;
    for (name, entry) in layer.entries {
        match name.as_str() {
            "robots" => robots = Some(entry),
            section if SECTIONS.contains(&section) => move_section(&mut flat, "", section, entry, problems),
            _ => {
                flat.entries.insert(name, entry);
            }
        }
    }
    let Some(robots) = robots.as_ref().and_then(|robots| problems.as_table("robots", robots)) else {
        return flat;
    };
    for (robot, entry) in robots.iter() {
        if !problems.name("a robot", robot, false, entry.key) {
            continue;
        }
        let Some(sections) = problems.as_table(&format!("robots.{robot}"), entry) else { continue };
        problems.unknown_keys(sections, &format!("in [robots.{robot}]"), &SECTIONS);
        for section in SECTIONS {
            if let Some(entry) = sections.entries.get(section) {
                move_section(&mut flat, robot, section, entry.clone(), problems);
            }
        }
    }
    flat
}

fn move_section(flat: &mut Table, scope: &str, section: &str, from: TableEntry, problems: &mut Problems) {
    let title = if scope.is_empty() { section.into() } else { format!("robots.{scope}.{section}") };
    if problems.as_table(&title, &from).is_none() {
        return;
    }
    let Value::Table(table) = from.value.value else { return };
    let empty =
        TableEntry { key: from.key, value: Spanned::new(Value::Table(Table::default()), from.value.span) };
    let Value::Table(target) = &mut flat.entries.entry(section.into()).or_insert(empty).value.value else {
        return;
    };
    for (name, mut entry) in table.entries {
        let path = match section {
            "links" => destination(&name, scope, &entry, problems),
            "modules" if !problems.name("a module", &name, true, entry.key) => None,
            "actuators" if !problems.name("an actuator", &name, true, entry.key) => None,
            _ => Some(join(scope, &name)),
        };
        let Some(path) = path else { continue };
        match section {
            "links" => senders::make_table(&mut entry.value, &in_agent(scope), problems),
            "actuators" => {
                senders::make_commands(&mut entry.value, &in_agent(scope), problems);
                if let Value::Table(table) = &mut entry.value.value
                    && let Some(modules) = table.entries.get_mut("modules")
                {
                    each_text(&mut modules.value.value, &|name| {
                        Url::parse(name).ok().map(|url| url.path_in(scope))
                    });
                }
            }
            _ => {}
        }
        match target.entries.entry(path) {
            Slot::Occupied(slot) => {
                problems.add(
                    entry.key,
                    ErrorCode::Key.of(format!("`{}` is set twice in {section}", slot.key())),
                    "keep one of the two",
                );
            }
            Slot::Vacant(slot) => {
                slot.insert(entry);
            }
        }
    }
}

/// Returns the path of a link's destination, or the URL of an inbox.
/// The URL is for the inbox of another agent.
fn destination(key: &str, scope: &str, entry: &TableEntry, problems: &mut Problems) -> Option<String> {
    if ExternalUrl::parse(key).is_some() {
        return Some(key.to_owned());
    }
    problems.url(key, entry.key).map(|url| path_or_url(&url, scope))
}

fn path_or_url(url: &Url, scope: &str) -> String {
    if url.agent().is_some() { url.to_string() } else { url.path_in(scope) }
}

/// Makes URLs absolute; an invalid one stays as written, and its reader reports it.
pub(super) fn in_agent(scope: &str) -> impl Fn(&str) -> Option<String> {
    move |text| {
        let url = Url::parse(text).ok()?;
        let relative = url.agent().is_none() && url.path_in("").contains('/');
        relative.then(|| format!("/{}", url.path_in(scope)))
    }
}

/// Changes all texts of a value.
pub(super) fn each_text(value: &mut Value, change: &dyn Fn(&str) -> Option<String>) {
    match value {
        Value::Table(table) => {
            table.entries.values_mut().for_each(|entry| each_text(&mut entry.value.value, change));
        }
        Value::List(items) => items.iter_mut().for_each(|item| each_text(&mut item.value, change)),
        Value::Text(text) => {
            if let Some(changed) = change(text) {
                *text = changed;
            }
        }
        _ => {}
    }
}

/// Returns the names that lead to a setting after [`flatten`].
pub(super) fn flatten_path(mut path: Vec<String>) -> Vec<String> {
    let mut scope = String::new();
    if path.len() > 2 && path[0] == "robots" && SECTIONS.contains(&path[2].as_str()) {
        path.remove(0);
        scope = path.remove(0);
    }
    if let [section, name, ..] = &mut path[..] {
        *name = flat_name(section, name, &scope);
    }
    let named = match &mut path[..] {
        [section, _, sender, ..] if section == "links" && sender.contains('/') => Some(sender),
        [section, _, list, command, ..] if section == "actuators" && list == "commands" => Some(command),
        _ => None,
    };
    if let Some(named) = named
        && let Some(whole) = in_agent(&scope)(named)
    {
        *named = whole;
    }
    path
}

/// Returns the name in a section after [`flatten`].
/// `scope` is the robot in whose section the name is written; empty for none.
pub(super) fn flat_name(section: &str, name: &str, scope: &str) -> String {
    match (section, Url::parse(name)) {
        ("links", Ok(url)) => path_or_url(&url, scope),
        ("modules" | "actuators", _) => join(scope, name),
        _ => name.into(),
    }
}

/// Returns a value as written in the scope of a robot.
/// Its own URLs are without the robot's name.
pub(super) fn in_scope(path: &[String], value: &Value, scope: &str) -> Value {
    let path: Vec<&str> = path.iter().map(String::as_str).collect();
    let url =
        matches!(path[..], ["links", _] | ["links", _, "from"] | ["actuators", _, "command" | "commands"]);
    let mut value = value.clone();
    if url && !scope.is_empty() {
        let start = format!("/{scope}/");
        // A name alone is not a property, and so would not be relative.
        each_text(&mut value, &|text| {
            text.strip_prefix(&start).filter(|short| short.contains('/')).map(str::to_owned)
        });
    }
    if matches!(path[..], ["actuators", _, "modules"]) && !scope.is_empty() {
        each_text(&mut value, &|name| {
            let own = name.strip_prefix(scope).and_then(|rest| rest.strip_prefix('/'));
            Some(own.map_or_else(|| format!("/{name}"), str::to_owned))
        });
    }
    value
}

fn join(scope: &str, name: &str) -> String {
    if scope.is_empty() { name.into() } else { format!("{scope}/{name}") }
}
