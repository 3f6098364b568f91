//! Nodes and edges.

use serde::{Deserialize, Serialize};
use slate_runtime::configuration::ExternalUrl;
use slate_sorted::SortedSet;

/// Modules, gates and links of an agent.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ModuleGraph {
    /// Name of the agent or of its configuration.
    pub title: String,
    /// Nodes: modules, gates and the other ends of links.
    pub nodes: Vec<GraphNode>,
    /// Links.
    pub edges: Vec<GraphEdge>,
}

/// Module, a gate, or another end of links.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct GraphNode {
    /// Name.
    pub name: String,
    /// Kind of the node.
    pub kind: NodeKind,
    /// Note: stage or condition of a module, or the kind of another node.
    pub note: String,
}

/// Kind of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NodeKind {
    /// Module.
    Module,
    /// Gate of an actuator.
    Gate,
    /// Another agent, programs behind a bridge, or the host.
    Outside,
}

/// Link, by the indices of its two nodes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct GraphEdge {
    /// Node of the source.
    pub from: usize,
    /// Node of the destination.
    pub to: usize,
    /// Source without the name of its node: a property, or an outbox.
    pub output: String,
    /// Destination without the name of its node: an input, or an inbox.
    pub input: String,
    /// Data of the link.
    pub flow: Flow,
    /// Implied link: from types and roles, in no file.
    pub inferred: bool,
}

/// Data of a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Flow {
    /// Values of this cycle.
    Values,
    /// Messages.
    Messages,
    /// Values of the last cycle.
    Previous,
}

/// Link, by the URLs of its two ends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GraphLink {
    /// Destination: an input or an inbox.
    pub to: String,
    /// Source: a property or an outbox.
    pub from: String,
    /// Data of the line.
    pub flow: Flow,
    /// Implied link: from types and roles, in no file.
    pub inferred: bool,
}

impl GraphLink {
    /// Creates a link with the keys and values of its table.
    /// `sends` marks a link of messages.
    pub fn new(to: String, from: String, options: &[(String, String)], sends: bool, inferred: bool) -> Self {
        let is_previous = options.iter().any(|(name, value)| name == "previous" && value == "true");
        let flow = match (sends, is_previous) {
            (true, _) => Flow::Messages,
            (false, true) => Flow::Previous,
            (false, false) => Flow::Values,
        };
        Self { to, from, flow, inferred }
    }
}

impl ModuleGraph {
    /// Creates the graph of modules, links, actuators and command properties.
    /// Modules come with their notes.
    pub fn new(
        title: String,
        modules: Vec<(String, String)>,
        links: Vec<GraphLink>,
        actuators: Vec<(String, Vec<String>)>,
    ) -> Self {
        let mut graph = Self { title, ..Self::default() };
        let module = |(name, note)| GraphNode { name, kind: NodeKind::Module, note };
        graph.nodes = modules.into_iter().map(module).collect();
        let gate = |(name, _): &(String, Vec<String>)| GraphNode {
            name: name.clone(),
            kind: NodeKind::Gate,
            note: "gate".into(),
        };
        graph.nodes.extend(actuators.iter().map(gate));
        for GraphLink { to, from, flow, inferred } in links {
            let ((from, output), (to, input)) = (graph.end(&from), graph.end(&to));
            graph.edges.push(GraphEdge { from, to, output, input, flow, inferred });
        }
        for (name, commands) in actuators {
            let is_gate = |node: &GraphNode| node.kind == NodeKind::Gate && node.name == name;
            let Some(to) = graph.nodes.iter().position(is_gate) else { continue };
            for command in commands {
                let (from, output) = graph.end(&command);
                let (input, flow) = ("command".into(), Flow::Values);
                graph.edges.push(GraphEdge { from, to, output, input, flow, inferred: false });
            }
        }
        graph
    }

    /// Returns the robot of a node, by its name; empty without one.
    pub fn group(&self, node: usize) -> &str {
        match &self.nodes[node] {
            GraphNode { kind: NodeKind::Outside, .. } => "",
            GraphNode { name, .. } => name.split_once('/').map_or("", |(robot, _)| robot),
        }
    }

    /// Removes nodes by their names, with their edges.
    pub fn hide(&mut self, is_hidden: impl Fn(&str) -> bool) {
        let mut count = 0;
        let number = |node: &GraphNode| {
            let stays = !is_hidden(&node.name);
            count += usize::from(stays);
            stays.then(|| count - 1)
        };
        let numbers: Vec<Option<usize>> = self.nodes.iter().map(number).collect();
        self.nodes.retain(|node| !is_hidden(&node.name));
        self.edges.retain_mut(|edge| match (numbers[edge.from], numbers[edge.to]) {
            (Some(from), Some(to)) => {
                (edge.from, edge.to) = (from, to);
                true
            }
            _ => false,
        });
    }

    /// Returns the pairs of nodes along the data flow.
    /// A sender comes before the receiver of its messages, whose answer closes a loop, as does a value of the last
    /// cycle.
    pub(super) fn forward_pairs(&self) -> SortedSet<(usize, usize)> {
        let pairs = |flow| {
            let edges = self.edges.iter().filter(move |edge| edge.flow == flow);
            edges.map(|edge| (edge.from, edge.to)).collect::<SortedSet<_>>()
        };
        let sent = pairs(Flow::Messages);
        let answers =
            |(from, to): &(usize, usize)| sent.contains(&(*to, *from)) && !sent.contains(&(*from, *to));
        let values = pairs(Flow::Values).into_iter().filter(|pair| !answers(pair));
        values.chain(sent.iter().copied()).filter(|(from, to)| from != to).collect()
    }

    /// Returns the node that a URL leads to, and the rest of the URL after its name.
    fn end(&mut self, url: &str) -> (usize, String) {
        let path = match url.strip_prefix("slate://") {
            Some(rest) => {
                let (agent, path) = rest.split_once('/').unwrap_or((rest, ""));
                return (self.outside(&format!("slate://{agent}"), "another agent"), path.into());
            }
            None => url.trim_start_matches('/'),
        };
        if let Some(external) = ExternalUrl::parse(url) {
            return (self.outside(url, "outside of all agents"), external.address);
        }
        let owner = self.nodes.iter().enumerate().filter_map(|(index, node)| {
            let rest = path.strip_prefix(node.name.as_str())?.strip_prefix('/')?;
            Some((node.name.len(), index, rest.to_owned()))
        });
        match owner.max() {
            Some((_, index, rest)) => (index, rest),
            None => {
                let (first, rest) = path.split_once('/').unwrap_or((path, ""));
                (self.outside(first, "host"), rest.into())
            }
        }
    }

    fn outside(&mut self, name: &str, note: &str) -> usize {
        let is_it = |node: &GraphNode| node.kind == NodeKind::Outside && node.name == name;
        self.nodes.iter().position(is_it).unwrap_or_else(|| {
            self.nodes.push(GraphNode { name: name.into(), kind: NodeKind::Outside, note: note.into() });
            self.nodes.len() - 1
        })
    }
}
