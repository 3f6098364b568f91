//! Graph as text for other programs.

use std::fmt::Write;

use serde_json::json;
use slate::control::graph::{Flow, ModuleGraph, NodeKind};

/// Returns a Mermaid flowchart, for Markdown.
pub fn mermaid(graph: &ModuleGraph) -> String {
    let mut text = "flowchart LR\n".to_owned();
    for (index, node) in graph.nodes.iter().enumerate() {
        let name = node.name.replace('"', "#quot;");
        let shape = match node.kind {
            NodeKind::Module => format!("[\"{name}\"]"),
            NodeKind::Gate => format!("{{{{\"{name}\"}}}}"),
            NodeKind::Outside => format!("([\"{name}\"])"),
        };
        let _ = writeln!(text, "  n{index}{shape}");
    }
    for edge in &graph.edges {
        let arrow = match edge.flow {
            Flow::Values => "-->",
            Flow::Messages => "==>",
            Flow::Previous => "-.->",
        };
        let _ = writeln!(
            text,
            "  n{} {arrow}|\"{}{}\"| n{}",
            edge.from,
            edge.output.replace('"', "#quot;"),
            if edge.inferred { " (inferred)" } else { "" },
            edge.to
        );
    }
    text
}

/// Returns a digraph of Graphviz.
pub fn dot(graph: &ModuleGraph) -> String {
    let mut text = "digraph slate {\n  rankdir=LR;\n  node [shape=box, fontname=\"sans-serif\"];\n  edge [fontsize=10];\n".to_owned();
    let quoted = |text: &str| format!("{:?}", text);
    for (index, node) in graph.nodes.iter().enumerate() {
        let shape = match node.kind {
            NodeKind::Module => "box",
            NodeKind::Gate => "hexagon",
            NodeKind::Outside => "ellipse",
        };
        let _ = writeln!(text, "  n{index} [label={}, shape={shape}];", quoted(&node.name));
    }
    for edge in &graph.edges {
        let style = match edge.flow {
            Flow::Values => "solid",
            Flow::Messages => "bold",
            Flow::Previous => "dotted",
        };
        let _ = writeln!(
            text,
            "  n{} -> n{} [label={}, style={style}{}];",
            edge.from,
            edge.to,
            quoted(&edge.output),
            if edge.inferred { ", color=gray" } else { "" }
        );
    }
    text.push_str("}\n");
    text
}

/// Returns a JSON object with nodes and edges.
pub fn json(graph: &ModuleGraph) -> String {
    let name = |index: usize| graph.nodes.get(index).map(|node| node.name.as_str());
    let edges = graph.edges.iter().map(|edge| {
        json!({
            "from": name(edge.from), "output": edge.output, "to": name(edge.to), "input": edge.input, "flow": edge.flow,
            "inferred": edge.inferred,
        })
    });
    let edges: Vec<_> = edges.collect();
    json!({"schema": "slate.graph/1", "title": graph.title, "nodes": graph.nodes, "edges": edges}).to_string()
}
