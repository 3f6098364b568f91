use slate_interfaces::Pose2;
use slate_module::{Sequence, Text, interface};

/// A sensor or an actuator of a robot.
#[interface]
#[derive(PartialEq)]
pub struct Device {
    /// Where it sits on the robot.
    pub mount: Pose2,
    /// Its name in the robot, such as `sonar_front`.
    pub name: Text<36>,
}

/// What the robot knows of its own body: where it is and what it has (RoCS, 5.1).
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
    /// Where the robot is in the map.
    pub pose: Pose2,
    /// Its sensors.
    pub sensors: Sequence<Device, 16>,
    /// Its actuators.
    pub actuators: Sequence<Device, 8>,
}
