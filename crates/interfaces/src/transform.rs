use slate_module::{Bool, Text, interface};

use crate::Position;

/// Name of a frame, without a slash, such as `base_link`.
pub type FrameName = Text<64>;

/// Rotation in space: a unit quaternion.
#[interface(ros = "geometry_msgs/msg/Quaternion")]
#[derive(PartialEq)]
pub struct Quaternion {
    /// x component.
    pub x: f64,
    /// y component.
    pub y: f64,
    /// z component.
    pub z: f64,
    /// Real part; 1 for no rotation.
    pub w: f64,
}

impl Quaternion {
    /// No rotation.
    pub const IDENTITY: Self = Self { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };
}

/// Transform of a frame in its parent at one time.
/// It maps coordinates in `child` to coordinates in `parent`.
///
/// The frames of a robot are named as in ROS's REP-105: `map` is the parent of `odom`, that of `base_link`, and that
/// of the sensors.
#[interface(ros = "geometry_msgs/msg/TransformStamped")]
#[derive(PartialEq)]
pub struct Transform {
    /// Time, in the agent's time; ignored for a fixed frame.
    #[unit("ns")]
    pub time: u64,
    /// Parent frame.
    pub parent: FrameName,
    /// Child frame.
    pub child: FrameName,
    /// Origin of the child in the parent.
    pub translation: Position,
    /// Rotation of the child in the parent.
    pub rotation: Quaternion,
    /// Static transform: true for example for a sensor's mount.
    pub fixed: Bool,
}
