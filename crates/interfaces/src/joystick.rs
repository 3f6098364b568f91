use slate_module::{Sequence, interface};

/// State of a joystick or gamepad.
#[interface(ros = "sensor_msgs/msg/Joy")]
#[derive(PartialEq)]
pub struct Joy {
    /// Axes from -1 to 1: forward and left are positive.
    pub axes: Sequence<f32, 16>,
    /// Buttons: 1 while pressed, else 0.
    pub buttons: Sequence<i32, 32>,
}
