//! Graphs, their files and routes.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::path::Path;

use proptest::prelude::*;
use slate_module::math::hypot;
use slate_navigation_graph::{
    Crossing, NavigationEdge, NavigationGraph, NavigationNode, read_graph, write_graph,
};

/// As Fawkes writes them.
const FILE: &str = r"%YAML 1.2
%TAG ! tag:fawkesrobotics.org,navgraph/
---
graph-name: home
default-properties:
  - travel_tolerance: 0.7
nodes:
  - name: sofa
    pos: [0, 0]
    properties:
      - orientation: 1.570
      - seat
  - name: table
    pos: [4, 0]
  - name: window
    pos: [4, 3]
  - name: shelf
    pos: [0, 3]
  - !unconnected
    name: lamp
    pos: [9, 9]
connections:
  - [sofa, table]
  - [table, window]
  - !dir [window, shelf]
  - !split-intersection [sofa, window]
";

fn graph(text: &str) -> NavigationGraph {
    text.parse().unwrap()
}

fn refused(text: &str) -> String {
    text.parse::<NavigationGraph>().unwrap_err().to_string()
}

fn names(graph: &NavigationGraph, from: &str, to: &str) -> String {
    graph.route(from, to).map_or_else(String::new, |route| route.nodes.join(" "))
}

#[test]
fn a_file_of_fawkes_has_its_nodes_properties_and_routes() {
    let graph = graph(FILE);
    assert_eq!(graph.name, "home");
    assert_eq!(graph.property("sofa", "orientation"), Some("1.570"));
    assert_eq!(graph.property("sofa", "seat"), Some("true"));
    assert_eq!(graph.property("table", "travel_tolerance"), Some("0.7"));
    assert_eq!(graph.property("table", "seat"), None);
    assert_eq!(names(&graph, "table", "shelf"), "table window shelf");
    assert_eq!(graph.route("sofa", "window").unwrap().length, 5.0);
    // It leads one way only.
    assert_eq!(names(&graph, "shelf", "window"), "");
    assert_eq!(graph.nearest_node([8.0, 8.0]).unwrap().name, "window");
    assert!(graph.unreachable().iter().all(|(from, _)| from == "shelf"));
}

#[test]
fn a_route_may_begin_at_a_place_that_is_no_node() {
    let graph = graph(FILE);
    // A wall is between the robot and the sofa, which is nearer.
    let way = |node: &str| match node {
        "table" => Some(1.0),
        "sofa" => Some(6.0),
        _ => None,
    };
    let route = graph.route_from(way, "window").unwrap();
    assert_eq!((route.nodes, route.length), (vec!["table".to_owned(), "window".into()], 4.0));
    assert!(graph.route_from(|_| Some(f64::NAN), "window").is_none());
}

#[test]
fn connections_that_cross_are_refused_split_or_allowed() {
    let square = FILE.replace(
        "  - !dir [window, shelf]\n  - !split-intersection [sofa, window]\n",
        "  - [sofa, window]\n",
    );
    let with = |line: &str| square.clone() + line;
    let message = refused(&with("  - [table, shelf]\n"));
    assert!(
        message.starts_with("line 26: connection `table` to `shelf` crosses that of `sofa` to `window`"),
        "{message}"
    );
    let split = graph(&with("  - !split-intersection [table, shelf]\n"));
    assert_eq!(names(&split, "shelf", "window"), "shelf table-shelf_sofa-window window");
    assert_eq!(split.node("table-shelf_sofa-window").unwrap().position, [2.0, 1.5]);
    let allowed = graph(&with("  - !allow-intersection [table, shelf]\n"));
    assert_eq!(names(&allowed, "shelf", "window"), "shelf table window");
}

#[test]
fn nodes_are_connected_as_their_insert_mode_says() {
    let with = |mode: &str| {
        let node = format!(
            "  - {{ name: plant, pos: [1, 1], properties: [ {{ insert-mode: {mode} }} ] }}\nconnections:"
        );
        graph(&FILE.replace("connections:", &node).replace("  - !split-intersection [sofa, window]\n", ""))
    };
    assert_eq!(names(&with("closest-node"), "plant", "table"), "plant sofa table");
    let edge = with("CLOSEST_EDGE");
    assert_eq!(names(&edge, "plant", "table"), "plant plant_sofa-table table");
    assert_eq!(edge.node("plant_sofa-table").unwrap().position, [1.0, 0.0]);
    assert_eq!(names(&with("not-connected"), "plant", "table"), "");
    assert!(with("unconnected").node("plant").unwrap().is_unconnected);
}

