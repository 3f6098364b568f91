use slate_module::interface;

use crate::Twist2;

/// Point in the plane.
#[interface(ros = "geometry_msgs/msg/Point")]
#[derive(PartialEq)]
pub struct Point2 {
    /// x: forward, or east in a map.
    #[unit("m")]
    pub x: f64,
    /// y: left, or north in a map.
    #[unit("m")]
    pub y: f64,
}

/// Planar pose.
///
/// NaN in any field says that the pose is unknown: check [`Pose2::is_known`] where that may be.
#[interface(ros = "geometry_msgs/msg/Pose2D")]
#[derive(PartialEq)]
pub struct Pose2 {
    /// x: forward, or east in a map.
    #[unit("m")]
    pub x: f64,
    /// y: left, or north in a map.
    #[unit("m")]
    pub y: f64,
    /// Heading, counter-clockwise from x.
    #[unit("rad")]
    pub theta: f64,
}

impl Pose2 {
    /// Pose that is unknown.
    pub const UNKNOWN: Self = Self { x: f64::NAN, y: f64::NAN, theta: f64::NAN };

    /// Returns whether the pose is known: all fields are finite numbers.
    pub fn is_known(&self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.theta.is_finite()
    }
}

/// Pose estimate with covariance; [`Pose2::UNKNOWN`] without an estimate.
#[interface(ros = "geometry_msgs/msg/PoseWithCovarianceStamped")]
#[derive(PartialEq)]
pub struct PoseEstimate {
    /// Mean.
    pub pose: Pose2,
    /// Covariance of x, y and theta, row by row; m², m rad and rad².
    pub covariance: [f64; 9],
}

/// Pose that a robot may have, of a particle filter.
#[interface]
#[derive(PartialEq)]
pub struct Particle {
    /// Pose in the map frame.
    pub pose: Pose2,
    /// Weight; the weights of all particles sum up to 1.
    pub weight: f64,
}

/// Particles of a particle filter.
#[interface]
pub struct ParticleCloud {
    /// Particles, in no order.
    pub particles: [Particle],
}

/// Position in space, as of a positioning system.
#[interface(ros = "geometry_msgs/msg/Point")]
#[derive(PartialEq)]
pub struct Position {
    /// x: forward, or east in a map.
    #[unit("m")]
    pub x: f64,
    /// y: left, or north in a map.
    #[unit("m")]
    pub y: f64,
    /// Coordinate along the z axis, up.
    #[unit("m")]
    pub z: f64,
}

/// Heading in the plane, as of a compass.
#[interface(ros = "geometry_msgs/msg/Quaternion")]
#[derive(PartialEq)]
pub struct Orientation {
    /// Counter-clockwise from x, in (-pi, pi].
    #[unit("rad")]
    pub theta: f64,
}

/// Wheel odometry.
#[interface(ros = "nav_msgs/msg/Odometry")]
#[derive(PartialEq)]
pub struct Odometry {
    /// Pose in the odometry frame, which is the pose at the start.
    pub pose: Pose2,
    /// Twist in the robot's frame.
    pub twist: Twist2,
}
