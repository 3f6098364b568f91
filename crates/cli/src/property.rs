//! What a running agent knows.

use serde_json::Value;
use slate::runtime::remote::PropertyEntry;
use slate::runtime::sharing::TEAM;

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::output;

/// Prints the newest value of a property or a field; false when it was never written.
pub fn get(agent: &AgentOption, url: &str, json: bool) -> Result<bool, Failure> {
    let reading = agent.connect_for(url)?.read(url)?;
    if json {
        output::json(&reading);
        return Ok(reading.is_some());
    }
    let Some(reading) = reading else {
        eprintln!("{url} was never written");
        return Ok(false);
    };
    let mut rows = Vec::new();
    flatten(String::new(), &reading.value, &mut rows);
    match &rows[..] {
        [[name, value]] if name.is_empty() => output::line(value),
        _ => output::columns(rows),
    }
    Ok(true)
}

/// A row for each number and text in a value, with its path.
fn flatten(path: String, value: &Value, rows: &mut Vec<[String; 2]>) {
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

/// Prints which properties there are.
pub fn list(agent: &AgentOption, pattern: Option<&str>, json: bool) -> Result<bool, Failure> {
    let properties = agent.connect_for(pattern.unwrap_or_default())?.properties(pattern)?;
    if json {
        output::json(&properties);
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
