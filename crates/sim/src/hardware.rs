//! Hardware of the simulated robots, with which their RobotModels must agree.

use slate_interfaces::{
    Bumper, FourWheelSpeeds, Image, Imu, LaserScan, Odometry, OmniWheelSpeeds, Orientation, PanTiltState,
    Position, Sightings, SonarScan, WheelSpeeds,
};
use slate_module::{Hardware, HardwareDevice, HardwareDrive, Interface};

use crate::robot::DriveKind;
use crate::scenario::Scenario;
use crate::simulation::Placement;

/// Returns the hardware of a robot: drive, sensors and wheels.
/// They come from its description and its selected profiles.
pub fn hardware(scenario: &Scenario, placement: &Placement) -> Hardware {
    let description = &placement.description;
    let drive = &description.drive;
    let wheels = match drive.kind {
        DriveKind::Differential => WheelSpeeds::DESCRIPTOR,
        DriveKind::SkidSteer => FourWheelSpeeds::DESCRIPTOR,
        DriveKind::Omni => OmniWheelSpeeds::DESCRIPTOR,
    };
    let mounted = |device: HardwareDevice, [x, y, degrees]: [f64; 3]| HardwareDevice {
        mount: [x, y, degrees.to_radians()],
        ..device
    };
    let mut sensors = vec![
        HardwareDevice::new("position", Position::DESCRIPTOR.name),
        HardwareDevice::new("orientation", Orientation::DESCRIPTOR.name),
        HardwareDevice::new("odometry", Odometry::DESCRIPTOR.name),
    ];
    if let Some(sonar) = description.sonar.get(&placement.sonar) {
        let count = u32::try_from(sonar.placements.len()).unwrap_or(u32::MAX);
        sensors.push(HardwareDevice { count, ..HardwareDevice::new("sonar", SonarScan::DESCRIPTOR.name) });
    }
    if description.bumper.is_some() {
        sensors.push(HardwareDevice::new("bumper", Bumper::DESCRIPTOR.name));
    }
    if let Some(laser) = scenario.lasers.get(&placement.name) {
        sensors.push(mounted(HardwareDevice::new("laser", LaserScan::DESCRIPTOR.name), laser.mount));
    }
    if let Some(camera) = scenario.cameras.get(&placement.name) {
        let [x, y, _, yaw, _] = camera.mount;
        sensors.push(mounted(HardwareDevice::new("camera", Image::DESCRIPTOR.name), [x, y, yaw]));
        if camera.head.is_some() {
            sensors
                .push(mounted(HardwareDevice::new("pan_tilt", PanTiltState::DESCRIPTOR.name), [x, y, yaw]));
        }
    }
    if let Some(sensor) = placement.robot_sensor() {
        sensors.push(mounted(HardwareDevice::new("robot_sensor", Sightings::DESCRIPTOR.name), sensor.mount));
    }
    if scenario.imus.contains(&placement.name) {
        sensors.push(mounted(HardwareDevice::new("imu", Imu::DESCRIPTOR.name), placement.imu().mount));
    }
    Hardware {
        robot: description.name.clone(),
        ports: format!("{}/", placement.name),
        setting: format!("world.robots.{}.model", placement.name),
        drive: Some(HardwareDrive {
            wheel_radius: drive.wheel_radius,
            track: drive.odometry_track.unwrap_or(drive.track),
        }),
        sensors,
        actuators: vec![HardwareDevice::new("wheels", wheels.name)],
    }
}
