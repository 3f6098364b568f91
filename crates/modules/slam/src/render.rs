//! Occupancy grid of scans at their poses.

use serde::{Deserialize, Serialize};
use slate_grid::{Geometry, LineCells, OccupancyMap, UNKNOWN_CELL};
use slate_interfaces::Pose2;
use slate_module::math;

use crate::se2;

/// Width of the unknown border of a map, cells.
const BORDER: f64 = 2.0;

/// Returns the occupancy grid of scans with known poses (counting model).
/// Each scan has its pose in the map frame and its points in the robot's frame. A cell's value is the share of beams
/// that end in it among those that reach it (Burgard, Stachniss and Haehnel, 2007, *Mobile robot map learning from
/// range data in dynamic environments*). `None` without points, or if it has more cells than `most`.
pub fn occupancy_map<'a>(
    scans: impl Iterator<Item = (Pose2, &'a [[f64; 2]])> + Clone,
    resolution: f64,
    most: usize,
) -> Option<OccupancyMap> {
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for (pose, points) in scans.clone() {
        let [least, greatest] = extent(pose, points);
        for axis in 0..2 {
            low[axis] = math::min(low[axis], least[axis]);
            high[axis] = math::max(high[axis], greatest[axis]);
        }
    }
    let border = BORDER * resolution;
    let corner = low.map(|value| value - border);
    let size = [0, 1].map(|axis| high[axis] - low[axis] + 2.0 * border);
    let mut counts = BeamCounts::new(Geometry::new(corner, size, resolution, most)?);
    for (pose, points) in scans {
        counts.insert(pose, points);
    }
    Some(OccupancyMap { geometry: counts.geometry, cells: counts.shares().collect() })
}

/// Returns the bounding box of a scan at a pose, m.
/// The position of the pose is inside of it.
pub(crate) fn extent(pose: Pose2, points: &[[f64; 2]]) -> [[f64; 2]; 2] {
    let (mut low, mut high) = ([pose.x, pose.y], [pose.x, pose.y]);
    for point in se2::transform_all(pose, points) {
        for axis in 0..2 {
            low[axis] = math::min(low[axis], point[axis]);
            high[axis] = math::max(high[axis], point[axis]);
        }
    }
    [low, high]
}

/// Beams that end in each cell of a grid, and that reach it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct BeamCounts {
    pub geometry: Geometry,
    /// Beams of each cell: those that end in it, and all.
    pub counts: Vec<[u32; 2]>,
}

impl BeamCounts {
    pub fn new(geometry: Geometry) -> Self {
        Self { geometry, counts: vec![[0; 2]; geometry.cells()] }
    }

    /// Counts the beams of a scan, from its pose to its points in the robot's frame.
    pub fn insert(&mut self, pose: Pose2, points: &[[f64; 2]]) {
        let Self { geometry, counts } = self;
        let from = geometry.place(pose.x, pose.y);
        for [x, y] in se2::transform_all(pose, points) {
            let to = geometry.place(x, y);
            let last = (to.0.floor() as i64, to.1.floor() as i64);
            for (column, row) in LineCells::new(from, to) {
                let is_inside = (0..geometry.width as i64).contains(&column)
                    && (0..geometry.height as i64).contains(&row);
                if is_inside {
                    let cell = &mut counts[geometry.index(column as usize, row as usize)];
                    cell[1] += 1;
                    cell[0] += u32::from((column, row) == last);
                }
            }
        }
    }

    /// Returns the share of beams that end in each cell, percent.
    /// [`UNKNOWN_CELL`] for a cell that no beam reaches.
    pub fn shares(&self) -> impl Iterator<Item = i8> {
        self.counts.iter().map(|[hits, all]| match all {
            0 => UNKNOWN_CELL,
            all => (100.0 * f64::from(*hits) / f64::from(*all)).round() as i8,
        })
    }
}
