//! State machines as an SVG drawing: states are boxes with a row for each transition.

use std::fmt::Write;

use slate::control::graph::{Flow, GraphEdge, GraphLayout, GraphNode, ModuleGraph, NodeKind};
use slate_behavior::{MachineState, MachineTransition, SkillMachine};

use crate::graph::svg::escaped;

/// Approximate width of a letter, pixels.
const LETTER: f64 = 6.7;
/// Height of the title of a state, and of a row below it.
const ROW: f64 = 18.0;
/// Height above each machine.
const HEADER: f64 = 36.0;
const MARGIN: f64 = 24.0;
/// Letters of a condition that are drawn.
const LONGEST: usize = 48;

const STYLE: &str = "
  text { font: 11px ui-monospace, 'DejaVu Sans Mono', monospace; fill: #1b1f24; }
  .title { font-size: 15px; font-weight: bold; }
  .name { font-weight: bold; }
  .paper { fill: #ffffff; }
  .state { fill: #f6f8fa; stroke: #57606a; }
  .runs { fill: #eef6ff; stroke: #0072b2; stroke-width: 1.8; }
  .start { stroke-width: 3; }
  .exit { stroke: #117733; stroke-width: 3; }
  .fail { stroke: #a04000; stroke-width: 3; }
  .edge { fill: none; stroke: #57606a; stroke-opacity: 0.75; }
  .timeout { stroke-dasharray: 4 3; }
  @media (prefers-color-scheme: dark) {
    text { fill: #e6edf3; } .paper { fill: #14181d; } .state { fill: #1f252c; stroke: #9da7b3; }
    .runs { fill: #16242f; stroke: #56b4e9; } .exit { stroke: #44aa99; } .fail { stroke: #e69f00; }
    .edge { stroke: #9da7b3; }
  }
";

/// The machines as an SVG document, one below the other.
pub fn draw(title: &str, machines: &[SkillMachine]) -> String {
    let (mut body, mut width, mut height) = (String::new(), 2.0 * MARGIN, 0.0);
    for machine in machines {
        let graph = graph(machine);
        let sizes: Vec<(f64, f64)> = machine.states.iter().map(size).collect();
        let layout = GraphLayout::new(&graph, &sizes, None);
        let _ = writeln!(body, "<g transform=\"translate(0 {height:.0})\">");
        let _ =
            writeln!(body, "<text class=\"title\" x=\"{MARGIN}\" y=\"24\">{}</text>", escaped(&machine.name));
        let _ = writeln!(body, "<g transform=\"translate(0 {HEADER:.0})\">");
        draw_edges(machine, &graph, &layout, &sizes, &mut body);
        for (state, at) in machine.states.iter().zip(&layout.nodes) {
            draw_state(machine, state, (at.x, at.y), &mut body);
        }
        body.push_str("</g></g>\n");
        width = if layout.width > width { layout.width } else { width };
        height += layout.height + HEADER;
    }
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" width=\"{width:.0}\" \
         height=\"{height:.0}\" role=\"img\" aria-label=\"the skills of {title}\">\n<style>{STYLE}</style>\n\
         <rect class=\"paper\" width=\"100%\" height=\"100%\"/>\n\
         <defs><marker id=\"arrow\" viewBox=\"0 0 8 8\" refX=\"7\" refY=\"4\" markerWidth=\"7\" markerHeight=\"7\" \
         orient=\"auto\"><path d=\"M0 0L8 4L0 8z\" fill=\"context-stroke\"/></marker></defs>\n{body}</svg>\n",
        title = escaped(title)
    )
}

/// The machine as a graph; transitions that lead back close a loop.
fn graph(machine: &SkillMachine) -> ModuleGraph {
    let mut graph = ModuleGraph { title: machine.name.clone(), ..ModuleGraph::default() };
    let node = |state: &MachineState| GraphNode {
        name: state.name.clone(),
        kind: NodeKind::Outside,
        note: String::new(),
    };
    graph.nodes.extend(machine.states.iter().map(node));
    let depths = depths(machine);
    for (from, row, to) in transitions(machine) {
        graph.edges.push(GraphEdge {
            from,
            to,
            output: row.to_string(),
            input: String::new(),
            flow: if depths[to] > depths[from] { Flow::Values } else { Flow::Previous },
            inferred: false,
        });
    }
    graph
}

/// Transitions that lead to another state: state, row in it, and state that follows.
fn transitions(machine: &SkillMachine) -> impl Iterator<Item = (usize, usize, usize)> + '_ {
    let index_of = |name: &str| machine.states.iter().position(|state| state.name == name);
    machine.states.iter().enumerate().flat_map(move |(from, state)| {
        let rows = state.transitions.iter().enumerate();
        rows.filter_map(move |(row, transition)| Some((from, row, index_of(&transition.to)?)))
            .filter(|(from, _, to)| from != to)
    })
}

/// Number of transitions from the start to each state.
fn depths(machine: &SkillMachine) -> Vec<usize> {
    let mut depths: Vec<usize> = vec![usize::MAX; machine.states.len()];
    let start = machine.states.iter().position(|state| state.name == machine.start);
    let mut layer: Vec<usize> = start.into_iter().collect();
    for depth in 0..machine.states.len() {
        layer.retain(|state| depths[*state] == usize::MAX);
        layer.iter().for_each(|state| depths[*state] = depth);
        layer =
            transitions(machine).filter(|(from, _, _)| depths[*from] == depth).map(|(_, _, to)| to).collect();
    }
    depths
}

fn label(transition: &MachineTransition) -> String {
    let mut text: String = transition.description.chars().take(LONGEST).collect();
    if transition.description.chars().count() > LONGEST {
        text.push('…');
    }
    let before = if transition.is_precondition { "first: " } else { "" };
    format!("{before}{text} → {}", transition.to)
}

fn title(state: &MachineState) -> String {
    match state.skills.as_slice() {
        [] => state.name.clone(),
        skills => format!("{}: {}", state.name, skills.join(", ")),
    }
}

fn size(state: &MachineState) -> (f64, f64) {
    let texts = state.transitions.iter().map(label).chain([title(state)]);
    let letters = texts.map(|text| text.chars().count()).max().unwrap_or(0);
    (letters as f64 * LETTER + 16.0, ROW * (1 + state.transitions.len()) as f64 + 4.0)
}

fn draw_edges(
    machine: &SkillMachine,
    graph: &ModuleGraph,
    layout: &GraphLayout,
    sizes: &[(f64, f64)],
    text: &mut String,
) {
    let rows = transitions(machine).map(|(_, row, _)| row);
    for ((edge, route), row) in graph.edges.iter().zip(&layout.routes).zip(rows) {
        let (from, to) = (layout.nodes[edge.from], layout.nodes[edge.to]);
        let start = (from.x + sizes[edge.from].0, from.y + ROW * (1.5 + row as f64));
        let path = route.path(start, (to.x, to.y + ROW / 2.0));
        let transition = &machine.states[edge.from].transitions[row];
        let class = if transition.is_timeout { "edge timeout" } else { "edge" };
        let _ = writeln!(text, "<path class=\"{class}\" d=\"{path}\" marker-end=\"url(#arrow)\"/>");
    }
}

fn draw_state(machine: &SkillMachine, state: &MachineState, (x, y): (f64, f64), text: &mut String) {
    let mut class = String::from("state");
    for (is_so, word) in [
        (!state.skills.is_empty(), " runs"),
        (state.name == machine.start, " start"),
        (state.name == machine.exit, " exit"),
        (state.name == machine.fail, " fail"),
    ] {
        class.push_str(if is_so { word } else { "" });
    }
    let (width, height) = size(state);
    let _ = writeln!(
        text,
        "<rect class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" rx=\"5\"/>\
         <text class=\"name\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
        x + 8.0,
        y + 13.0,
        escaped(&title(state))
    );
    for (row, transition) in state.transitions.iter().enumerate() {
        let base = y + 13.0 + ROW * (row + 1) as f64;
        let _ = writeln!(
            text,
            "<text x=\"{:.1}\" y=\"{base:.1}\">{}</text>",
            x + 8.0,
            escaped(&label(transition))
        );
    }
}
