//! Occupancy grid of scans at their poses.

use slate_grid::{Geometry, LineCells, OccupancyMap, UNKNOWN_CELL};
use slate_interfaces::Pose2;
use slate_module::math;

use crate::se2;

/// Width of the unknown border of a map, cells.
const BORDER: f64 = 2.0;

/// Returns the occupancy grid of scans, each with its pose in the map frame and its points in the robot's frame: the
/// share of beams that end in a cell among those that reach it (counting model: Burgard, Stachniss and Haehnel, 2007,
/// *Mobile robot map learning from range data in dynamic environments*). `None` without points, or if it has more cells
/// than `most`.
pub fn occupancy_map<'a>(
    scans: impl Iterator<Item = (Pose2, &'a [[f64; 2]])> + Clone,
    resolution: f64,
    most: usize,
) -> Option<OccupancyMap> {
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for (pose, points) in scans.clone() {
        for point in se2::transform_all(pose, points).chain([[pose.x, pose.y]]) {
            for axis in 0..2 {
                low[axis] = math::min(low[axis], point[axis]);
                high[axis] = math::max(high[axis], point[axis]);
            }
        }
    }
    let border = BORDER * resolution;
    let corner = low.map(|value| value - border);
    let size = [0, 1].map(|axis| high[axis] - low[axis] + 2.0 * border);
    let geometry = Geometry::new(corner, size, resolution, most)?;
    // Beams that end in each cell, and that reach it.
    let mut counts = vec![[0_u32; 2]; geometry.cells()];
    for (pose, points) in scans {
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
    let occupancy = |[hits, all]: [u32; 2]| match all {
        0 => UNKNOWN_CELL,
        all => (100.0 * f64::from(hits) / f64::from(all)).round() as i8,
    };
    Some(OccupancyMap { geometry, cells: counts.into_iter().map(occupancy).collect() })
}
