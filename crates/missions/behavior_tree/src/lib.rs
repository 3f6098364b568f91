//! Behavior trees: missions of robots in the XML of BehaviorTree.CPP 4.
//!
//! [`BehaviorTree`] reads a tree with its sub-trees, and [`TreeExecutor`] executes it tick by tick: a [`TreeHost`]
//! performs the actions and answers the conditions. [`check_tree`] finds defects of a tree before it runs. None of
//! them needs an agent. Time is passed in; nothing reads a clock.
//!
//! Statuses, order of ticks, halting and skipping are those of BehaviorTree.CPP 4.10, also which node is ticked again
//! before it was reset: a condition of `WhileDoElse` that is an action keeps its answer while the node runs. Three
//! deviations from BehaviorTree.CPP fix defects:
//!
//! - A condition of `IfThenElse` or `WhileDoElse` that is skipped skips the node; BehaviorTree.CPP throws.
//! - A `Precondition` that was halted is evaluated again; in BehaviorTree.CPP it counts as passed.
//! - `Repeat` and `RetryUntilSuccessful` halt a child that runs when their count has become smaller; BehaviorTree.CPP
//!   leaves it running.
//!
//! Where BehaviorTree.CPP is open, Slate is strict:
//!
//! - Entries of blackboards are found when the tree is read, so that `SetBlackboard` and `UnsetBlackboard` have the
//!   name of an entry, not a pointer to one.
//! - Ports are checked against the models, also missing inputs; numbers of children and of tries when the tree is read.
//! - A script that divides by zero, reads an entry without a value or computes with a text ends the tick with an
//!   error; the tree is halted.
//! - Text that is a number is one in `SetBlackboard` and in ports of sub-trees.
//! - Operators of bits need whole numbers, and items of queues have the type of their loop.
//! - A script can't assign to the name of a number.
//!
//! ```
//! use slate_behavior_tree::*;
//!
//! /// A robot whose actions take two ticks.
//! struct Robot(Vec<String>);
//!
//! impl TreeHost for Robot {
//!     fn condition(&mut self, _: usize, _: &TreeLeaf, _: &mut LeafPorts<'_>) -> NodeStatus {
//!         NodeStatus::Failed
//!     }
//!     fn start(&mut self, _: usize, leaf: &TreeLeaf, ports: &mut LeafPorts<'_>) -> NodeStatus {
//!         self.0.push(format!("{} {}", leaf.id(), ports.get("to").unwrap()));
//!         NodeStatus::Running
//!     }
//!     fn progress(&mut self, _: usize, _: &TreeLeaf, _: &mut LeafPorts<'_>) -> NodeStatus {
//!         NodeStatus::Succeeded
//!     }
//!     fn halt(&mut self, _: usize, _: &TreeLeaf) {}
//! }
//!
//! let xml = r#"<root BTCPP_format="4"><BehaviorTree ID="visit">
//!   <Fallback>
//!     <Condition ID="Arrived"/>
//!     <Sequence>
//!       <Script code="door := 'kitchen' .. 1"/>
//!       <Action ID="GoTo" to="{door}"/>
//!     </Sequence>
//!   </Fallback>
//! </BehaviorTree></root>"#;
//! let tree = BehaviorTree::parse(xml.as_bytes(), &LeafModels::default())?;
//! let mut executor = TreeExecutor::new(tree.into());
//! let mut robot = Robot(Vec::new());
//! assert_eq!(executor.tick(0, &mut robot)?, NodeStatus::Running);
//! assert_eq!(executor.tick(20_000_000, &mut robot)?, NodeStatus::Succeeded);
//! assert_eq!(robot.0, ["GoTo kitchen1"]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod analysis;
mod build;
mod entries;
mod error;
mod executor;
mod model;
mod monitor;
mod ports;
mod queue;
mod script;
mod tree;
mod value;

pub use analysis::{KnownLeaf, TreeFinding, TreeFindingKind, check_tree};
pub use error::{TickError, TreeError, TreeStateError};
pub use executor::{SavedNode, TreeExecutor, TreeHost, TreeState};
pub use model::{LeafKind, LeafModel, LeafModels, PortDirection, PortModel};
pub use ports::LeafPorts;
pub use tree::{BehaviorNode, BehaviorTree, NodeStatus, TreeLeaf};
pub use value::BoardValue;

#[cfg(doctest)]
#[doc = include_str!("../../../../book/src/42-behavior-trees.md")]
mod book {}
