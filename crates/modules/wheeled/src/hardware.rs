//! Hardware that the RobotModel of a wheeled robot describes.

use slate_avoidance::SONAR;
use slate_plugin::interfaces::{
    Bumper, FourWheelSpeeds, LaserScan, Odometry, Orientation, Position, Sightings, SonarScan, WheelSpeeds,
};
use slate_plugin::module::{Hardware, HardwareDevice, HardwareDrive};
use slate_plugin::prelude::*;
use slate_robots::{DeviceDescription, RobotDevices};

/// Name of the wheel encoders in a robot model.
pub const ODOMETRY: &str = "odometry";
/// Name of the positioning system in a robot model.
pub const POSITION: &str = "position";
/// Name of the compass in a robot model.
pub const ORIENTATION: &str = "orientation";

/// Returns the hardware of a robot by its description.
/// The parameter `robot` of its Knowledge names the description.
pub fn hardware_of(devices: RobotDevices) -> Hardware {
    let device = |interface: &'static str| {
        move |device: &DeviceDescription| HardwareDevice {
            name: device.name.into(),
            interface: interface.into(),
            count: u32::try_from(device.count).unwrap_or(u32::MAX),
            mount: device.mount,
            limits: (device.minimum < device.maximum).then_some([device.minimum, device.maximum]),
        }
    };
    let interface = |name: &str| match name {
        SONAR => SonarScan::DESCRIPTOR.name,
        POSITION => Position::DESCRIPTOR.name,
        ORIENTATION => Orientation::DESCRIPTOR.name,
        ODOMETRY => Odometry::DESCRIPTOR.name,
        "bumper" => Bumper::DESCRIPTOR.name,
        "laser" => LaserScan::DESCRIPTOR.name,
        _ => Sightings::DESCRIPTOR.name,
    };
    let wheels = match devices.drive.is_skid_steer {
        true => FourWheelSpeeds::DESCRIPTOR.name,
        false => WheelSpeeds::DESCRIPTOR.name,
    };
    let sensors = devices.sensors.iter().map(|sensor| device(interface(sensor.name))(sensor));
    Hardware {
        ports: String::new(),
        setting: "params.robot".into(),
        drive: Some(HardwareDrive { wheel_radius: devices.drive.wheel_radius, track: devices.drive.track }),
        sensors: sensors.collect(),
        actuators: devices.actuators.iter().map(device(wheels)).collect(),
        robot: devices.name,
    }
}
