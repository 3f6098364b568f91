//! SVG drawing of state machines: a box for each state, a row for each transition.

use std::fmt::Write;

use slate::control::graph::{Flow, GraphEdge, GraphLayout, GraphNode, ModuleGraph, NodeKind};
use slate_behavior::{MachineState, MachineTransition, SkillMachine};

use super::paper::document;
use crate::graph::svg::escaped;

/// Approximate width of a letter, pixels.
const LETTER_WIDTH: f64 = 6.7;
/// Height of the title of a state, and of a row below it.
const ROW_HEIGHT: f64 = 18.0;
/// Height above each machine.
const HEADER_HEIGHT: f64 = 36.0;
const MARGIN: f64 = 24.0;
/// Letters of a condition that are drawn.
const MAX_CONDITION_LENGTH: usize = 48;

/// Returns the machines as an SVG document, one below the other.
pub fn draw(title: &str, machines: &[SkillMachine]) -> String {
    let (mut body, mut width, mut height) = (String::new(), 2.0 * MARGIN, 0.0);
    for machine in machines {
        let graph = graph(machine);
        let sizes: Vec<(f64, f64)> = machine.states.iter().map(size).collect();
        let layout = GraphLayout::new(&graph, &sizes, None);
        let _ = writeln!(body, "<g transform=\"translate(0 {height:.0})\">");
        let _ =
            writeln!(body, "<text class=\"title\" x=\"{MARGIN}\" y=\"24\">{}</text>", escaped(&machine.name));
        let _ = writeln!(body, "<g transform=\"translate(0 {HEADER_HEIGHT:.0})\">");
        draw_edges(machine, &graph, &layout, &sizes, &mut body);
        for (state, at) in machine.states.iter().zip(&layout.nodes) {
            draw_state(machine, state, (at.x, at.y), &mut body);
        }
        body.push_str("</g></g>\n");
        width = if layout.width > width { layout.width } else { width };
        height += layout.height + HEADER_HEIGHT;
    }
    document((width, height), &format!("the skills of {title}"), &body)
}

/// Returns the machine as a graph; transitions that lead back close a loop.
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

/// Returns the transitions that lead to another state.
/// Each is a state, its row in it, and the next state.
fn transitions(machine: &SkillMachine) -> impl Iterator<Item = (usize, usize, usize)> + '_ {
    let index_of = |name: &str| machine.states.iter().position(|state| state.name == name);
    machine.states.iter().enumerate().flat_map(move |(from, state)| {
        let rows = state.transitions.iter().enumerate();
        rows.filter_map(move |(row, transition)| Some((from, row, index_of(&transition.to)?)))
            .filter(|(from, _, to)| from != to)
    })
}

/// Returns the number of transitions from the start to each state.
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
    let mut text: String = transition.description.chars().take(MAX_CONDITION_LENGTH).collect();
    if transition.description.chars().count() > MAX_CONDITION_LENGTH {
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
    (letters as f64 * LETTER_WIDTH + 16.0, ROW_HEIGHT * (1 + state.transitions.len()) as f64 + 4.0)
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
        let start = (from.x + sizes[edge.from].0, from.y + ROW_HEIGHT * (1.5 + row as f64));
        let path = route.path(start, (to.x, to.y + ROW_HEIGHT / 2.0));
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
        let base = y + 13.0 + ROW_HEIGHT * (row + 1) as f64;
        let _ = writeln!(
            text,
            "<text x=\"{:.1}\" y=\"{base:.1}\">{}</text>",
            x + 8.0,
            escaped(&label(transition))
        );
    }
}
