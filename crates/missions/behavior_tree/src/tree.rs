//! Behavior trees, checked and ready to run.

use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::model::{Enumerations, LeafKind};
use crate::ports::{BoundPort, PortBinding};
use crate::queue::ItemKind;
use crate::script::TreeScript;
use crate::value::BoardValue;

/// Status of a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum NodeStatus {
    /// Not ticked, or reset.
    #[default]
    Idle,
    /// The node continues with the next tick.
    Running,
    /// The node has succeeded.
    Succeeded,
    /// The node has failed.
    Failed,
    /// Passed over; its parent continues as if it were not there.
    Skipped,
}

impl NodeStatus {
    /// Returns whether it has succeeded or failed.
    pub fn is_completed(self) -> bool {
        matches!(self, Self::Succeeded | Self::Failed)
    }

    pub(crate) fn parse(word: &str) -> Option<Self> {
        Some(match word {
            "RUNNING" => Self::Running,
            "SUCCESS" => Self::Succeeded,
            "FAILURE" => Self::Failed,
            "SKIPPED" => Self::Skipped,
            _ => return None,
        })
    }
}

/// Operation of a node.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum NodeOperation {
    /// Sequence; asynchronous if it yields to other nodes after each child.
    Sequence {
        is_async: bool,
    },
    SequenceWithMemory,
    ReactiveSequence,
    Fallback {
        is_async: bool,
    },
    ReactiveFallback,
    Parallel {
        successes: PortBinding,
        failures: PortBinding,
    },
    ParallelAll {
        failures: PortBinding,
    },
    IfThenElse,
    WhileDoElse,
    TryCatch {
        on_halt: PortBinding,
    },
    Switch {
        variable: PortBinding,
        cases: Vec<PortBinding>,
    },
    Inverter,
    ForceSuccess,
    ForceFailure,
    Repeat {
        count: PortBinding,
    },
    Retry {
        count: PortBinding,
    },
    KeepRunningUntilFailure,
    Delay {
        milliseconds: PortBinding,
    },
    Timeout {
        milliseconds: PortBinding,
    },
    RunOnce {
        then_skip: PortBinding,
    },
    Precondition {
        condition: TreeScript,
        otherwise: NodeStatus,
    },
    Loop(TreeLoop),
    /// Decorator that ticks the child when the entry was written.
    OnUpdate {
        entry: usize,
        otherwise: NodeStatus,
    },
    SubTree,
    AlwaysSuccess,
    AlwaysFailure,
    SetBlackboard {
        value: PortBinding,
        entry: usize,
    },
    UnsetBlackboard {
        entry: usize,
    },
    WasUpdated {
        entry: usize,
    },
    Script(TreeScript),
    ScriptCondition(TreeScript),
    Sleep {
        milliseconds: PortBinding,
    },
    /// Number of the leaf.
    Leaf(usize),
}

/// Loop over the values of a queue.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TreeLoop {
    pub kind: ItemKind,
    pub queue: LoopQueue,
    /// Entry that has the value of each turn.
    pub value: Option<usize>,
    /// Status after the last value.
    pub if_empty: NodeStatus,
}

/// Values of a loop.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum LoopQueue {
    /// Values of the file.
    Items(Vec<BoardValue>),
    /// Values of an entry when the loop begins, which another entry keeps.
    Entry { entry: usize, kept: usize },
}

impl NodeOperation {
    /// Numbers of children that a node may have.
    pub fn children(&self) -> RangeInclusive<usize> {
        use NodeOperation::{
            Delay, Fallback, ForceFailure, ForceSuccess, IfThenElse, Inverter, KeepRunningUntilFailure, Loop,
            OnUpdate, Parallel, ParallelAll, Precondition, ReactiveFallback, ReactiveSequence, Repeat, Retry,
            RunOnce, Sequence, SequenceWithMemory, SubTree, Switch, Timeout, TryCatch, WhileDoElse,
        };
        match self {
            Sequence { .. } | SequenceWithMemory | ReactiveSequence | Fallback { .. } | ReactiveFallback => {
                1..=usize::MAX
            }
            Parallel { .. } | ParallelAll { .. } => 1..=usize::MAX,
            IfThenElse | WhileDoElse => 2..=3,
            TryCatch { .. } => 2..=usize::MAX,
            Switch { cases, .. } => cases.len() + 1..=cases.len() + 1,
            Inverter | ForceSuccess | ForceFailure | Repeat { .. } | Retry { .. } => 1..=1,
            KeepRunningUntilFailure | Delay { .. } | Timeout { .. } | RunOnce { .. } => 1..=1,
            Precondition { .. } | Loop(_) | OnUpdate { .. } | SubTree => 1..=1,
            _ => 0..=0,
        }
    }

