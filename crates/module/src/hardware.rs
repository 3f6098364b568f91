use serde::{Deserialize, Serialize};

/// Drive and devices of a robot, from the description of that robot.
///
/// A Knowledge says it of the robot that its parameters name, a simulator or a driver of each robot that it moves. The two
/// must agree.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hardware {
    /// Name of the description, such as `pioneer_p3dx`.
    pub robot: String,
    /// Prefix of the names of the robot's ports, such as `r2/`; empty for all ports.
    #[serde(default)]
    pub ports: String,
    /// Setting that names the description; empty for none.
    /// It is `params.NAME` of the module, or a path such as `world.robots.r2.model`.
    #[serde(default)]
    pub setting: String,
    /// Drive, if it has wheels.
    #[serde(default)]
    pub drive: Option<HardwareDrive>,
    /// Sensors.
    #[serde(default)]
    pub sensors: Vec<HardwareDevice>,
    /// Actuators.
    #[serde(default)]
    pub actuators: Vec<HardwareDevice>,
}

/// Geometry of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HardwareDrive {
    /// Radius of the wheels, m.
    pub wheel_radius: f64,
    /// Effective track, m: that of a differential drive with the same turn rate.
    pub track: f64,
}

/// Sensor or actuator of a robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HardwareDevice {
    /// Name, such as `sonar`.
    pub name: String,
    /// Name of the interface of its values, such as `SonarScan`.
    pub interface: String,
    /// Number of its elements, such as 16 sonars of a ring.
    pub count: u32,
    /// Mount in the robot's frame (`base_link`): x and y in meters, heading in radians.
    pub mount: [f64; 3],
    /// Limits of the first number of its interface; `None` without limits.
    /// They are the least and the greatest value, and hold for all numbers with the same unit.
    #[serde(default)]
    pub limits: Option<[f64; 2]>,
}

impl HardwareDevice {
    /// Returns a single device in the middle of the robot, without limits.
    pub fn new(name: &str, interface: &str) -> Self {
        Self { name: name.into(), interface: interface.into(), count: 1, mount: [0.0; 3], limits: None }
    }
}

impl Hardware {
    /// Returns the sensor with values of that interface.
    pub fn sensor(&self, interface: &str) -> Option<&HardwareDevice> {
        self.sensors.iter().find(|device| device.interface == interface)
    }

    /// Returns the actuator of that name.
    pub fn actuator(&self, name: &str) -> Option<&HardwareDevice> {
        self.actuators.iter().find(|device| device.name == name)
    }
}
