use slate_module::{Sequence, interface};

use crate::{Point2, Pose2};

/// 2D occupancy grid.
#[interface(ros = "nav_msgs/msg/OccupancyGrid")]
pub struct OccupancyGrid {
    /// Pose of the first cell's corner.
    pub origin: Pose2,
    /// Edge length of a cell.
    #[unit("m")]
    pub resolution: f64,
    /// Number of cells along x.
    pub width: u32,
    /// Number of cells along y.
    pub height: u32,
    /// Occupancy in percent, row by row from the lowest y; -1 if unknown.
    pub data: [i8],
}

/// Planar path from the robot's position.
#[interface(ros = "nav_msgs/msg/Path")]
pub struct Path {
    /// Length of the path; 0 if empty.
    #[unit("m")]
    pub length: f64,
    /// Points joined by line segments; empty if the goal is unreachable.
    pub points: [Point2],
}

/// Mark of a manual stroke on a map.
#[interface]
pub enum MapMark {
    /// Occupied cells.
    Occupied,
    /// Free cells.
    Free,
    /// Measured cells: removes earlier marks.
    Measured,
    /// Undoes the newest stroke; its points are ignored.
    Undo,
}

/// Manual stroke on a map, which overrides measured cells.
#[interface]
#[derive(PartialEq)]
pub struct MapStroke {
    /// Width of the brush.
    #[unit("m")]
    pub width: f64,
    /// Mark to paint.
    pub mark: MapMark,
    /// Points joined by line segments.
    pub points: Sequence<Point2, 32>,
}

impl MapStroke {
    /// Refusal: too many strokes.
    pub const FULL: u16 = 1;
    /// Refusal: no points, or no width.
    pub const NOWHERE: u16 = 2;
    /// Refusal: no stroke to undo.
    pub const NOTHING: u16 = 3;
}
