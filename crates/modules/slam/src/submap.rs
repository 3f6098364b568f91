//! Submaps.

use serde::{Deserialize, Serialize};
use slate_interfaces::Pose2;

use crate::max_grids::MaxGrids;
use crate::se2;
use crate::surface_map::SurfaceMap;

/// Levels of the search of loops: squares of up to 64 cells.
const LEVELS: usize = 7;

/// Surfaces that a number of successive scans have seen, in the frame of the first one.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Submap {
    pub map: SurfaceMap,
    /// First scan, whose pose is the submap's.
    pub anchor: usize,
    /// Number of scans, which are successive.
    pub scans: usize,
    /// Whether it has all of them.
    pub is_finished: bool,
    /// Made again after a restore.
    #[serde(skip)]
    grids: Option<MaxGrids>,
}

impl Submap {
    pub fn new(resolution: f64, anchor: usize) -> Self {
        Self { map: SurfaceMap::new(resolution), anchor, scans: 0, is_finished: false, grids: None }
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

    /// Grids of the search of loops, made when they are first used.
    pub fn grids(&mut self) -> &MaxGrids {
        self.grids.get_or_insert_with(|| MaxGrids::new(&self.map, None, LEVELS))
    }
}

/// Two submaps are equal if their scans are; the grids follow from these.
impl PartialEq for Submap {
    fn eq(&self, other: &Self) -> bool {
        self.map == other.map && self.nodes() == other.nodes() && self.is_finished == other.is_finished
    }
}
