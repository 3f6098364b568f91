//! Occupancy of a grid's cells.

use serde::{Deserialize, Serialize};

use crate::geometry::Geometry;

/// Cell of which nothing is known.
pub const UNKNOWN_CELL: i8 = -1;

/// 2D occupancy grid, as plain data of any size.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OccupancyMap {
    /// Pose, resolution and size.
    pub geometry: Geometry,
    /// Occupancy of each cell in percent, row by row from the lowest y.
    /// [`UNKNOWN_CELL`] if unknown.
    pub cells: Vec<i8>,
}