#[test]
fn errors_name_their_line() {
    let replaced = |from: &str, to: &str| refused(&FILE.replace(from, to));
    assert_eq!(replaced("graph-name: home\n", ""), "line 4: `graph-name` is missing");
    assert_eq!(replaced("pos: [4, 0]", "pos: [4]"), "line 14: 1 numbers: expected pos: [x, y]");
    assert_eq!(replaced("pos: [4, 0]", "pos: [4, far]"), "line 14: `far`: expected a number, m");
    assert_eq!(replaced("pos: [4, 0]", "pos: [4, .inf]"), "line 14: `.inf`: expected a number, m");
    assert_eq!(
        replaced("name: table", "name: sofa"),
        "line 13: node `sofa` exists twice: expected unique names"
    );
    assert_eq!(
        replaced("[table, window]", "[table, roof]"),
        "line 24: connection `table` to `roof`: no node `roof`"
    );
    assert_eq!(replaced("[table, window]", "[table]"), "line 24: 1 names: expected a connection [from, to]");
    assert_eq!(
        replaced("[table, window]", "[table, sofa]"),
        "line 24: connection `table` to `sofa` exists twice"
    );
    assert_eq!(
        replaced("[table, window]", "[table, lamp]"),
        "line 24: connection `table` to `lamp`: node `lamp` is unconnected"
    );
    assert!(replaced("!dir", "!one-way").contains("tag `!one-way`: expected !dir"));
    assert!(
        replaced("[table, window]", "[table, window").contains("no YAML"),
        "{}",
        replaced("[table, window]", "[table, window")
    );
    assert_eq!(refused(""), "empty: expected a graph");
    let missing = read_graph(Path::new("nowhere.yaml")).unwrap_err().to_string();
    assert!(missing.starts_with("nowhere.yaml: can't be read: "), "{missing}");
}

#[test]
fn lists_in_lists_do_not_overflow_the_stack() {
    for nested in ["- ".repeat(100_000), "[".repeat(200), "a: {".repeat(50)] {
        let message = refused(&nested);
        assert!(message.contains("line 1: "), "{message}");
    }
}

#[test]
fn a_connection_that_can_not_be_split_changes_nothing() {
    let mut graph = graph(FILE);
    // The name of the node at the crossing is taken.
    let taken = NavigationNode { name: "table-shelf_sofa-window".into(), ..NavigationNode::default() };
    graph.add_node(taken).unwrap();
    let before = graph.clone();
    let edge = NavigationEdge { from: "table".into(), to: "shelf".into(), is_directed: false };
    assert!(graph.connect(edge, Crossing::Split).is_err());
    assert_eq!(graph, before);
}

#[test]
fn a_graph_is_read_as_it_was_written() {
    let mut written = graph(FILE);
    let strange = NavigationNode {
        name: "a \"b\": [c] # \u{e4}".into(),
        position: [-0.1, 1e-7],
        properties: [("note".to_owned(), "yes: no\n- ~".to_owned())].into(),
        ..NavigationNode::default()
    };
    let name = strange.name.clone();
    written.add_node(strange).unwrap();
    written
        .connect(NavigationEdge { from: name, to: "shelf".into(), is_directed: false }, Crossing::Allow)
        .unwrap();
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("graph.yaml");
    write_graph(&file, &written).unwrap();
    assert_eq!(read_graph(&file).unwrap(), written);
    assert_eq!(graph(&NavigationGraph::new("none").to_string()), NavigationGraph::new("none"));
}

proptest! {
    #[test]
    fn no_route_is_shorter_than_the_one_that_is_found(
        places in prop::collection::vec((-9.0..9.0_f64, -9.0..9.0_f64), 6),
        ends in prop::collection::vec((0..6_usize, 0..6_usize, any::<bool>()), 0..12),
    ) {
        let mut graph = NavigationGraph::new("random");
        let name = |at: usize| format!("n{at}");
        for (at, (x, y)) in places.iter().enumerate() {
            graph.add_node(NavigationNode { name: name(at), position: [*x, *y], ..NavigationNode::default() }).unwrap();
        }
        let mut lengths = vec![vec![f64::INFINITY; 6]; 6];
        for (from, to, is_directed) in ends {
            let connection = NavigationEdge { from: name(from), to: name(to), is_directed };
            if graph.connect(connection, Crossing::Allow).is_ok() {
                let length = hypot(places[from].0 - places[to].0, places[from].1 - places[to].1);
                lengths[from][to] = length;
                if !is_directed {
                    lengths[to][from] = length;
                }
            }
        }
        // Floyd and Warshall.
        for middle in 0..6 {
            for from in 0..6 {
                for to in 0..6 {
                    let through = lengths[from][middle] + lengths[middle][to];
                    if through < lengths[from][to] {
                        lengths[from][to] = through;
                    }
                }
            }
        }
        for (from, lengths) in lengths.iter().enumerate() {
            for (to, least) in lengths.iter().enumerate().filter(|(to, _)| *to != from) {
                let found = graph.route(&name(from), &name(to)).map_or(f64::INFINITY, |route| route.length);
                prop_assert!(found == *least || (found - least).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn no_text_makes_the_reader_panic(text in "[ -~\n]{0,60}") {
        let _ = text.parse::<NavigationGraph>();
        let _ = (FILE.to_owned() + &text).parse::<NavigationGraph>();
    }
}
