use slate_module::interface;

use crate::Twist2;

/// A point in the plane.
#[interface(ros = "geometry_msgs/msg/Point")]
#[derive(PartialEq)]
pub struct Point2 {
    /// To the front, or east in a map.
    #[unit("m")]
    pub x: f64,
    /// To the left, or north in a map.
    #[unit("m")]
    pub y: f64,
}

/// A place and a heading in the plane.
#[interface(ros = "geometry_msgs/msg/Pose2D")]
#[derive(PartialEq)]
pub struct Pose2 {
    /// To the front, or east in a map.
    #[unit("m")]
    pub x: f64,
    /// To the left, or north in a map.
    #[unit("m")]
    pub y: f64,
    /// Heading, counter-clockwise from x.
    #[unit("rad")]
    pub theta: f64,
}

/// Where something is believed to be, and how sure that is.
#[interface(ros = "geometry_msgs/msg/PoseWithCovarianceStamped")]
#[derive(PartialEq)]
pub struct PoseEstimate {
    /// The most likely place and heading.
    pub pose: Pose2,
    /// Covariance of x, y and theta, row after row: squares and products of metres and radians.
    pub covariance: [f64; 9],
}

/// A place in space, as a positioning system gives it.
#[interface(ros = "geometry_msgs/msg/Point")]
#[derive(PartialEq)]
pub struct Position {
    /// To the front, or east in a map.
    #[unit("m")]
    pub x: f64,
    /// To the left, or north in a map.
    #[unit("m")]
    pub y: f64,
    /// Up.
    #[unit("m")]
    pub z: f64,
}

/// A heading in the plane, as a compass gives it.
#[interface(ros = "geometry_msgs/msg/Quaternion")]
#[derive(PartialEq)]
pub struct Orientation {
    /// Counter-clockwise from x, in (-pi, pi].
    #[unit("rad")]
    pub theta: f64,
}

/// Where a robot believes to be from the turns of its wheels, and how it moves.
#[interface(ros = "nav_msgs/msg/Odometry")]
#[derive(PartialEq)]
pub struct Odometry {
    /// Since the start, in the frame in which it began.
    pub pose: Pose2,
    /// In the robot's own frame.
    pub twist: Twist2,
}
