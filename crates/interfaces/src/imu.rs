use slate_module::interface;

use crate::Quaternion;

/// Vector in space.
#[interface(ros = "geometry_msgs/msg/Vector3")]
#[derive(PartialEq)]
pub struct Vector3 {
    /// x component: forward.
    pub x: f64,
    /// y component: left.
    pub y: f64,
    /// z component: up.
    pub z: f64,
}

/// Measurement of an inertial measurement unit, in its own frame.
///
/// A covariance, row by row, of zeros is unknown; its first element is -1 where the device measures no such thing.
#[interface(ros = "sensor_msgs/msg/Imu")]
#[derive(PartialEq)]
pub struct Imu {
    /// Rotation of the device in a frame with x east, y north and z up.
    pub orientation: Quaternion,
    /// Covariance of the rotation about x, y and z, rad².
    pub orientation_covariance: [f64; 9],
    /// Angular velocity about x, y and z, rad/s.
    pub angular_velocity: Vector3,
    /// Covariance of the angular velocity, rad²/s².
    pub angular_velocity_covariance: [f64; 9],
    /// Linear acceleration including the reaction to gravity, m/s².
    /// +9.8 m/s² in z while the device is level and at rest.
    pub linear_acceleration: Vector3,
    /// Covariance of the acceleration, m²/s⁴.
    pub linear_acceleration_covariance: [f64; 9],
}

impl Imu {
    /// Covariance of a quantity that the device does not measure.
    pub const NOT_MEASURED: [f64; 9] = [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
}
