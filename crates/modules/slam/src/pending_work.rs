//! Deferred work of graph SLAM, longer than a scan permits.

use serde::{Deserialize, Serialize};

use crate::pose_graph::Constraint;

/// Searches that are made in units of a few milliseconds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum PendingWork {
    /// Loops of a submap that has all of its scans.
    Loops(LoopSearch),
    /// Constraints of all scans.
    Constraints(ConstraintSearch),
}

/// Search of a submap in all earlier ones near it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LoopSearch {
    pub submap: usize,
    /// First submap that it was not searched in.
    pub other: usize,
    /// Number of constraints that were found.
    pub found: usize,
    /// Points of the submap, thinned; made again after a restore.
    #[serde(skip)]
    pub query: Vec<[f64; 2]>,
}

/// Match of every scan with every submap near it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ConstraintSearch {
    /// True while poses come from loop closure alone.
    /// Such a search has not refined them yet.
    pub is_rough: bool,
    /// First submap and scan that were not matched.
    pub submap: usize,
    pub node: usize,
    pub found: Vec<Constraint>,
}

impl PendingWork {
    pub fn loops(submap: usize) -> Self {
        Self::Loops(LoopSearch { submap, other: 0, found: 0, query: Vec::new() })
    }

    pub fn constraints(is_rough: bool) -> Self {
        Self::Constraints(ConstraintSearch { is_rough, submap: 0, node: 0, found: Vec::new() })
    }
}
