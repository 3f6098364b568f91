//! Conversion of simulated values to their interfaces.

use slate_interfaces::{
    Contact, FourWheelSpeeds, Imu, Pose2, Position, Quaternion, SonarPlacement, SonarScan, Transform,
    Vector3, WheelSpeeds,
};
use slate_module::{Sequence, Text, math};

use crate::drive::{FourWheels, Wheels};
use crate::geometry::Pose;
use crate::inertial::InertialReading;
use crate::robot::ImuDescription;
use crate::simulation::Simulation;

/// Converts wheel speeds; zero before the first command.
pub(super) fn two_wheels(wheels: Option<&WheelSpeeds>) -> FourWheels {
    let WheelSpeeds { left, right } = wheels.copied().unwrap_or(WheelSpeeds::ZERO);
    Wheels { left, right }.into()
}

pub(super) fn four_wheels(wheels: Option<&FourWheelSpeeds>) -> FourWheels {
    let wheels = wheels.copied().unwrap_or(FourWheelSpeeds::ZERO);
    let FourWheelSpeeds { front_left, front_right, back_left, back_right } = wheels;
    FourWheels { front_left, front_right, back_left, back_right }
}

pub(super) fn pose2(pose: Pose) -> Pose2 {
    Pose2 { x: pose.x, y: pose.y, theta: pose.theta }
}

/// Returns the mount of a sensor from x and y in meters and degrees.
pub(super) fn mount(sensor: &str, [x, y, degrees]: [f64; 3]) -> Transform {
    Transform {
        parent: Text::new("base_link"),
        child: Text::new(sensor),
        translation: Position { x, y, z: 0.0 },
        rotation: rotation(degrees.to_radians()),
        fixed: true.into(),
        ..Transform::default()
    }
}

/// Returns the rotation about z by an angle, rad.
pub(super) fn rotation(angle: f64) -> Quaternion {
    let half = angle / 2.0;
    Quaternion { z: math::sin(half), w: math::cos(half), ..Quaternion::IDENTITY }
}

/// Returns a measurement as its interface, with covariances by the description.
pub(super) fn measured(reading: &InertialReading, imu: &ImuDescription) -> Imu {
    let vector = |[x, y, z]: [f64; 3]| Vector3 { x, y, z };
    let diagonal = |x: f64, y: f64, z: f64| [x, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, z];
    let all = |noise: f64, bias: f64| {
        let variance = noise * noise + bias * bias;
        diagonal(variance, variance, variance)
    };
    Imu {
        orientation: rotation(reading.heading),
        orientation_covariance: diagonal(0.0, 0.0, reading.heading_variance),
        angular_velocity: vector(reading.angular_velocity),
        angular_velocity_covariance: all(imu.noise_angular_velocity, imu.bias_angular_velocity),
        linear_acceleration: vector(reading.acceleration),
        linear_acceleration_covariance: all(imu.noise_acceleration, imu.bias_acceleration),
    }
}

pub(super) fn report(contact: &crate::contact::Contact) -> Contact {
    Contact {
        time: contact.time,
        robot: Text::new(&contact.robot),
        other: Text::new(&contact.other),
        caused: contact.caused.into(),
        caused_by_other: contact.caused_by_other.into(),
    }
}

pub(super) fn ring(simulation: &Simulation, robot: usize) -> SonarScan {
    let Some((_, ring)) = simulation.sonar(robot) else { return SonarScan::default() };
    let description = ring.description();
    let placements: Vec<_> = description
        .placements
        .iter()
        .map(|[x, y, degrees]| SonarPlacement { x: *x, y: *y, theta: degrees.to_radians() })
        .collect();
    SonarScan {
        field_of_view: description.field_of_view,
        range_min: description.range_min,
        range_max: description.range_max,
        placements: Sequence::new(&placements),
        echoes: Sequence::default(),
    }
}
