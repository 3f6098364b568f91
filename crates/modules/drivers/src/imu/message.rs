//! Messages of a VectorNav sensor: `VNYMR`, answers and errors.
//!
//! VectorNav, *VN-100 User Manual* (UM001), chapters on the ASCII protocol and on asynchronous outputs.

use slate_interfaces::{Quaternion, Vector3};
use slate_module::math::{cos, sin};

use crate::sentence::number;

/// Attitude, acceleration and angular velocity, in the axes of robots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InertialSample {
    /// Orientation of the device in the frame x east, y north, z up.
    /// The device's axes are x forward, y left, z up.
    pub orientation: Quaternion,
    /// Acceleration with that of gravity, m/s².
    pub acceleration: Vector3,
    /// Angular velocity, rad/s.
    pub angular_velocity: Vector3,
}

/// Message of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum VectorNavMessage<'a> {
    /// `VNYMR`: yaw, pitch, roll, magnetic field, acceleration, angular velocity.
    Sample(InertialSample),
    /// Answer to a read of register 1: the model.
    Model(&'a str),
    /// Answer to a write of that register.
    Written(u8),
    /// Error, by its code.
    Error(u8),
}

impl<'a> VectorNavMessage<'a> {
    /// Parses the body of a sentence.
    /// `None` for other messages, and for an invalid field.
    pub fn parse(body: &'a str) -> Option<Self> {
        let (name, rest) = body.split_once(',')?;
        match name {
            "VNYMR" => sample(rest).map(Self::Sample),
            "VNRRG" => Some(Self::Model(rest.strip_prefix("01,").or_else(|| rest.strip_prefix("1,"))?)),
            "VNWRG" => Some(Self::Written(rest.split(',').next()?.parse().ok()?)),
            "VNERR" => Some(Self::Error(u8::from_str_radix(rest.get(..2)?, 16).ok()?)),
            _ => None,
        }
    }
}

fn sample(fields: &str) -> Option<InertialSample> {
    let mut values = [0.0; 12];
    let mut fields = fields.split(',');
    for value in &mut values {
        *value = fields.next().and_then(number)?;
    }
    let [yaw, pitch, roll, _, _, _, ax, ay, az, wx, wy, wz] = values;
    Some(InertialSample {
        orientation: orientation(yaw.to_radians(), pitch.to_radians(), roll.to_radians()),
        acceleration: turned(ax, ay, az),
        angular_velocity: turned(wx, wy, wz),
    })
}

/// Converts a vector between axes right, down and axes left, up.
/// From x forward, y right, z down to x forward, y left, z up; or back.
fn turned(x: f64, y: f64, z: f64) -> Vector3 {
    Vector3 { x, y: -y, z: -z }
}

/// Returns the rotation of the robot's axes in the frame x east, y north, z up.
/// The angles rotate x forward, y right, z down in the frame x north, y east, z down: yaw clockwise from north, then
/// pitch, nose up, then roll, right side down.
fn orientation(yaw: f64, pitch: f64, roll: f64) -> Quaternion {
    let half = |angle: f64| (sin(angle / 2.0), cos(angle / 2.0));
    // Counter-clockwise from east, nose down, right side down.
    let (yaw_sine, yaw_cosine) = half(std::f64::consts::FRAC_PI_2 - yaw);
    let (pitch_sine, pitch_cosine) = half(-pitch);
    let (roll_sine, roll_cosine) = half(roll);
    Quaternion {
        x: roll_sine * pitch_cosine * yaw_cosine - roll_cosine * pitch_sine * yaw_sine,
        y: roll_cosine * pitch_sine * yaw_cosine + roll_sine * pitch_cosine * yaw_sine,
        z: roll_cosine * pitch_cosine * yaw_sine - roll_sine * pitch_sine * yaw_cosine,
        w: roll_cosine * pitch_cosine * yaw_cosine + roll_sine * pitch_sine * yaw_sine,
    }
}

/// Returns the text of an error code.
pub fn error_text(code: u8) -> &'static str {
    match code {
        1 => "hard fault",
        2 => "serial buffer overflow",
        3 => "invalid checksum",
        4 => "invalid command",
        5 => "not enough parameters",
        6 => "too many parameters",
        7 => "invalid parameter",
        8 => "invalid register",
        9 => "unauthorized access",
        10 => "watchdog reset",
        11 => "output buffer overflow",
        12 => "insufficient baud rate for the messages",
        _ => "unknown error",
    }
}
