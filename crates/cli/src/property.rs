//! Properties of a running agent.

use serde_json::{Value, json};
use slate::control::PropertyEntry;
use slate::runtime::sharing::TEAM;

use crate::changes::show_changes;
use crate::connection::AgentOption;
use crate::failure::{Failure, NO_DATA};
use crate::value_text::flatten;
use crate::{output, urls, value_input};

/// Prints the newest value of a property or a field; returns the exit code.
pub fn get(agent: &AgentOption, url: &str, json: bool) -> Result<u8, Failure> {
    let mut client = agent.connect_for(url)?;
    let reading = client.read(url).map_err(|error| urls::unknown(&mut client, url, error))?;
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
        eprintln!("{url}: never written");
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

/// Sets a parameter, an input without a link, or whether a module is on.
pub fn set(agent: &AgentOption, url: &str, value: &str, json: bool) -> Result<bool, Failure> {
    // Anything else is a text, such as the name of a constant.
    let value = value_input::parse(value).unwrap_or_else(|| Value::String(value.into()));
    let mut client = agent.connect_to(url)?;
    let changed = client.set_property(url, &value);
    let changed = changed.map_err(|error| value_input::refused(&mut client, "set", url, error))?;
    if json {
        output::json(&json!({"schema": "slate.set/1", "url": url, "changed": changed}));
        return Ok(true);
    }
    show_changes(&changed);
    Ok(true)
}

/// Prints the properties.
pub fn list(agent: &AgentOption, pattern: Option<&str>, json: bool) -> Result<bool, Failure> {
    let pattern = pattern.unwrap_or_default();
    let mut client = agent.connect_for(&urls::subtree(pattern))?;
    let properties = urls::matching(&mut client, pattern)?;
    if json {
        output::document("slate.list/1", &json!({ "properties": properties }));
        return Ok(true);
    }
    // In the form of the request: those of another agent by their whole URLs, and so what the team knows, which is below its name.
    let root = if urls::agent(pattern) == Some(TEAM) { "slate://".into() } else { urls::root(pattern) };
    let row =
        |property: PropertyEntry| [format!("{root}{}", property.path), property.interface, property.doc];
    let head = ["property", "interface", "description"].map(String::from);
    output::columns([head].into_iter().chain(properties.into_iter().map(row)));
    Ok(true)
}
