use slate_module::{Sequence, Text, interface};

use crate::Point2;

/// The body of a robot on wheels that steers by driving its sides differently, as its maker describes it. Whatever embodies
/// the robot tells it: the simulator, or the driver of the real one.
#[interface(ros = "geometry_msgs/msg/PolygonStamped")]
#[derive(PartialEq)]
pub struct Chassis {
    /// Radius of the wheels.
    #[unit("m")]
    pub wheel_radius: f64,
    /// Distance between the sides as it counts for turning: of two wheels, where they stand; of four that skid, more.
    #[unit("m")]
    pub track: f64,
    /// The most that a wheel can turn.
    #[unit("rad/s")]
    pub maximum_wheel_speed: f64,
    /// How fast a wheel can become faster or slower.
    #[unit("rad/s^2")]
    pub maximum_wheel_acceleration: f64,
    /// Corners of its convex outline around its reference point, counter-clockwise.
    pub outline: Sequence<Point2, 16>,
    /// Its type, such as `pioneer_p3dx`.
    pub model: Text<28>,
}
