use slate_module::{Sequence, Text, interface};

use crate::Point2;

/// Geometry and limits of a wheeled robot with differential or skid steering.
///
/// The simulator or the driver of the robot publishes it.
#[interface(ros = "geometry_msgs/msg/PolygonStamped")]
#[derive(PartialEq)]
pub struct Chassis {
    /// Radius of the wheels.
    #[unit("m")]
    pub wheel_radius: f64,
    /// Effective track width: distance of two wheels; more for skid steering.
    #[unit("m")]
    pub track: f64,
    /// Maximum wheel speed.
    #[unit("rad/s")]
    pub maximum_wheel_speed: f64,
    /// Maximum wheel acceleration.
    #[unit("rad/s^2")]
    pub maximum_wheel_acceleration: f64,
    /// Convex footprint around the reference point, counter-clockwise.
    pub outline: Sequence<Point2, 16>,
    /// Robot model, such as `pioneer_p3dx`.
    pub model: Text<28>,
}
