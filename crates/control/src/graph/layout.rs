//! Layered layout of a module graph (Sugiyama).
//! Columns follow the data flow; each robot has a lane.
//!
//! Own code: `rust-sugiyama` returns positions of nodes alone, and knows neither lanes nor the place of an edge that passes a
//! column.

use serde::{Deserialize, Serialize};
use slate_module::math::{clamp, max};
use slate_sorted::SortedMap;

use super::layering::{Lane, Layering, MARGIN, TITLE_HEIGHT, TRACK_SPACING};
use super::model::{GraphEdge, ModuleGraph};
use super::route::EdgeRoute;

/// Least and greatest distance between columns, and between the nodes of a column.
const COLUMN_GAP: (f64, f64) = (36.0, 120.0);
const NODE_GAP: (f64, f64) = (9.0, 50.0);

/// Gap of free columns, without a limit on the size of the drawing.
const FREE_COLUMN_GAP: f64 = 96.0;
const FREE_NODE_GAP: f64 = 18.0;

/// Around the nodes of a group.
const PADDING: f64 = 30.0;

/// Upper left corner of a node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodePosition {
    /// Pixels from the left.
    pub x: f64,
    /// Pixels from the top.
    pub y: f64,
    /// Column, from the left.
    pub column: usize,
}

/// Box around the nodes of a robot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GroupBox {
    /// Name of the robot.
    pub name: String,
    /// Left border.
    pub x: f64,
    /// Upper border.
    pub y: f64,
    /// Width.
    pub width: f64,
    /// Height.
    pub height: f64,
}

/// Positions of the nodes and routes of the edges of a graph, in pixels.
///
/// No two nodes overlap, and no edge lies behind a node. An edge that closes a loop runs back below the group of its
/// destination.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GraphLayout {
    /// Positions, in the order of the nodes.
    pub nodes: Vec<NodePosition>,
    /// Routes, in the order of the edges.
    pub routes: Vec<EdgeRoute>,
    /// Boxes around the nodes of robots.
    pub groups: Vec<GroupBox>,
    /// Width of the drawing.
    pub width: f64,
    /// Height of the drawing.
    pub height: f64,
}

impl GraphLayout {
    /// Lays out nodes of these widths and heights.
    /// As widely as fits into a drawing of the given width and height.
    pub fn new(graph: &ModuleGraph, sizes: &[(f64, f64)], available: Option<(f64, f64)>) -> Self {
        if graph.nodes.is_empty() {
            return Self { width: 2.0 * MARGIN, height: 2.0 * MARGIN, ..Self::default() };
        }
        let mut layering = Layering::new(graph, sizes);
        layering.add_edges();
        layering.order();
        let gap = layering.node_gap(available);
        let mut top = MARGIN;
        for lane in &mut layering.lanes {
            lane.top = top + lane.title_height();
            lane.height = lane.needed_height(&layering.slots, gap);
            top = lane.top + lane.height + lane.tracks_height() + lane.margin();
        }
        layering.settle(gap);
        layering.finish(top + MARGIN / 2.0, available)
    }
}

