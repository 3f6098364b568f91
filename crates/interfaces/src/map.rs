use slate_module::{Sequence, interface};

use crate::{Point2, Pose2};

/// What is where in the plane, in square cells.
#[interface(ros = "nav_msgs/msg/OccupancyGrid")]
pub struct OccupancyGrid {
    /// The corner of the first cell, where x and y of the grid begin.
    pub origin: Pose2,
    /// Side of a cell.
    #[unit("m")]
    pub resolution: f64,
    /// Cells along x.
    pub width: u32,
    /// Cells along y.
    pub height: u32,
    /// Row after row from the lowest y: 0 is free, 100 is occupied, -1 is not known.
    pub data: [i8],
}

/// A way through the plane, from where the robot is.
#[interface(ros = "nav_msgs/msg/Path")]
pub struct Path {
    /// From its first point to its last; 0 without points.
    #[unit("m")]
    pub length: f64,
    /// Straight from each to the next; none when there is no way.
    pub points: [Point2],
}

/// What a person paints on a map.
#[interface]
pub enum MapMark {
    /// Something stands there.
    Occupied,
    /// Nothing stands there.
    Free,
    /// As it is measured: what was painted there before is gone.
    Measured,
    /// Takes the last stroke back; where it says to be does not matter.
    Undo,
}

/// A stroke of a person's brush on a map: it goes over what is measured.
#[interface]
#[derive(PartialEq)]
pub struct MapStroke {
    /// How wide the brush is.
    #[unit("m")]
    pub width: f64,
    /// What it paints.
    pub mark: MapMark,
    /// Not used.
    pub reserved: [u8; 7],
    /// Where it goes: straight from each to the next.
    pub points: Sequence<Point2, 32>,
}

impl MapStroke {
    /// Why a stroke was refused: the map has no room for more of them.
    pub const FULL: u16 = 1;
    /// Why a stroke was refused: it is nowhere, or its brush has no width.
    pub const NOWHERE: u16 = 2;
    /// Why a stroke was refused: there is none to take back.
    pub const NOTHING: u16 = 3;
}
