//! Interfaces of the block for views and referees.

use slate_interfaces::Point2;
use slate_module::prelude::*;

/// Kind of an edge of a pose graph.
#[interface]
pub enum SlamEdgeKind {
    /// Edge from a scan to the next one.
    Odometry,
    /// Edge between a scan and a revisited submap.
    LoopClosure,
}

/// Edge of a pose graph in the map frame.
#[interface]
pub struct SlamEdge {
    /// Position of the first scan.
    pub from: Point2,
    /// Position of the second scan.
    pub to: Point2,
    /// Kind.
    pub kind: SlamEdgeKind,
}

/// Pose graph of a SLAM: edges that join the scans, and those that close loops.
#[interface]
pub struct SlamGraph {
    /// Number of scans.
    pub scans: u32,
    /// Number of loop closure constraints.
    /// Edges have a part of them if they are many.
    pub loop_closures: u32,
    /// Edges: from scan to scan, then those that close loops.
    pub edges: [SlamEdge],
}

/// Progress of a SLAM.
#[interface]
#[derive(PartialEq)]
pub struct SlamStatus {
    /// Number of scans that were inserted.
    pub scans: u32,
    /// Number of constraints that close loops.
    pub loop_closures: u32,
    /// True if all work of these scans is done and in the map.
    /// It includes the work that `finish_after` begins.
    pub is_settled: Bool,
}
