//! States of the search.

use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashMap};
use std::hash::{BuildHasherDefault, Hasher};

use slate_grid::Geometry;
use slate_interfaces::Pose2;
use slate_module::math;

use crate::steering_path::{SteeringPath, SteeringPosition};

/// Arrival at a state from its predecessor.
#[derive(Clone, Copy, Debug)]
pub(super) enum NodeArrival {
    /// Start of the search.
    Start,
    /// Arrival by a step.
    Step { steering: SteeringPosition, is_reverse: bool },
    /// Arrival by the path to the goal, [`HybridNodes::goal_path`].
    Goal { is_reverse: bool },
}

impl NodeArrival {
    /// Returns true if the robot came in reverse; `None` at the start.
    pub fn is_reverse(&self) -> Option<bool> {
        match self {
            Self::Start => None,
            Self::Step { is_reverse, .. } | Self::Goal { is_reverse } => Some(*is_reverse),
        }
    }
}

/// State.
#[derive(Clone, Copy, Debug)]
pub(super) struct HybridNode {
    /// Continuous, somewhere in its cell and bin.
    pub pose: Pose2,
    /// Cost from the start, m.
    pub cost: f64,
    pub predecessor: u32,
    pub arrival: NodeArrival,
    pub is_closed: bool,
}

/// States of a search, and the open list.
#[derive(Clone, Debug, Default)]
pub(super) struct HybridNodes {
    nodes: Vec<HybridNode>,
    /// Newest state of each cell and bin.
    /// It is only looked up, so its order does not count.
    states: HashMap<u64, u32, BuildHasherDefault<StateHasher>>,
    open: BinaryHeap<OpenNode>,
    /// Path to the cheapest state at the goal, from its predecessor.
    goal_path: SteeringPath,
}

impl HybridNodes {
    pub fn clear(&mut self) {
        self.nodes.clear();
        self.states.clear();
        self.open.clear();
    }

    pub fn node(&self, index: u32) -> &HybridNode {
        &self.nodes[index as usize]
    }

    /// Adds a state with its priority; returns whether it was added.
    /// It is not, if its cell and bin have one that is closed or as cheap.
    pub fn offer(&mut self, key: u64, node: HybridNode, priority: f64) -> bool {
        if let Some(known) = self.states.get(&key) {
            let known = &self.nodes[*known as usize];
            if known.is_closed || known.cost <= node.cost {
                return false;
            }
        }
        let index = self.nodes.len() as u32;
        self.nodes.push(node);
        self.states.insert(key, index);
        self.open.push(OpenNode { priority, index, key });
        true
    }

    /// Adds the goal at the end of a path from its predecessor.
    /// It is not added if it was reached as cheaply before.
    pub fn offer_goal(&mut self, node: HybridNode, path: &SteeringPath) {
        if self.offer(GOAL, node, node.cost) {
            self.goal_path = *path;
        }
    }

    /// Returns the path to the goal from the predecessor of its cheapest state.
    pub fn goal_path(&self) -> SteeringPath {
        self.goal_path
    }

    /// Closes the state of least priority, and returns it.
    pub fn pop(&mut self) -> Option<u32> {
        while let Some(OpenNode { index, key, .. }) = self.open.pop() {
            // A cheaper state of the same cell and bin has come since.
            if self.states.get(&key) == Some(&index) {
                self.nodes[index as usize].is_closed = true;
                return Some(index);
            }
        }
        None
    }

    /// Returns true if the cell and bin of a key are closed.
    pub fn is_closed(&self, key: u64) -> bool {
        self.states.get(&key).is_some_and(|index| self.nodes[*index as usize].is_closed)
    }
}

/// Key of the goal, which no cell has.
const GOAL: u64 = u64::MAX;

/// Returns the key of the cell and bin of a pose; `None` outside of the grid.
pub(super) fn key(geometry: &Geometry, bins: u32, pose: &Pose2) -> Option<u64> {
    let (column, row) = geometry.cell(pose.x, pose.y)?;
    let share = math::wrap_angle(pose.theta) / std::f64::consts::TAU;
    let bin = (share * f64::from(bins)).round() as i64;
    let bin = bin.rem_euclid(i64::from(bins)) as u64;
    Some(geometry.index(column, row) as u64 * u64::from(bins) + bin)
}

/// Entry of the open list, ordered for a max-heap.
/// The least priority is the greatest entry; among equal ones, the oldest.
#[derive(Clone, Copy, Debug)]
struct OpenNode {
    priority: f64,
    index: u32,
    key: u64,
}

impl Ord for OpenNode {
    fn cmp(&self, other: &Self) -> Ordering {
        other.priority.total_cmp(&self.priority).then(other.index.cmp(&self.index))
    }
}

impl PartialOrd for OpenNode {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for OpenNode {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for OpenNode {}

/// Multiplicative hash of a key.
/// Knuth, *The Art of Computer Programming*, volume 3, section 6.4.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct StateHasher(u64);

impl Hasher for StateHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.write_u64(u64::from(*byte));
        }
    }

    fn write_u64(&mut self, key: u64) {
        let mixed = (self.0 ^ key).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        self.0 = mixed ^ (mixed >> 29);
    }
}