    /// Returns the literal numbers of children in the ports of a parallel node.
    pub fn literal_counts(&self) -> [Option<(&'static str, f64)>; 2] {
        let literal = |port: &'static str, binding: &PortBinding| match binding {
            PortBinding::Literal(value) => value.number().map(|number| (port, number)),
            PortBinding::Entry(_) => None,
        };
        match self {
            Self::Parallel { successes, failures } => {
                [literal("success_count", successes), literal("failure_count", failures)]
            }
            Self::ParallelAll { failures } => [literal("max_failures", failures), None],
            _ => [None, None],
        }
    }

    pub fn is_decorator(&self) -> bool {
        self.children() == (1..=1)
    }
}

/// Scripts before and after a node, in the order in which they are evaluated.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct NodeScripts {
    pub failure_if: Option<TreeScript>,
    pub success_if: Option<TreeScript>,
    pub skip_if: Option<TreeScript>,
    pub only_while: Option<TreeScript>,
    pub on_halted: Option<TreeScript>,
    pub on_failure: Option<TreeScript>,
    pub on_success: Option<TreeScript>,
    pub post: Option<TreeScript>,
}

/// Node of a tree, its sub-trees included.
#[derive(Clone, Debug, PartialEq)]
pub struct BehaviorNode {
    pub(crate) tag: String,
    pub(crate) name: String,
    pub(crate) path: String,
    pub(crate) line: usize,
    pub(crate) file: Option<Arc<Path>>,
    pub(crate) depth: usize,
    pub(crate) operation: NodeOperation,
    pub(crate) children: Vec<usize>,
    /// Attributes of the file other than its name and number.
    pub(crate) attributes: Vec<(String, String)>,
    pub(crate) scripts: Option<Box<NodeScripts>>,
}

impl BehaviorNode {
    /// Returns its type: `Sequence`, or the ID of a leaf or a sub-tree.
    pub fn tag(&self) -> &str {
        &self.tag
    }

    /// Returns its name, which is the tag unless the file has another.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns its sub-trees with its number and name, such as `patrol/2 GoTo`.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Returns the line in the file, from 1.
    pub fn line(&self) -> usize {
        self.line
    }

    /// Returns the file of the node, if the tree's file includes it.
    pub fn file(&self) -> Option<&Path> {
        self.file.as_deref()
    }

    /// Returns the number of nodes above it.
    pub fn depth(&self) -> usize {
        self.depth
    }

    /// Returns its children, in order: indices of [`BehaviorTree::nodes`].
    pub fn children(&self) -> &[usize] {
        &self.children
    }
}

/// Action or a condition of a tree, which the host performs or answers.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeLeaf {
    pub(crate) kind: LeafKind,
    pub(crate) id: String,
    pub(crate) node: usize,
    pub(crate) ports: Vec<BoundPort>,
}

impl TreeLeaf {
    /// Returns the kind: action or condition.
    pub fn kind(&self) -> LeafKind {
        self.kind
    }

    /// Returns its kind of action or condition, such as `GoTo`.
    pub fn id(&self) -> &str {
        &self.id
    }

    /// Returns its node: an index of [`BehaviorTree::nodes`].
    pub fn node(&self) -> usize {
        self.node
    }

    /// Returns its ports that have a value in the file, with that value.
    pub fn literals(&self) -> impl Iterator<Item = (&str, &BoardValue)> {
        self.ports.iter().filter_map(|port| match &port.binding {
            PortBinding::Literal(value) => Some((port.name.as_str(), value)),
            PortBinding::Entry(_) => None,
        })
    }
}

/// Behavior tree with its sub-trees, ready to run.
#[derive(Clone, Debug, PartialEq)]
pub struct BehaviorTree {
    pub(crate) name: String,
    pub(crate) fingerprint: u64,
    /// XML for monitors, or its size if it is too long.
    pub(crate) monitor_xml: Result<String, usize>,
    /// Root, then the others, parents before children.
    pub(crate) nodes: Vec<BehaviorNode>,
    pub(crate) leaves: Vec<TreeLeaf>,
    /// Entries of blackboards by number: the path of their sub-tree and their name.
    pub(crate) entries: Vec<String>,
    /// Position of each entry's name, behind the path.
    pub(crate) entry_names: Vec<usize>,
    /// Values of the entries at the start.
    pub(crate) initial: Vec<Option<BoardValue>>,
    /// Numbers that scripts have names for.
    pub(crate) enumerations: Enumerations,
}

impl BehaviorTree {
    /// Returns the ID of the main tree.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns a number that another text gives another one, as a rule.
    pub fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    /// Returns the nodes: the root first, parents before their children.
    pub fn nodes(&self) -> &[BehaviorNode] {
        &self.nodes
    }

    /// Returns the actions and conditions, in the order of the file.
    pub fn leaves(&self) -> &[TreeLeaf] {
        &self.leaves
    }

    /// Returns the names of the blackboards' entries.
    ///
    /// Those of a sub-tree have its path in front.
    pub fn entries(&self) -> &[String] {
        &self.entries
    }
}
