// arm_msgs/msg/State, for topics of ROS 2 such as
// read."module/input" = { topic = "/state", definition = "arm_msgs/msg/State.msg" }
use slate_plugin::prelude::*;

/// `builtin_interfaces/msg/Time` of ROS.
#[interface(ros = "builtin_interfaces/msg/Time")]
#[derive(PartialEq)]
pub struct Time {
    /// Whole seconds
    #[unit("s")]
    pub sec: i32,
    /// Rest
    #[unit("ns")]
    pub nanosec: u32,
}

/// `builtin_interfaces/msg/Duration` of ROS.
#[interface(ros = "builtin_interfaces/msg/Duration")]
#[derive(PartialEq)]
pub struct Duration {
    /// Whole seconds
    #[unit("s")]
    pub sec: i32,
    /// Rest
    #[unit("ns")]
    pub nanosec: u32,
}

/// `geometry_msgs/msg/Pose` of ROS.
#[interface(ros = "geometry_msgs/msg/Pose")]
#[derive(PartialEq)]
pub struct Pose {
    /// The position.
    pub position: Position,
    /// The orientation.
    pub orientation: Quaternion,
}

/// `std_msgs/msg/Header` of ROS.
#[interface(ros = "std_msgs/msg/Header")]
#[derive(PartialEq)]
pub struct Header {
    /// The stamp.
    pub stamp: Time,
    /// The frame id.
    pub frame_id: Text<60>,
}

/// `geometry_msgs/msg/Point32` of ROS.
#[interface(ros = "geometry_msgs/msg/Point32")]
#[derive(PartialEq)]
pub struct Point32 {
    /// The x.
    pub x: f32,
    /// The y.
    pub y: f32,
    /// The z.
    pub z: f32,
}

/// `hand_msgs/msg/Finger` of ROS.
#[interface(ros = "hand_msgs/msg/Finger")]
#[derive(PartialEq)]
pub struct Finger {
    /// The header.
    pub header: Header,
    /// The tip.
    pub tip: Point32,
}

/// `hand_msgs/msg/Grip` of ROS.
#[interface(ros = "hand_msgs/msg/Grip")]
#[derive(PartialEq)]
pub struct Grip {
    /// Between the fingers
    #[unit("m")]
    pub width: f64,
    /// The fingers.
    pub fingers: Sequence<Finger, 16>,
}

/// Values of `mode`.
#[interface]
pub enum StateMode {
    /// The mode of operation.
    /// without power
    Idle = 0,
    Moving = 1,
    HeldByHand = 2,
}

/// Values of `error`.
#[interface]
#[repr(i16)]
pub enum StateError {
    None = 0,
    Overheated = -7,
}

/// State of an arm.
#[interface(ros = "arm_msgs/msg/State")]
#[derive(PartialEq)]
pub struct State {
    /// The mode.
    pub mode: StateMode,
    /// Newest one; it stays
    /// until it is reset
    pub error: StateError,
    /// The moved.
    pub moved: Time,
    /// The uptime.
    pub uptime: Duration,
    /// The tool.
    pub tool: Pose,
    /// The grip.
    pub grip: Grip,
    /// The name.
    pub name: Text<12>,
    /// The brakes.
    pub brakes: Sequence<Bool, 16>,
    /// The joints.
    pub joints: Sequence<Text<60>, 16>,
    /// The thumbs.
    pub thumbs: [Finger; 2],
    /// The type.
    pub r#type: u64,
    /// Temperatures of the joints
    #[unit("degC")]
    pub temperatures: Sequence<f32, 5>,
    /// The tag.
    pub tag: [u8; 4],
}

impl State {
    /// Constant of the message.
    pub const MODE_2D: u8 = 3;
    /// Of a joint (rad/s)
    pub const MAX_SPEED: f32 = 1.5;
    /// Constant of the message.
    pub const VENDOR: &str = "Arms # 1";
}
