//! Petri net as an SVG drawing.

use std::fmt::Write;

use slate::control::graph::{Flow, GraphEdge, GraphLayout, GraphNode, ModuleGraph, NodeKind};
use slate_petri_net::PetriNet;

use super::paper::document;
use crate::graph::svg::escaped;

/// Approximate width of a letter, pixels.
const LETTER_WIDTH: f64 = 5.9;
/// Radius of a place, and half of the height of a transition.
const PLACE_RADIUS: f64 = 13.0;
/// Half of the width of a transition.
const HALF_BAR_WIDTH: f64 = 3.0;
/// Height of a label.
const LABEL_HEIGHT: f64 = 16.0;
const HEADER_HEIGHT: f64 = 36.0;
const MARGIN: f64 = 24.0;

/// Returns the net as an SVG document: places are circles, transitions are bars.
pub fn draw(net: &PetriNet) -> String {
    let graph = graph(net);
    let sizes: Vec<(f64, f64)> = graph.nodes.iter().map(|node| size(&node.name)).collect();
    let layout = GraphLayout::new(&graph, &sizes, None);
    let title = escaped(&graph.title);
    let mut text = format!(
        "<text class=\"title\" x=\"{MARGIN}\" y=\"24\">{title}</text>\n\
         <g class=\"net\" transform=\"translate(0 {HEADER_HEIGHT:.0})\">\n"
    );
    // The middle of the shape of each node. Writing into a string can't fail.
    let middle = |node: usize| {
        let at = layout.nodes[node];
        (at.x + sizes[node].0 / 2.0, at.y + PLACE_RADIUS)
    };
    let half = |node: usize| if node < net.places().len() { PLACE_RADIUS } else { HALF_BAR_WIDTH };
    for (edge, route) in graph.edges.iter().zip(&layout.routes) {
        let (from, to) = (middle(edge.from), middle(edge.to));
        let path = route.path((from.0 + half(edge.from), from.1), (to.0 - half(edge.to), to.1));
        let back = if route.is_back() { " back" } else { "" };
        let _ = writeln!(text, "<path class=\"edge{back}\" d=\"{path}\" marker-end=\"url(#arrow)\"/>");
        if edge.output != "1" {
            let (x, y) = ((from.0 + to.0) / 2.0, (from.1 + to.1) / 2.0 - 4.0);
            let _ = writeln!(text, "<text x=\"{x:.1}\" y=\"{y:.1}\">{}</text>", edge.output);
        }
    }
    for (node, GraphNode { name, .. }) in graph.nodes.iter().enumerate() {
        draw_node(net, node, middle(node), &mut text);
        let (x, y) = (middle(node).0, middle(node).1 + PLACE_RADIUS + 11.0);
        let _ = writeln!(text, "<text x=\"{x:.1}\" y=\"{y:.1}\">{}</text>", escaped(name));
    }
    text.push_str("</g>\n");
    document((layout.width, layout.height + HEADER_HEIGHT), &format!("the plan {}", graph.title), &text)
}

/// Returns the net as a graph: places, then transitions.
fn graph(net: &PetriNet) -> ModuleGraph {
    let mut graph = ModuleGraph { title: net.name().into(), ..ModuleGraph::default() };
    // Nodes outside of an agent belong to no robot, whatever their labels.
    let node = |name: &str| GraphNode { name: name.into(), kind: NodeKind::Outside, note: String::new() };
    graph.nodes.extend(net.places().iter().map(|place| node(&place.name)));
    graph.nodes.extend(net.transitions().iter().map(|transition| node(&transition.name)));
    let is_marked = |node: usize| net.places().get(node).is_some_and(|place| place.initial > 0);
    let edge = |from: usize, to: usize, weight: u32| GraphEdge {
        from,
        to,
        output: weight.to_string(),
        input: String::new(),
        // The drawing begins with the places that have a token: what leads back to them closes a loop.
        flow: if is_marked(to) { Flow::Previous } else { Flow::Values },
        inferred: false,
    };
    for (index, transition) in net.transitions().iter().enumerate() {
        let own = net.places().len() + index;
        graph.edges.extend(transition.inputs.iter().map(|(place, weight)| edge(*place, own, *weight)));
        graph.edges.extend(transition.outputs.iter().map(|(place, weight)| edge(own, *place, *weight)));
    }
    graph
}

fn size(label: &str) -> (f64, f64) {
    let width = label.chars().count() as f64 * LETTER_WIDTH + 8.0;
    (if width > 2.0 * PLACE_RADIUS { width } else { 2.0 * PLACE_RADIUS }, 2.0 * PLACE_RADIUS + LABEL_HEIGHT)
}

fn draw_node(net: &PetriNet, node: usize, (x, y): (f64, f64), text: &mut String) {
    let Some(place) = net.places().get(node) else {
        let (left, top, width, height) =
            (x - HALF_BAR_WIDTH, y - PLACE_RADIUS, 2.0 * HALF_BAR_WIDTH, 2.0 * PLACE_RADIUS);
        let _ = writeln!(
            text,
            "<rect class=\"transition\" x=\"{left:.1}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{height:.1}\"/>"
        );
        return;
    };
    let mut class = String::from("place");
    for (is_so, word) in [
        (place.action.is_some(), " action"),
        (place.goal.is_some(), " goal"),
        (place.fail.is_some(), " fail"),
    ] {
        class.push_str(if is_so { word } else { "" });
    }
    let _ = writeln!(text, "<circle class=\"{class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{PLACE_RADIUS}\"/>");
    match place.initial {
        0 => {}
        1 => {
            let _ = writeln!(text, "<circle class=\"token\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\"/>");
        }
        tokens => {
            let _ = writeln!(text, "<text x=\"{x:.1}\" y=\"{:.1}\">{tokens}</text>", y + 3.5);
        }
    }
}