impl Layering<'_> {
    /// Returns the gap between nodes at which the drawing has the permitted height.
    fn node_gap(&self, available: Option<(f64, f64)>) -> f64 {
        let Some((_, height)) = available else { return FREE_NODE_GAP };
        let needed = |gap: f64| {
            let lanes = self.lanes.iter().map(|lane| {
                let own = lane.needed_height(&self.slots, gap) + lane.tracks_height();
                own + lane.title_height() + lane.margin()
            });
            lanes.sum::<f64>() + 2.0 * MARGIN
        };
        let (least, most) = NODE_GAP;
        let mut gap = most;
        while gap > least && needed(gap) > height {
            gap -= 1.0;
        }
        gap
    }

    fn finish(self, height: f64, available: Option<(f64, f64)>) -> GraphLayout {
        let count = self.columns.iter().max().map_or(0, |last| last + 1);
        let mut widths = vec![0.0; count];
        for (node, column) in self.columns.iter().enumerate() {
            widths[*column] = max(widths[*column], self.sizes[node].0);
        }
        let used = widths.iter().sum::<f64>() + 2.0 * (MARGIN + PADDING);
        let fits = |(width, _): (f64, f64)| (width - used) / max(1.0, count as f64 - 1.0);
        let gap = available.map_or(FREE_COLUMN_GAP, |room| clamp(fits(room), COLUMN_GAP.0, COLUMN_GAP.1));
        let left =
            |column: usize| MARGIN + PADDING + widths[..column].iter().sum::<f64>() + column as f64 * gap;
        let border = |column: usize| left(column) + widths[column];
        let node = |(node, column): (usize, &usize)| NodePosition {
            x: left(*column),
            y: self.slots[node].y,
            column: *column,
        };
        let group = |lane: &Lane| {
            let is_used = |column: &usize| !lane.columns[*column].is_empty();
            let first = (0..lane.columns.len()).find(is_used).unwrap_or(0);
            let last = lane.columns.len() - 1;
            GroupBox {
                name: lane.name.clone(),
                x: left(first) - PADDING + 4.0,
                y: lane.top - TITLE_HEIGHT,
                width: border(last) - left(first) + 2.0 * PADDING - 8.0,
                height: lane.height + lane.tracks_height() + TITLE_HEIGHT,
            }
        };
        GraphLayout {
            nodes: self.columns.iter().enumerate().map(node).collect(),
            routes: self.routes(gap, &left, &border),
            groups: self.lanes.iter().filter(|lane| !lane.name.is_empty()).map(group).collect(),
            width: border(count.saturating_sub(1)) + PADDING + MARGIN,
            height,
        }
    }

    fn routes(&self, gap: f64, left: &dyn Fn(usize) -> f64, border: &dyn Fn(usize) -> f64) -> Vec<EdgeRoute> {
        // Sources of edges into other lanes share the space behind their column.
        let mut trunks: SortedMap<usize, Vec<usize>> = SortedMap::new();
        for edge in self.graph.edges.iter().filter(|edge| !self.is_back(edge) && self.is_across(edge)) {
            let own = trunks.entry(self.columns[edge.from]).or_default();
            if !own.contains(&edge.from) {
                own.push(edge.from);
            }
        }
        let trunk = |node: usize| {
            let own = trunks.get(&self.columns[node])?;
            let place = own.iter().position(|other| *other == node)? + 1;
            Some(border(self.columns[node]) + (gap - PADDING + 4.0) * place as f64 / (own.len() + 1) as f64)
        };
        let route = |(edge, passes): (&GraphEdge, &Vec<usize>)| {
            let (from, to) = (self.columns[edge.from], self.columns[edge.to]);
            let border_of_source = border(from);
            if self.is_back(edge) {
                let lane = &self.lanes[self.lane_of[edge.to]];
                let track = lane.tracks.iter().position(|other| *other == edge.to).unwrap_or(0) as f64;
                let low = lane.top + lane.height + (track + 0.6) * TRACK_SPACING;
                let (right, before) = (border_of_source + 10.0 + 3.0 * track, left(to) - 14.0 - 3.0 * track);
                return EdgeRoute { detour: Some((right, before, low)), ..EdgeRoute::default() };
            }
            let pass = |slot: &usize| {
                let slot = &self.slots[*slot];
                (left(slot.column), border(slot.column), slot.middle())
            };
            EdgeRoute {
                passes: passes.iter().map(pass).collect(),
                border: border_of_source,
                trunk: trunk(edge.from).filter(|_| self.is_across(edge)),
                detour: None,
            }
        };
        self.graph.edges.iter().zip(&self.passes).map(route).collect()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::{Flow, GraphNode, NodeKind};
    use super::*;

    fn graph(names: &[&str], edges: &[(usize, usize)]) -> ModuleGraph {
        let node =
            |name: &&str| GraphNode { name: (*name).into(), kind: NodeKind::Module, note: String::new() };
        let edge = |(from, to): &(usize, usize)| GraphEdge {
            from: from % names.len(),
            to: to % names.len(),
            output: "o".into(),
            input: "i".into(),
            flow: Flow::Values,
            inferred: false,
        };
        let (nodes, edges) = (names.iter().map(node).collect(), edges.iter().map(edge).collect());
        ModuleGraph { title: "test".into(), nodes, edges }
    }

    const SIZE: (f64, f64) = (60.0, 30.0);

    #[test]
    fn layout_of_a_chain_is_a_line_to_the_right() {
        let layout = GraphLayout::new(&graph(&["a", "b", "c"], &[(0, 1), (1, 2)]), &[SIZE; 3], None);
        let nodes = &layout.nodes;
        assert!(nodes[0].x < nodes[1].x && nodes[1].x < nodes[2].x, "{nodes:?}");
        assert!(nodes.iter().all(|node| node.y == nodes[0].y), "{nodes:?}");
        assert!(!layout.routes.iter().any(EdgeRoute::is_back));
    }

    #[test]
    fn one_edge_of_a_circle_closes_the_loop() {
        let circle = graph(&["a", "b", "c"], &[(0, 1), (1, 2), (2, 0)]);
        let layout = GraphLayout::new(&circle, &[SIZE; 3], None);
        assert_eq!(layout.routes.iter().filter(|route| route.is_back()).count(), 1);
    }

    #[test]
    fn answers_to_messages_close_a_loop() {
        let mut answered = graph(&["a", "b"], &[(1, 0), (0, 1)]);
        answered.edges[1].flow = Flow::Messages;
        let layout = GraphLayout::new(&answered, &[SIZE; 2], None);
        assert_eq!(layout.routes.iter().map(EdgeRoute::is_back).collect::<Vec<_>>(), [true, false]);
    }

    #[test]
    fn layout_of_an_empty_graph_has_a_size() {
        let layout = GraphLayout::new(&ModuleGraph::default(), &[], Some((0.0, 0.0)));
        assert!(layout.width > 0.0 && layout.height > 0.0);
    }

    const NAMES: [&str; 14] =
        ["a", "b", "c", "d", "e", "f", "r1/a", "r1/b", "r1/c", "r1/d", "r2/a", "r2/b", "r2/c", "r2/d"];

    proptest! {
        #[test]
        fn nodes_never_overlap_and_stay_in_their_group(
            count in 1usize..14,
            edges in prop::collection::vec((0usize..14, 0usize..14), 0..40),
            available in prop::option::of((0.0..2000.0, 0.0..2000.0)),
        ) {
            let graph = graph(&NAMES[14 - count..], &edges);
            let layout = GraphLayout::new(&graph, &vec![SIZE; count], available);
            for (index, one) in layout.nodes.iter().enumerate() {
                prop_assert!(one.x >= 0.0 && one.x + SIZE.0 <= layout.width);
                prop_assert!(one.y >= 0.0 && one.y + SIZE.1 <= layout.height, "{one:?} {}", layout.height);
                for other in &layout.nodes[index + 1..] {
                    let apart = SIZE.1 + NODE_GAP.0 - 1e-6;
                    prop_assert!(one.column != other.column || (one.y - other.y).abs() >= apart);
                }
                for group in &layout.groups {
                    let is_within = one.y >= group.y && one.y + SIZE.1 <= group.y + group.height;
                    prop_assert_eq!(is_within, graph.group(index) == group.name);
                }
            }
            for (edge, route) in graph.edges.iter().zip(&layout.routes) {
                let (from, to) = (layout.nodes[edge.from], layout.nodes[edge.to]);
                prop_assert_eq!(route.is_back(), from.column >= to.column);
                let path = route.path((from.x + SIZE.0, from.y), (to.x, to.y));
                prop_assert!(path.starts_with('M') && !path.contains("NaN"), "{}", path);
            }
        }
    }
}
