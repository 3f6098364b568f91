//! What an agent knows, as a tree.

use clap::Args;
use clap_complete::ArgValueCompleter;
use serde_json::{Map, Value, json};
use slate::control::{PropertyEntry, Watched};

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::property::in_a_line;
use crate::{complete, output};

#[derive(Debug, Args)]
pub struct TreeOptions {
    /// Which properties, such as `/r2/**`; all unless given.
    #[arg(add = ArgValueCompleter::new(complete::of_properties))]
    pattern: Option<String>,

    /// How many levels are shown.
    #[arg(long, value_name = "LEVELS", value_parser = clap::value_parser!(u8).range(1..))]
    depth: Option<u8>,

    /// Shows the newest values.
    #[arg(long)]
    values: bool,

    /// Shows what properties are for.
    #[arg(long)]
    docs: bool,

    /// Prints the tree as JSON.
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    agent: AgentOption,
}

/// A name and what is below it.
#[derive(Default)]
struct Node {
    property: Option<(PropertyEntry, Option<Value>)>,
    below: std::collections::BTreeMap<String, Node>,
}

/// Prints the tree.
pub fn tree(options: &TreeOptions) -> Result<bool, Failure> {
    let pattern = options.pattern.as_deref();
    let mut client = options.agent.connect_for(pattern.unwrap_or_default())?;
    let root = match pattern.and_then(|pattern| pattern.strip_prefix("slate://")?.split('/').next()) {
        Some(agent) => format!("slate://{agent}/"),
        None => "/".into(),
    };
    let properties = client.properties(pattern)?;
    let mut values: Vec<Option<Value>> = vec![None; properties.len()];
    if options.values || options.json {
        let has_value: Vec<_> =
            properties.iter().enumerate().filter(|(_, property)| property.access != "messages").collect();
        let url = |property: &PropertyEntry| format!("{root}{}", property.path);
        let of: Vec<_> =
            has_value.iter().map(|(_, property)| Watched { url: url(property), after: None }).collect();
        for news in client.watch(&of, std::time::Duration::ZERO)? {
            if let Some((index, _)) = has_value.get(news.of) {
                values[*index] = news.readings.into_iter().next_back().map(|reading| reading.value);
            }
        }
    }
    let mut top = Node::default();
    for (property, value) in properties.into_iter().zip(values) {
        let mut node = &mut top;
        for name in property.path.split('/') {
            node = node.below.entry(name.to_owned()).or_default();
        }
        node.property = Some((property, value));
    }
    if options.json {
        output::json(&json!({"schema": "slate.tree/1", "root": root, "tree": as_json(&top)}));
        return Ok(true);
    }
    output::line(&root);
    let mut rows = Vec::new();
    draw(&top, "", options.depth.unwrap_or(u8::MAX), options, &mut rows);
    output::columns(rows);
    Ok(true)
}

fn as_json(node: &Node) -> Value {
    let mut entry = Map::new();
    if let Some((property, value)) = &node.property {
        for (name, text) in
            [("interface", &property.interface), ("access", &property.access), ("doc", &property.doc)]
        {
            entry.insert(name.into(), text.clone().into());
        }
        entry.insert("value".into(), value.clone().unwrap_or_default());
    }
    if !node.below.is_empty() {
        let below: Map<_, _> = node.below.iter().map(|(name, node)| (name.clone(), as_json(node))).collect();
        entry.insert("below".into(), below.into());
    }
    entry.into()
}

fn draw(node: &Node, indent: &str, depth: u8, options: &TreeOptions, rows: &mut Vec<[String; 4]>) {
    let last = node.below.len().saturating_sub(1);
    for (index, (name, below)) in node.below.iter().enumerate() {
        let (branch, further) = if index == last { ("└─ ", "   ") } else { ("├─ ", "│  ") };
        let hidden = if depth == 1 && !below.below.is_empty() { "/…" } else { "" };
        let mut row =
            [format!("{indent}{branch}{name}{hidden}"), String::new(), String::new(), String::new()];
        if let Some((property, value)) = &below.property {
            row[1] = property.interface.clone();
            // What a module writes is the rule.
            row[2] = match property.access.as_str() {
                "setting" => "can be set".into(),
                "queue" => "takes a link".into(),
                "messages" => "takes messages".into(),
                _ => String::new(),
            };
            row[3] = match (options.values, options.docs, value) {
                (true, _, Some(value)) => in_a_line(value),
                (true, _, None) if property.access != "messages" => "never written".into(),
                (false, true, _) => property.doc.clone(),
                _ => String::new(),
            };
        }
        rows.push(row);
        if depth > 1 {
            draw(below, &format!("{indent}{further}"), depth - 1, options, rows);
        }
    }
}
