//! Robots as TOML.
//! `slate-sim` reads them by name, and [`RobotDevices`] has a robot's knowledge of itself.

mod devices;

pub use devices::{DescriptionProblem, DeviceDescription, Drive, RobotDevices, SensorProfiles};

/// Name and description of each robot.
pub const ROBOTS: [(&str, &str); 3] = [
    ("pioneer_p3dx", include_str!("pioneer_p3dx.toml")),
    ("summit_xl", include_str!("summit_xl.toml")),
    ("robotino", include_str!("robotino.toml")),
];
