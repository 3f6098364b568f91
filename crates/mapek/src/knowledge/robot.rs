use slate_interfaces::Pose2;
use slate_module::{Sequence, Text, interface};

/// Sensor or actuator of a robot.
#[interface]
#[derive(PartialEq)]
pub struct Device {
    /// Mount on the robot.
    pub mount: Pose2,
    /// Name in the robot, such as `sonar_front`.
    pub name: Text<36>,
}

/// Robot model: pose, sensors and actuators (RoCS, 5.1).
///
/// Extend it by an interface of your own with a field of this type:
///
/// ```
/// use slate_mapek::RobotModel;
/// use slate_module::interface;
///
/// /// A Pioneer 3-DX.
/// #[interface]
/// pub struct PioneerP3dxModel {
///     /// Place, sensors and actuators.
///     pub robot: RobotModel,
///     /// Radius of the wheels.
///     #[unit("m")]
///     pub wheel_radius: f64,
///     /// Distance between the wheels.
///     #[unit("m")]
///     pub track: f64,
/// }
/// ```
#[interface]
pub struct RobotModel {
    /// Pose in the map frame.
    pub pose: Pose2,
    /// Sensors.
    pub sensors: Sequence<Device, 16>,
    /// Actuators.
    pub actuators: Sequence<Device, 8>,
}
