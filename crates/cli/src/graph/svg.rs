//! A graph as a drawing.

use std::fmt::Write;

use super::layout::{Layout, place};
use super::{Edge, Flow, Graph, Kind};

/// A letter of the drawing's font, about; the names are seldom wide.
const LETTER: f64 = 7.2;
const SMALL: f64 = 5.9;

/// The head of a node, and the row of an output.
const HEAD: f64 = 36.0;
const OUTPUT: f64 = 16.0;
const MARGIN: f64 = 24.0;

/// Lines that go back pass below all, this far apart.
const LANE: f64 = 10.0;

const STYLE: &str = "
  text { font: 12px ui-monospace, 'DejaVu Sans Mono', monospace; fill: #1b1f24; }
  .title { font-size: 15px; font-weight: bold; }
  .note, .output { font-size: 10px; fill: #57606a; }
  .output { text-anchor: end; }
  .paper { fill: #ffffff; }
  .node { fill: #f6f8fa; stroke: #57606a; }
  .gate { fill: #fff1e5; stroke: #a04000; }
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

/// Draws it.
pub fn draw(graph: &Graph) -> String {
    let outputs: Vec<Vec<&str>> = (0..graph.nodes.len()).map(|node| outputs(graph, node)).collect();
    let size = |(index, outputs): (usize, &Vec<&str>)| {
        let node = &graph.nodes[index];
        let letters = |text: &str| text.chars().count() as f64;
        let widest = outputs.iter().map(|output| letters(output) * SMALL + 24.0);
        let head = [letters(&node.name) * LETTER, letters(&node.note) * SMALL].map(|width| width + 20.0);
        let width = head.into_iter().chain(widest).fold(60.0, |a: f64, b| if b > a { b } else { a });
        (width, HEAD + OUTPUT * outputs.len() as f64 + if outputs.is_empty() { 0.0 } else { 4.0 })
    };
    let sizes: Vec<(f64, f64)> = outputs.iter().enumerate().map(size).collect();
    let layout = place(graph, &sizes);
    let back = layout.back.iter().filter(|back| **back).count();
    let (width, height) = (
        layout.width + 2.0 * MARGIN + 2.0 * LANE * back as f64,
        layout.height + 2.0 * MARGIN + 44.0 + LANE * back as f64,
    );
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" width=\"{width:.0}\" \
         height=\"{height:.0}\" role=\"img\" aria-label=\"modules and links of {title}\">\n<style>{STYLE}</style>\n\
         <rect class=\"paper\" width=\"100%\" height=\"100%\"/>\n",
        title = escaped(&graph.title)
    );
    text.push_str(
        "<defs><marker id=\"arrow\" viewBox=\"0 0 8 8\" refX=\"7\" refY=\"4\" markerWidth=\"7\" markerHeight=\"7\" \
         orient=\"auto\"><path d=\"M0 0L8 4L0 8z\" fill=\"context-stroke\"/></marker></defs>\n",
    );
    let _ = writeln!(text, "<text class=\"title\" x=\"{MARGIN}\" y=\"26\">{}</text>", escaped(&graph.title));
    let _ = writeln!(
        text,
        "<text class=\"note\" x=\"{MARGIN}\" y=\"42\">lines: values from the property named at the right edge of a box; thick: \
         messages; blue: back to the left; dotted: of the last cycle</text>"
    );
    let _ = writeln!(text, "<g transform=\"translate({:.0} 58)\">", MARGIN + LANE * back as f64);
    edges(graph, &outputs, &sizes, &layout, &mut text);
    for (index, node) in graph.nodes.iter().enumerate() {
        let ((width, height), at) = (sizes[index], layout.places[index]);
        let class = match node.kind {
            Kind::Module => "node",
            Kind::Gate => "gate",
            Kind::Outside => "outside",
        };
        let (x, y) = (at.x, at.y);
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
        for (row, output) in outputs[index].iter().enumerate() {
            let _ = writeln!(
                text,
                "<text class=\"output\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                x + width - 6.0,
                y + HEAD + OUTPUT * row as f64 + 10.0,
                escaped(output)
            );
        }
    }
    text.push_str("</g>\n</svg>\n");
    text
}

/// What a node gives to others, in the order in which it is written.
fn outputs(graph: &Graph, node: usize) -> Vec<&str> {
    let mut outputs: Vec<&str> =
        graph.edges.iter().filter(|edge| edge.from == node).map(|edge| edge.output.as_str()).collect();
    outputs.sort_unstable();
    outputs.dedup();
    outputs
}

fn edges(graph: &Graph, outputs: &[Vec<&str>], sizes: &[(f64, f64)], layout: &Layout, text: &mut String) {
    // Lines into a node end one below the other, those from above first.
    let mut ends: Vec<Vec<(f64, usize)>> = vec![Vec::new(); graph.nodes.len()];
    for (index, edge) in graph.edges.iter().enumerate() {
        let from = layout.ways[index].last().map_or(layout.places[edge.from].y, |(_, y)| *y);
        let from = if layout.back[index] { f64::MAX } else { from };
        ends[edge.to].push((from, index));
    }
    ends.iter_mut().for_each(|ends| ends.sort_by(|a, b| a.0.total_cmp(&b.0)));
    let mut lane = 0;
    for (index, edge) in graph.edges.iter().enumerate() {
        let (from, to) = (layout.places[edge.from], layout.places[edge.to]);
        let row = outputs[edge.from].iter().position(|output| *output == edge.output).unwrap_or(0);
        let begin = (from.x + sizes[edge.from].0, from.y + HEAD + OUTPUT * row as f64 + 7.0);
        let place = ends[edge.to].iter().position(|(_, other)| *other == index).unwrap_or(0) as f64 + 1.0;
        let end = (to.x, to.y + sizes[edge.to].1 * place / (ends[edge.to].len() as f64 + 1.0));
        let path = match layout.back[index] {
            false => {
                let mut points = vec![begin];
                points.extend(&layout.ways[index]);
                points.push(end);
                curve(&points)
            }
            true => {
                lane += 1;
                let (aside, below) = (LANE * lane as f64, layout.height + LANE * lane as f64);
                let (right, left) = (begin.0 + 10.0 + aside / 2.0, end.0 - 12.0 - aside / 2.0);
                format!(
                    "M{:.1} {:.1}H{right:.1}V{below:.1}H{left:.1}V{:.1}H{:.1}",
                    begin.0, begin.1, end.1, end.0
                )
            }
        };
        let flow = match edge.flow {
            Flow::Values => "",
            Flow::Messages => " messages",
            Flow::Previous => " previous",
        };
        let inferred = if edge.inferred { " inferred" } else { "" };
        let back = if layout.back[index] { " back" } else { "" };
        let _ = writeln!(
            text,
            "<path class=\"edge{flow}{inferred}{back}\" d=\"{path}\" marker-end=\"url(#arrow)\"><title>{}</title></path>",
            escaped(&title(graph, edge))
        );
    }
}

fn title(graph: &Graph, edge: &Edge) -> String {
    let name = |index: usize| graph.nodes[index].name.as_str();
    let inferred = if edge.inferred { ", inferred from types and roles" } else { "" };
    format!("{}/{} → {}/{}{inferred}", name(edge.from), edge.output, name(edge.to), edge.input)
}

/// A line through points that leaves and reaches each of them level.
fn curve(points: &[(f64, f64)]) -> String {
    let mut path = String::new();
    for (index, pair) in points.windows(2).enumerate() {
        let ([(ax, ay), (bx, by)], middle) = ([pair[0], pair[1]], (pair[0].0 + pair[1].0) / 2.0);
        if index == 0 {
            let _ = write!(path, "M{ax:.1} {ay:.1}");
        }
        let _ = write!(path, "C{middle:.1} {ay:.1} {middle:.1} {by:.1} {bx:.1} {by:.1}");
    }
    path
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
