//! Graph as an SVG drawing.

use std::fmt::Write;

use slate::control::graph::{Flow, GraphEdge, GraphLayout, GraphNode, ModuleGraph, NodeKind};

/// Approximate width of a letter, pixels.
const LETTER_WIDTH: f64 = 7.2;
const SMALL_LETTER_WIDTH: f64 = 5.9;

/// Heights of the head of a node and of the row of an output.
const HEAD_HEIGHT: f64 = 36.0;
const OUTPUT_HEIGHT: f64 = 16.0;
const MARGIN: f64 = 24.0;

/// Height of the title and of the legend.
const HEADER_HEIGHT: f64 = 48.0;

const LEGEND: &str = "lines: values of the property at the right edge of a box; thick: messages; blue: closes a loop; \
                      dotted: values of the last cycle";

const STYLE: &str = "
  text { font: 12px ui-monospace, 'DejaVu Sans Mono', monospace; fill: #1b1f24; }
  .title { font-size: 15px; font-weight: bold; }
  .note, .output { font-size: 10px; fill: #57606a; }
  .output { text-anchor: end; }
  .paper { fill: #ffffff; }
  .node { fill: #f6f8fa; stroke: #57606a; }
  .gate { fill: #fff1e5; stroke: #a04000; }
  .group { fill: none; stroke: #57606a; stroke-opacity: 0.4; stroke-dasharray: 6 4; }
  .outside { fill: #eef6ff; stroke: #0072b2; stroke-dasharray: 4 3; }
  .edge { fill: none; stroke: #57606a; stroke-opacity: 0.75; }
  .messages { stroke: #d55e00; stroke-width: 1.8; }
  .previous { stroke-dasharray: 2 3; }
  .inferred { stroke-opacity: 0.4; }
  .back { stroke: #0072b2; }
  .edge:hover { stroke-width: 3; stroke-opacity: 1; }
  @media (prefers-color-scheme: dark) {
    text { fill: #e6edf3; } .note, .output { fill: #9da7b3; } .paper { fill: #14181d; }
    .node { fill: #1f252c; stroke: #9da7b3; } .gate { fill: #33241a; stroke: #e69f00; }
    .outside { fill: #16242f; stroke: #56b4e9; } .edge { stroke: #9da7b3; }
    .messages { stroke: #e69f00; } .back { stroke: #56b4e9; }
  }
";

/// Returns the graph as an SVG document.
pub fn draw(graph: &ModuleGraph) -> String {
    let outputs: Vec<Vec<&str>> = (0..graph.nodes.len()).map(|node| outputs(graph, node)).collect();
    let sizes: Vec<(f64, f64)> =
        outputs.iter().zip(&graph.nodes).map(|(outputs, node)| size(node, outputs)).collect();
    let layout = GraphLayout::new(graph, &sizes, None);
    let (width, height) = (layout.width, layout.height + HEADER_HEIGHT);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" width=\"{width:.0}\" \
         height=\"{height:.0}\" role=\"img\" aria-label=\"modules and links of {title}\">\n<style>{STYLE}</style>\n\
         <rect class=\"paper\" width=\"100%\" height=\"100%\"/>\n\
         <defs><marker id=\"arrow\" viewBox=\"0 0 8 8\" refX=\"7\" refY=\"4\" markerWidth=\"7\" markerHeight=\"7\" \
         orient=\"auto\"><path d=\"M0 0L8 4L0 8z\" fill=\"context-stroke\"/></marker></defs>\n\
         <text class=\"title\" x=\"{MARGIN}\" y=\"26\">{title}</text>\n\
         <text class=\"note\" x=\"{MARGIN}\" y=\"42\">{LEGEND}</text>\n<g transform=\"translate(0 {HEADER_HEIGHT:.0})\">\n",
        title = escaped(&graph.title)
    );
    for group in &layout.groups {
        let _ = writeln!(
            text,
            "<rect class=\"group\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" rx=\"10\"/>\
             <text class=\"note\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            group.x,
            group.y,
            group.width,
            group.height,
            group.x + 12.0,
            group.y + 14.0,
            escaped(&group.name)
        );
    }
    edges(graph, &outputs, &sizes, &layout, &mut text);
    for (index, node) in graph.nodes.iter().enumerate() {
        let at = layout.nodes[index];
        draw_node(node, (at.x, at.y), sizes[index], &outputs[index], &mut text);
    }
    text.push_str("</g>\n</svg>\n");
    text
}

/// Returns the width and height of a node with its outputs.
fn size(node: &GraphNode, outputs: &[&str]) -> (f64, f64) {
    let letters = |text: &str| text.chars().count() as f64;
    let widest = outputs.iter().map(|output| letters(output) * SMALL_LETTER_WIDTH + 24.0);
    let head = [letters(&node.name) * LETTER_WIDTH, letters(&node.note) * SMALL_LETTER_WIDTH]
        .map(|width| width + 20.0);
    let width = head.into_iter().chain(widest).fold(60.0, |a: f64, b| if b > a { b } else { a });
    (width, HEAD_HEIGHT + OUTPUT_HEIGHT * outputs.len() as f64 + if outputs.is_empty() { 0.0 } else { 4.0 })
}

fn draw_node(
    node: &GraphNode,
    (x, y): (f64, f64),
    (width, height): (f64, f64),
    outputs: &[&str],
    text: &mut String,
) {
    let class = match node.kind {
        NodeKind::Module => "node",
        NodeKind::Gate => "gate",
        NodeKind::Outside => "outside",
    };
    let _ = writeln!(
        text,
        "<rect class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" rx=\"4\"/>\
         <text x=\"{:.1}\" y=\"{:.1}\">{}</text><text class=\"note\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
        x + 8.0,
        y + 15.0,
        escaped(&node.name),
        x + 8.0,
        y + 28.0,
        escaped(&node.note)
    );
    for (row, output) in outputs.iter().enumerate() {
        let _ = writeln!(
            text,
            "<text class=\"output\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            x + width - 6.0,
            y + HEAD_HEIGHT + OUTPUT_HEIGHT * row as f64 + 10.0,
            escaped(output)
        );
    }
}

/// Returns the outputs of a node that links read, in alphabetical order.
fn outputs(graph: &ModuleGraph, node: usize) -> Vec<&str> {
    let mut outputs: Vec<&str> =
        graph.edges.iter().filter(|edge| edge.from == node).map(|edge| edge.output.as_str()).collect();
    outputs.sort_unstable();
    outputs.dedup();
    outputs
}

fn edges(
    graph: &ModuleGraph,
    outputs: &[Vec<&str>],
    sizes: &[(f64, f64)],
    layout: &GraphLayout,
    text: &mut String,
) {
    // Edges into a node end one below the other: those from above first, those that close a loop last.
    let mut ends: Vec<Vec<(f64, usize)>> = vec![Vec::new(); graph.nodes.len()];
    for (index, (edge, route)) in graph.edges.iter().zip(&layout.routes).enumerate() {
        let from = route.arrival().unwrap_or(layout.nodes[edge.from].y);
        ends[edge.to].push((if route.is_back() { f64::MAX } else { from }, index));
    }
    ends.iter_mut().for_each(|ends| ends.sort_by(|a, b| a.0.total_cmp(&b.0)));
    for (index, (edge, route)) in graph.edges.iter().zip(&layout.routes).enumerate() {
        let (from, to) = (layout.nodes[edge.from], layout.nodes[edge.to]);
        let row = outputs[edge.from].iter().position(|output| *output == edge.output).unwrap_or(0);
        let start = (from.x + sizes[edge.from].0, from.y + HEAD_HEIGHT + OUTPUT_HEIGHT * row as f64 + 7.0);
        let place = ends[edge.to].iter().position(|(_, other)| *other == index).unwrap_or(0) as f64 + 1.0;
        let end = (to.x, to.y + sizes[edge.to].1 * place / (ends[edge.to].len() as f64 + 1.0));
        let flow = match edge.flow {
            Flow::Values => "",
            Flow::Messages => " messages",
            Flow::Previous => " previous",
        };
        let inferred = if edge.inferred { " inferred" } else { "" };
        let back = if route.is_back() { " back" } else { "" };
        let _ = writeln!(
            text,
            "<path class=\"edge{flow}{inferred}{back}\" d=\"{}\" marker-end=\"url(#arrow)\"><title>{}</title></path>",
            route.path(start, end),
            escaped(&title(graph, edge))
        );
    }
}

fn title(graph: &ModuleGraph, edge: &GraphEdge) -> String {
    let name = |index: usize| graph.nodes[index].name.as_str();
    let inferred = if edge.inferred { ", inferred from types and roles" } else { "" };
    format!("{}/{} → {}/{}{inferred}", name(edge.from), edge.output, name(edge.to), edge.input)
}

/// Escapes a text for SVG.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
