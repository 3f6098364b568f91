//! Robot models as data: conversion of a controller's units to SI.

use slate_interfaces::{Chassis, Point2};
use slate_module::{Sequence, Text};

/// Type of robot.
///
/// Conversion factors, sonars and bumpers are those of the parameter files that ARIA, the manufacturer's library, has
/// for the models (`params/<name>.p`); wheels and cones are those of `robots/pioneer_p3dx.toml`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Model {
    /// Name at the controller.
    pub name: &'static str,
    /// Unit of distance, meters.
    pub distance: f64,
    /// Radians in a unit of angle: there are 4096 in a turn.
    pub angle: f64,
    /// Unit of speed, meters per second.
    pub speed: f64,
    /// Unit of a sonar's range, meters.
    pub range: f64,
    /// Maximum linear velocity, m/s.
    pub maximum_speed: f64,
    /// Maximum angular velocity, degrees/s.
    pub maximum_rotation: f64,
    /// Radius of a wheel, meters.
    pub wheel_radius: f64,
    /// Distance between the wheels, meters.
    pub track: f64,
    /// Maximum acceleration of a wheel, rad/s².
    pub maximum_wheel_acceleration: f64,
    /// Corners of the convex outline around the axle's midpoint, meters.
    /// They are in counter-clockwise order.
    pub outline: [[f64; 2]; 12],
    /// Minimum range, meters.
    pub range_min: f64,
    /// Maximum range, meters; longer readings mean no echo.
    pub range_max: f64,
    /// Radians, the full opening of a sonar's cone.
    pub field_of_view: f64,
    /// Mounting poses of the sonars by number: x, y in meters, direction in degrees.
    pub sonars: [[f64; 3]; 16],
}

/// Pioneer 3-DX with the most common controller.
const P3DX_SH: Model = Model {
    name: "p3dx-sh",
    distance: 0.001,
    angle: std::f64::consts::TAU / 4096.0,
    speed: 0.001,
    range: 0.001,
    maximum_speed: 2.2,
    maximum_rotation: 500.0,
    wheel_radius: 0.0975,
    track: 0.331,
    maximum_wheel_acceleration: 20.0,
    outline: [
        [0.19, 0.05],
        [0.155, 0.11],
        [0.0975, 0.1905],
        [-0.0975, 0.1905],
        [-0.215, 0.13],
        [-0.265, 0.05],
        [-0.265, -0.05],
        [-0.215, -0.13],
        [-0.0975, -0.1905],
        [0.0975, -0.1905],
        [0.155, -0.11],
        [0.19, -0.05],
    ],
    range_min: 0.1,
    range_max: 5.0,
    field_of_view: std::f64::consts::FRAC_PI_6,
    sonars: [
        [0.069, 0.136, 90.0],
        [0.114, 0.119, 50.0],
        [0.148, 0.078, 30.0],
        [0.166, 0.027, 10.0],
        [0.166, -0.027, -10.0],
        [0.148, -0.078, -30.0],
        [0.114, -0.119, -50.0],
        [0.069, -0.136, -90.0],
        [-0.157, -0.136, -90.0],
        [-0.203, -0.119, -130.0],
        [-0.237, -0.078, -150.0],
        [-0.255, -0.027, -170.0],
        [-0.255, 0.027, 170.0],
        [-0.237, 0.078, 150.0],
        [-0.203, 0.119, 130.0],
        [-0.157, 0.136, 90.0],
    ],
};

/// Known robot models.
/// The first Pioneer 3-DX robots use another distance unit.
pub const MODELS: [Model; 2] = [P3DX_SH, Model { name: "p3dx", distance: 0.000485, ..P3DX_SH }];

impl Model {
    /// Returns the robot's body, as its blocks know it.
    pub fn chassis(&self) -> Chassis {
        Chassis {
            wheel_radius: self.wheel_radius,
            track: self.track,
            maximum_wheel_speed: self.maximum_speed / self.wheel_radius,
            maximum_wheel_acceleration: self.maximum_wheel_acceleration,
            outline: Sequence::new(&self.outline.map(|[x, y]| Point2 { x, y })),
            model: Text::new("pioneer_p3dx"),
        }
    }

    /// Returns the robot of that name.
    pub fn named(name: &str) -> Option<&'static Self> {
        MODELS.iter().find(|model| model.name == name)
    }

    /// Returns the model of a reported name.
    /// A robot with a laser scanner adds the scanner's name.
    pub fn reported(name: &str) -> Option<&'static Self> {
        let name = name.to_ascii_lowercase();
        MODELS.iter().find(|model| {
            name.strip_prefix(model.name).is_some_and(|rest| rest.is_empty() || rest.starts_with("-lms"))
        })
    }

    /// Returns forward velocity (mm/s) and turn rate (degrees/s) of wheel velocities.
    /// Wheel velocities are in rad/s. The result is clamped to what the robot accepts; 0 for a value that is not
    /// finite.
    pub fn motion(&self, left: f64, right: f64) -> (i16, i16) {
        let (left, right) = (left * self.wheel_radius, right * self.wheel_radius);
        let velocity = (left + right) / 2.0 / self.speed;
        let rotation = ((right - left) / self.track).to_degrees();
        (whole(velocity, self.maximum_speed / self.speed), whole(rotation, self.maximum_rotation))
    }
}

/// Returns the nearest whole number within the limit.
fn whole(value: f64, limit: f64) -> i16 {
    if value.is_finite() { value.clamp(-limit, limit).round() as i16 } else { 0 }
}
