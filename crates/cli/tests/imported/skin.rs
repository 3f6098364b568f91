// arm_msgs/msg/Skin, for topics of ROS 2 such as
// read."module/input" = { topic = "/skin", definition = "arm_msgs/msg/Skin.msg" }
// Its `pressures` has any length: ports of it take `#[capacity(n)]`.
use slate_plugin::prelude::*;

/// `arm_msgs/msg/Skin` of ROS.
#[interface(ros = "arm_msgs/msg/Skin")]
pub struct Skin {
    /// Pressure of each cell, row by row
    #[unit("Pa")]
    pub columns: u32,
    /// The pressures.
    pub pressures: [f32],
}
