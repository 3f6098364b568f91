//! Behaviour trees: missions of robots in the XML of BehaviorTree.CPP 4.

mod build;
mod error;
mod executor;
mod model;
mod ports;
mod script;
mod tree;
mod value;

pub use error::{TickError, TreeError, TreeStateError};
pub use executor::{SavedNode, TreeExecutor, TreeHost, TreeState};
pub use model::{LeafKind, LeafModel, LeafModels, PortDirection, PortModel};
pub use ports::LeafPorts;
pub use tree::{BehaviorNode, BehaviorTree, NodeStatus, TreeLeaf};
pub use value::BoardValue;
