use slate_module::{Bool, Text, interface};

use crate::Position;

/// The name of a frame, without a slash, such as `base_link`.
pub type FrameName = Text<64>;

/// A rotation in space: a unit quaternion.
#[interface(ros = "geometry_msgs/msg/Quaternion")]
#[derive(PartialEq)]
pub struct Quaternion {
    /// Of the axis to the front.
    pub x: f64,
    /// Of the axis to the left.
    pub y: f64,
    /// Of the axis up.
    pub z: f64,
    /// The real part; 1 for no rotation.
    pub w: f64,
}

impl Quaternion {
    /// No rotation.
    pub const IDENTITY: Self = Self { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };
}

/// Where a frame is in its parent, at one time: it takes coordinates in `child` to coordinates in `parent`.
///
/// The frames of a robot are named as in ROS's REP-105: `map` is the parent of `odom`, that of `base_link`, and that
/// of the sensors.
#[interface(ros = "geometry_msgs/msg/TransformStamped")]
#[derive(PartialEq)]
pub struct Transform {
    /// When the frame was there, in the agent's time. Without meaning for a fixed one.
    #[unit("ns")]
    pub time: u64,
    /// The frame that the place is told in.
    pub parent: FrameName,
    /// The frame whose place is told.
    pub child: FrameName,
    /// Where the child's origin is in the parent.
    pub translation: Position,
    /// How the child's axes are turned in the parent.
    pub rotation: Quaternion,
    /// Whether the frame never moves in its parent, as a sensor that is screwed on.
    pub fixed: Bool,
    /// Not used.
    pub reserved: [u8; 7],
}
