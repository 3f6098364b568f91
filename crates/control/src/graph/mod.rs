//! Graph of an agent's modules, gates and links, and its layout.
//!
//! `slate graph` draws a configuration or an agent with it, and the console's page draws what `GET /graph` returns.

mod columns;
mod drawn;
mod layering;
mod layout;
mod model;
mod route;

pub use drawn::{DrawnEdge, DrawnGraph, DrawnLink, DrawnNode};
pub use layout::{GraphLayout, GroupBox, NodePosition};
pub use model::{Flow, GraphEdge, GraphLink, GraphNode, ModuleGraph, NodeKind};
pub use route::EdgeRoute;
