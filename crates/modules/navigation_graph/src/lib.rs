//! Topological navigation graphs as Fawkes's navgraph.
//! Named places, the connections between them, and routes.
//!
//! [`read_graph`] and [`write_graph`] use Fawkes's YAML; [`NavigationGraph::route`] finds the shortest route. None of them
//! needs an agent. Positions are in the map frame, m.
//!
//! ```
//! use slate_navigation_graph::NavigationGraph;
//!
//! let graph: NavigationGraph = "
//! graph-name: office
//! nodes:
//!   - { name: desk, pos: [0, 0] }
//!   - { name: door, pos: [3, 0] }
//!   - { name: kitchen, pos: [3, 4], properties: [ { orientation: 1.57 }, coffee ] }
//! connections:
//!   - [desk, door]
//!   - [door, kitchen]
//! ".parse()?;
//! let route = graph.route("desk", "kitchen").unwrap();
//! assert_eq!(route.nodes, ["desk", "door", "kitchen"]);
//! assert_eq!(route.length, 7.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod error;
mod graph;
mod insert;
mod parse;
mod route;
mod write;

pub use error::{GraphError, GraphFileError};
pub use graph::{NavigationEdge, NavigationGraph, NavigationNode, Properties};
pub use insert::Crossing;
pub use parse::read_graph;
pub use route::GraphRoute;
pub use write::write_graph;

#[cfg(doctest)]
#[doc = include_str!("../../../../book/src/39-navigation-graphs.md")]
mod book {}
