//! Navigation graphs as YAML.

use slate_navigation_graph::{NavigationGraph, NavigationNode, Properties};

use crate::memory::within;

/// Reads a graph; one that is valid is written and read as the same.
pub fn run(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let Ok(graph) = within((1 << 20) + 4096 * bytes.len(), || text.parse::<NavigationGraph>()) else {
        return;
    };
    let again: NavigationGraph = graph.to_string().parse().expect("it was written here");
    let own = |properties: &Properties| {
        let mut properties = properties.clone();
        // The node is connected by then.
        properties.remove("insert-mode");
        properties
    };
    let nodes = |graph: &NavigationGraph| -> Vec<NavigationNode> {
        graph
            .nodes()
            .map(|node| NavigationNode { properties: own(&node.properties), ..node.clone() })
            .collect()
    };
    assert_eq!(nodes(&again), nodes(&graph), "other nodes came out");
    assert_eq!(again.connections(), graph.connections(), "other connections came out");
    assert_eq!(own(&again.default_properties), own(&graph.default_properties), "other defaults came out");
    assert_eq!(again.name, graph.name, "another name came out");
}
