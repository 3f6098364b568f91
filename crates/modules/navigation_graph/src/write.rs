//! Writing of graphs.

use std::fmt;
use std::fs;
use std::path::Path;

use crate::error::GraphFileError;
use crate::graph::{NavigationGraph, Properties};

/// Writes a graph to a file in an existing folder.
/// Connections that cross are marked.
///
/// # Errors
/// The file can't be written.
pub fn write_graph(file: &Path, graph: &NavigationGraph) -> Result<(), GraphFileError> {
    fs::write(file, graph.to_string()).map_err(|error| {
        let reason = format!("can't be written: {error}");
        GraphFileError { file: Some(file.into()), ..GraphFileError::new(reason) }
    })
}

/// YAML text of the graph.
impl fmt::Display for NavigationGraph {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "%YAML 1.2\n%TAG ! tag:fawkesrobotics.org,navgraph/\n---")?;
        writeln!(f, "graph-name: {}", quoted(&self.name))?;
        write_properties(f, "default-properties:", "  ", &self.default_properties)?;
        writeln!(f, "nodes:{}", if self.nodes.is_empty() { " []" } else { "" })?;
        for node in self.nodes() {
            let tag = if node.is_unconnected { "!unconnected\n    " } else { "" };
            let [x, y] = node.position;
            writeln!(f, "  - {tag}name: {}\n    pos: [{x}, {y}]", quoted(&node.name))?;
            write_properties(f, "    properties:", "      ", &node.properties)?;
        }
        writeln!(f, "connections:{}", if self.connections.is_empty() { " []" } else { "" })?;
        for connection in &self.connections {
            let tag = if connection.is_directed { "!dir" } else { "!allow-intersection" };
            writeln!(f, "  - {tag} [{}, {}]", quoted(&connection.from), quoted(&connection.to))?;
        }
        Ok(())
    }
}

fn write_properties(
    f: &mut fmt::Formatter<'_>,
    title: &str,
    indent: &str,
    properties: &Properties,
) -> fmt::Result {
    // A node with an insert-mode is connected already.
    let mut kept = properties.iter().filter(|(name, _)| *name != "insert-mode").peekable();
    if kept.peek().is_some() {
        writeln!(f, "{title}")?;
    }
    kept.try_for_each(|(name, value)| writeln!(f, "{indent}- {}: {}", quoted(name), quoted(value)))
}

/// Texts of JSON are texts of YAML.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}
