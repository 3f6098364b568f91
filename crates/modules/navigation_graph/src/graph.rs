//! Nodes and connections.

use slate_module::math;
use slate_sorted::SortedMap;

use crate::error::GraphError;

/// Properties by name; those without a value are `true`.
pub type Properties = SortedMap<String, String>;

/// Named place.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NavigationNode {
    /// Name, unique in the graph.
    pub name: String,
    /// Position in the map frame, m.
    pub position: [f64; 2],
    /// True if the node stays without a connection.
    /// For example, a place that is only looked at.
    pub is_unconnected: bool,
    /// Properties, such as `orientation`, rad, or `travel_tolerance`, m.
    pub properties: Properties,
}

/// Connection of two nodes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NavigationEdge {
    /// First node.
    pub from: String,
    /// Second node.
    pub to: String,
    /// Direction: true if it leads only from the first to the second.
    pub is_directed: bool,
}

/// Topological map. Each connection is between nodes of the graph.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NavigationGraph {
    /// Name of the graph.
    pub name: String,
    /// Properties of nodes that do not have their own.
    pub default_properties: Properties,
    pub(crate) nodes: SortedMap<String, NavigationNode>,
    pub(crate) connections: Vec<NavigationEdge>,
}

impl NavigationGraph {
    /// Returns a graph without nodes.
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), ..Self::default() }
    }

    /// Adds a node.
    ///
    /// # Errors
    /// A node of that name exists, or the position is not finite.
    pub fn add_node(&mut self, node: NavigationNode) -> Result<(), GraphError> {
        if node.position.iter().any(|number| !number.is_finite()) {
            return Err(GraphError(format!("node `{}`: expected a finite position", node.name)));
        }
        if self.nodes.contains_key(&node.name) {
            return Err(GraphError(format!("node `{}` exists twice: expected unique names", node.name)));
        }
        self.nodes.insert(node.name.clone(), node);
        Ok(())
    }

    /// Returns a node.
    pub fn node(&self, name: &str) -> Option<&NavigationNode> {
        self.nodes.get(name)
    }

    /// Nodes by name.
    pub fn nodes(&self) -> impl Iterator<Item = &NavigationNode> {
        self.nodes.values()
    }

    /// Connections in the order in which they were added.
    pub fn connections(&self) -> &[NavigationEdge] {
        &self.connections
    }

    /// Returns a property of a node, or the graph's default of it.
    pub fn property(&self, node: &str, name: &str) -> Option<&str> {
        let own = self.node(node)?.properties.get(name);
        own.or_else(|| self.default_properties.get(name)).map(String::as_str)
    }

    /// Returns the node that is nearest to a point, of those that can be driven to.
    pub fn nearest_node(&self, point: [f64; 2]) -> Option<&NavigationNode> {
        let connected = self.nodes.values().filter(|node| !node.is_unconnected);
        connected.min_by(|a, b| distance(a.position, point).total_cmp(&distance(b.position, point)))
    }

    /// Returns pairs of start and goal without a route.
    /// One of each is the first node by name; empty if routes lead from every node to every other one.
    pub fn unreachable(&self) -> Vec<(String, String)> {
        let connected = || self.nodes.values().filter(|node| !node.is_unconnected);
        let Some(first) = connected().next() else { return Vec::new() };
        let pairs = connected().flat_map(|node| [(first, node), (node, first)]);
        let missing = pairs.filter(|(from, to)| self.route(&from.name, &to.name).is_none());
        missing.map(|(from, to)| (from.name.clone(), to.name.clone())).collect()
    }

    pub(crate) fn position(&self, name: &str) -> [f64; 2] {
        self.nodes.get(name).map_or([f64::NAN; 2], |node| node.position)
    }

    pub(crate) fn length(&self, from: &str, to: &str) -> f64 {
        distance(self.position(from), self.position(to))
    }
}

pub(crate) fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    math::hypot(a[0] - b[0], a[1] - b[1])
}
