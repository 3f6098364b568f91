//! What a running agent knows.

use serde_json::{Value, json};
use slate::control::PropertyEntry;
use slate::runtime::sharing::TEAM;

use crate::connection::AgentOption;
use crate::failure::{Failure, NO_DATA};
use crate::output;

/// Prints the newest value of a property or a field; returns what the process ends with.
pub fn get(agent: &AgentOption, url: &str, json: bool) -> Result<u8, Failure> {
    let reading = agent.connect_for(url)?.read(url)?;
    if json {
        let (value, sequence, time) = match &reading {
            Some(reading) => (Some(&reading.value), Some(reading.sequence), Some(reading.time)),
            None => (None, None, None),
        };
        output::json(
            &json!({"schema": "slate.get/1", "url": url, "value": value, "sequence": sequence, "time": time}),
        );
        return Ok(if reading.is_some() { 0 } else { NO_DATA });
    }
    let Some(reading) = reading else {
        eprintln!("{url} was never written");
        return Ok(NO_DATA);
    };
    let mut rows = Vec::new();
    flatten(String::new(), &reading.value, &mut rows);
    match &rows[..] {
        [[name, value]] if name.is_empty() => output::line(value),
        _ => output::columns(rows),
    }
    Ok(0)
}

/// A row for each number and text in a value, with its path.
pub fn flatten(path: String, value: &Value, rows: &mut Vec<[String; 2]>) {
    let below = |name: &str| if path.is_empty() { name.to_owned() } else { format!("{path}/{name}") };
    match value {
        Value::Object(fields) if !fields.is_empty() => {
            fields.iter().for_each(|(name, value)| flatten(below(name), value, rows));
        }
        Value::Array(items) if items.iter().any(|item| item.is_object() || item.is_array()) => {
            let items = items.iter().enumerate();
            items.for_each(|(index, value)| flatten(below(&index.to_string()), value, rows));
        }
        Value::String(text) => rows.push([path, text.clone()]),
        other => rows.push([path, other.to_string()]),
    }
}

/// So many numbers and texts of a value are shown in a line.
const IN_A_LINE: usize = 24;

/// A value in a line, such as `x=0.3 y=1.2`.
pub fn in_a_line(value: &Value) -> String {
    let mut rows = Vec::new();
    flatten(String::new(), value, &mut rows);
    // Padding of interfaces.
    rows.retain(|[name, _]| name != "reserved" && !name.ends_with("/reserved"));
    let left = rows.len().saturating_sub(IN_A_LINE);
    let mut cells: Vec<String> = rows
        .into_iter()
        .take(IN_A_LINE)
        .map(|[name, cell]| {
            let cell = match cell.char_indices().nth(200) {
                Some((end, _)) => format!("{}…", &cell[..end]),
                None => cell,
            };
            if name.is_empty() { cell } else { format!("{name}={cell}") }
        })
        .collect();
    if left > 0 {
        cells.push(format!("… and {left} more"));
    }
    cells.join(" ")
}

/// Sets a parameter, an input without a link, or whether a module is on.
pub fn set(agent: &AgentOption, url: &str, value: &str, json: bool) -> Result<bool, Failure> {
    // What is no JSON is a text, such as the name of a constant.
    let value = serde_json::from_str(value).unwrap_or_else(|_| Value::String(value.into()));
    let changed = agent.connect_to(url)?.set_property(url, &value)?;
    if json {
        output::json(&json!({"schema": "slate.set/1", "url": url, "changed": changed}));
        return Ok(true);
    }
    crate::config::show_changes(&changed);
    Ok(true)
}

/// Prints which properties there are.
pub fn list(agent: &AgentOption, pattern: Option<&str>, json: bool) -> Result<bool, Failure> {
    let properties = agent.connect_for(pattern.unwrap_or_default())?.properties(pattern)?;
    if json {
        output::document("slate.list/1", &json!({ "properties": properties }));
        return Ok(true);
    }
    // As they are asked for: those of another agent by their whole URLs, and so what the team knows, which is below its name.
    let agent = pattern.and_then(|pattern| pattern.strip_prefix("slate://")?.split('/').next());
    let root = match agent {
        Some(TEAM) => "slate://".into(),
        Some(agent) => format!("slate://{agent}/"),
        None => "/".into(),
    };
    let row =
        |property: PropertyEntry| [format!("{root}{}", property.path), property.interface, property.doc];
    let head = ["property", "interface", "what it is for"].map(String::from);
    output::columns([head].into_iter().chain(properties.into_iter().map(row)));
    Ok(true)
}
