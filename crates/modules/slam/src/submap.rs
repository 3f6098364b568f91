//! Submaps.

use serde::{Deserialize, Serialize};
use slate_interfaces::Pose2;

use crate::se2;
use crate::surface_map::SurfaceMap;

/// Submap: surfaces seen by successive scans, in the frame of the first one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Submap {
    pub map: SurfaceMap,
    /// First scan, whose pose is the submap's.
    pub anchor: usize,
    /// Number of scans, which are successive.
    pub scans: usize,
    /// True if the submap has all its scans.
    pub is_finished: bool,
}

impl Submap {
    pub fn new(resolution: f64, anchor: usize) -> Self {
        Self { map: SurfaceMap::new(resolution), anchor, scans: 0, is_finished: false }
    }

    /// Inserts the next scan at its pose in the submap's frame.
    pub fn insert(&mut self, pose: Pose2, points: &[[f64; 2]]) {
        self.map.insert(se2::transform_all(pose, points));
        self.scans += 1;
    }

    /// Scans of the submap.
    pub fn nodes(&self) -> std::ops::Range<usize> {
        self.anchor..self.anchor + self.scans
    }
}
