//! Drawing of a graph as other programs receive it.

use serde::{Deserialize, Serialize};

use super::layout::{GraphLayout, GroupBox};
use super::model::{Flow, GraphEdge, GraphNode, ModuleGraph, NodeKind};
use super::route::EdgeRoute;

/// Width and height of a node, pixels.
const NODE_SIZE: (f64, f64) = (150.0, 38.0);

/// Height at which a loop-closing edge starts and ends, as a fraction of a node's.
const LOOP_EDGE_HEIGHT: f64 = 0.75;

/// Distance of a label from the side of a node, pixels.
const LABEL_DISTANCE: f64 = 16.0;

/// Distance of the tip of an arrow from the node that it points to, pixels.
const TIP_DISTANCE: f64 = 2.0;

/// Graph with positions of its nodes, and one edge for all links of a pair.
/// Positions are in pixels.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DrawnGraph {
    /// Name of the agent.
    pub title: String,
    /// Width of the drawing.
    pub width: f64,
    /// Height of the drawing.
    pub height: f64,
    /// Width of a node.
    pub node_width: f64,
    /// Height of a node.
    pub node_height: f64,
    /// Nodes: modules, gates and the other ends of links.
    pub nodes: Vec<DrawnNode>,
    /// Edges.
    pub edges: Vec<DrawnEdge>,
    /// Boxes around the nodes of robots.
    pub groups: Vec<GroupBox>,
}

/// Node with its position.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DrawnNode {
    /// Name.
    pub name: String,
    /// Kind of the node.
    pub kind: NodeKind,
    /// Note: condition of a module, or the kind of another node.
    pub note: String,
    /// Robot that it belongs to; empty without one.
    pub group: String,
    /// Left border.
    pub x: f64,
    /// Upper border.
    pub y: f64,
}

/// Links from one node to another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DrawnEdge {
    /// Name of the node of the sources.
    pub from: String,
    /// Name of the node of the destinations.
    pub to: String,
    /// Loop-closing edge, which runs back to the left.
    pub back: bool,
    /// Line, as the attribute `d` of SVG.
    pub path: String,
    /// Position of a label at the source: x and y.
    pub start: (f64, f64),
    /// Position of a label at the destination: x and y.
    pub end: (f64, f64),
    /// Links.
    pub links: Vec<DrawnLink>,
}

/// Link of an edge.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DrawnLink {
    /// Source without the name of its node: a property, or an outbox.
    pub output: String,
    /// Destination without the name of its node: an input, or an inbox.
    pub input: String,
    /// Data of the link.
    pub flow: Flow,
    /// Implied link: from types and roles, in no file.
    pub inferred: bool,
}

impl DrawnGraph {
    /// Draws a graph as widely as fits into the given width and height.
    pub fn new(graph: &ModuleGraph, available: (f64, f64)) -> Self {
        let layout = GraphLayout::new(graph, &vec![NODE_SIZE; graph.nodes.len()], Some(available));
        let node = |(index, node): (usize, &GraphNode)| DrawnNode {
            name: node.name.clone(),
            kind: node.kind,
            note: node.note.clone(),
            group: graph.group(index).into(),
            x: layout.nodes[index].x,
            y: layout.nodes[index].y,
        };
        let mut edges: Vec<((usize, usize), DrawnEdge)> = Vec::new();
        for (edge, route) in graph.edges.iter().zip(&layout.routes) {
            let GraphEdge { from, to, output, input, flow, inferred } = edge.clone();
            let link = DrawnLink { output, input, flow, inferred };
            match edges.iter_mut().find(|(pair, _)| *pair == (from, to)) {
                Some((_, known)) => known.links.push(link),
                None => edges.push(((from, to), drawn(graph, &layout, edge, route, link))),
            }
        }
        Self {
            title: graph.title.clone(),
            width: layout.width,
            height: layout.height,
            node_width: NODE_SIZE.0,
            node_height: NODE_SIZE.1,
            nodes: graph.nodes.iter().enumerate().map(node).collect(),
            edges: edges.into_iter().map(|(_, edge)| edge).collect(),
            groups: layout.groups,
        }
    }

    /// Returns the graph without its positions.
    pub fn graph(self) -> ModuleGraph {
        let index = |name: &String| self.nodes.iter().position(|node| node.name == *name);
        let mut edges = Vec::new();
        for edge in &self.edges {
            let (Some(from), Some(to)) = (index(&edge.from), index(&edge.to)) else { continue };
            edges.extend(edge.links.iter().cloned().map(|link| {
                let DrawnLink { output, input, flow, inferred } = link;
                GraphEdge { from, to, output, input, flow, inferred }
            }));
        }
        let node = |DrawnNode { name, kind, note, .. }| GraphNode { name, kind, note };
        let nodes = self.nodes.into_iter().map(node).collect();
        ModuleGraph { title: self.title, nodes, edges }
    }
}

fn drawn(
    graph: &ModuleGraph,
    layout: &GraphLayout,
    edge: &GraphEdge,
    route: &EdgeRoute,
    link: DrawnLink,
) -> DrawnEdge {
    let (from, to) = (layout.nodes[edge.from], layout.nodes[edge.to]);
    let part = if route.is_back() { LOOP_EDGE_HEIGHT } else { 0.5 };
    let start = (from.x + NODE_SIZE.0, from.y + part * NODE_SIZE.1);
    let end = (to.x - TIP_DISTANCE, to.y + part * NODE_SIZE.1);
    DrawnEdge {
        from: graph.nodes[edge.from].name.clone(),
        to: graph.nodes[edge.to].name.clone(),
        back: route.is_back(),
        path: route.path(start, end),
        start: route.turn().unwrap_or((start.0 + LABEL_DISTANCE, start.1)),
        end: route.turn().unwrap_or((end.0 - LABEL_DISTANCE, end.1)),
        links: vec![link],
    }
}
