//! Properties of an agent as a tree.

use std::time::Duration;

use clap::Args;
use clap_complete::ArgValueCompleter;
use serde_json::{Map, Value, json};
use slate::control::{Client, PropertyEntry, Watched};
use slate_sorted::SortedMap;

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::value_text::in_a_line;
use crate::{complete, output, urls};

#[derive(Debug, Args)]
pub struct TreeOptions {
    /// Path whose subtree is shown, such as `/r2`,
    /// or a pattern such as `/*/planner/*` [default: all]
    #[arg(value_name = "PATH", add = ArgValueCompleter::new(complete::of_properties))]
    pattern: Option<String>,

    /// Show at most this many levels
    #[arg(long, value_name = "LEVELS", value_parser = clap::value_parser!(u8).range(1..))]
    depth: Option<u8>,

    /// Show the newest values
    #[arg(long)]
    values: bool,

    /// Show the documentation of the properties
    #[arg(long)]
    docs: bool,

    /// Print the tree as JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    agent: AgentOption,
}

/// Name in a path, with the property of that path and the names below.
#[derive(Default)]
struct PropertyNode {
    property: Option<(PropertyEntry, Option<Value>)>,
    below: SortedMap<String, PropertyNode>,
}

/// Prints the tree.
pub fn tree(options: &TreeOptions) -> Result<bool, Failure> {
    let path = options.pattern.as_deref().unwrap_or_default();
    let pattern = urls::subtree(path);
    let mut client = options.agent.connect_for(&pattern)?;
    let root = urls::root(path);
    let properties = urls::matching(&mut client, path)?;
    let values = match options.values || options.json {
        true => newest(&mut client, &root, &properties)?,
        false => vec![None; properties.len()],
    };
    let mut top = PropertyNode::default();
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
    // The subtree of a path starts at that path.
    let (mut node, mut head) = (&top, root.clone());
    if !path.contains('*') {
        let path = urls::path(path);
        for name in path.split('/') {
            node = node.below.get(name).unwrap_or(node);
        }
        head += path;
    }
    let mut rows = vec![row(&head, node, options)];
    draw(node, "", options.depth.unwrap_or(u8::MAX), options, &mut rows);
    output::columns(rows);
    Ok(true)
}

/// Reads the newest value of each property.
/// `None` for mailboxes and properties that were never written.
fn newest(
    client: &mut Client,
    root: &str,
    properties: &[PropertyEntry],
) -> Result<Vec<Option<Value>>, Failure> {
    let has_value = |(_, property): &(usize, &PropertyEntry)| property.access != "messages";
    let with_values: Vec<_> = properties.iter().enumerate().filter(has_value).collect();
    let watched = |(_, property): &(usize, &PropertyEntry)| Watched {
        url: format!("{root}{}", property.path),
        after: None,
    };
    let of: Vec<_> = with_values.iter().map(watched).collect();
    let mut values: Vec<Option<Value>> = vec![None; properties.len()];
    for news in client.watch(&of, Duration::ZERO)? {
        if let Some((index, _)) = with_values.get(news.of) {
            values[*index] = news.readings.into_iter().next_back().map(|reading| reading.value);
        }
    }
    Ok(values)
}

fn as_json(node: &PropertyNode) -> Value {
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

/// Returns the row of a node: name, interface, access, and value or documentation.
fn row(name: &str, node: &PropertyNode, options: &TreeOptions) -> [String; 4] {
    let mut row = [name.to_owned(), String::new(), String::new(), String::new()];
    if let Some((property, value)) = &node.property {
        row[1].clone_from(&property.interface);
        // Outputs are the rule and have no mark.
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
    row
}

fn draw(node: &PropertyNode, indent: &str, depth: u8, options: &TreeOptions, rows: &mut Vec<[String; 4]>) {
    let last = node.below.len().saturating_sub(1);
    for (index, (name, below)) in node.below.iter().enumerate() {
        let (branch, further) = if index == last { ("└─ ", "   ") } else { ("├─ ", "│  ") };
        let hidden = if depth == 1 && !below.below.is_empty() { "/…" } else { "" };
        rows.push(row(&format!("{indent}{branch}{name}{hidden}"), below, options));
        if depth > 1 {
            draw(below, &format!("{indent}{further}"), depth - 1, options, rows);
        }
    }
}
