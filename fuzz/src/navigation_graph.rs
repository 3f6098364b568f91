//! Navigation graphs as YAML.

use slate_navigation_graph::NavigationGraph;

use crate::memory::within;

/// Reads a graph; one that is valid is written and read as the same.
pub fn run(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let Ok(graph) = within((1 << 20) + 4096 * bytes.len(), || text.parse::<NavigationGraph>()) else { return };
    let mut again: NavigationGraph = graph.to_string().parse().expect("it was written here");
    // A node whose `insert-mode` is done is written without it.
    let nodes = |graph: &NavigationGraph| graph.nodes().map(|node| (node.name.clone(), node.position)).collect::<Vec<_>>();
    assert_eq!(nodes(&again), nodes(&graph), "another graph came out");
    again.name.clone_from(&graph.name);
    assert_eq!(again.connections().len(), graph.connections().len(), "connections were lost");
}
