//! Drives: response of the wheels, kinematics and odometry.

mod differential;
mod odometer;
mod omni;
mod skid_steer;

use serde::{Deserialize, Serialize};
use slate_module::Random;
use slate_module::math::clamp;

use crate::geometry::{Point, Pose};
use crate::robot::{DriveDescription, DriveKind, NoiseDescription, OdometryDescription};

pub use differential::Differential;
pub use omni::Omni;
pub use skid_steer::{Mass, SkidSteer, Velocity};

/// Wheel speeds of the two sides, rad/s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Wheels {
    /// Left side.
    pub left: f64,
    /// Right side.
    pub right: f64,
}

/// Speeds of four wheels, rad/s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FourWheels {
    /// Front left wheel.
    pub front_left: f64,
    /// Front right wheel.
    pub front_right: f64,
    /// Back left wheel.
    pub back_left: f64,
    /// Back right wheel.
    pub back_right: f64,
}

impl From<Wheels> for FourWheels {
    fn from(Wheels { left, right }: Wheels) -> Self {
        Self { front_left: left, front_right: right, back_left: left, back_right: right }
    }
}

impl From<FourWheels> for Wheels {
    /// Averages the wheels of each side.
    fn from(wheels: FourWheels) -> Self {
        Self {
            left: (wheels.front_left + wheels.back_left) / 2.0,
            right: (wheels.front_right + wheels.back_right) / 2.0,
        }
    }
}

/// Drive of a robot.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Drive {
    /// Two wheels without slip, which determine the motion.
    Differential(Differential),
    /// Four wheels with friction, which exert forces.
    SkidSteer(SkidSteer),
    /// Omni wheels, which determine the motion.
    Omni(Omni),
}

impl Drive {
    /// Creates a standing drive with the biases of this run.
    /// `mass` and `center` are the body's mass and center of mass.
    pub fn new(
        description: &DriveDescription,
        noise: &NoiseDescription,
        mass: f64,
        center: Point,
        random: Random,
    ) -> Self {
        match description.kind {
            DriveKind::Differential => Self::Differential(Differential::new(*description, noise, random)),
            DriveKind::SkidSteer => Self::SkidSteer(SkidSteer::new(description, noise, mass, center, random)),
            DriveKind::Omni => Self::Omni(Omni::new(*description, noise, random)),
        }
    }

    /// Sets the wheel speeds, saturated at their limits; 0 for NaN.
    /// A drive of two wheels takes the average of each side, and one of omni wheels turns as if it had two.
    pub fn command(&mut self, wheels: FourWheels) {
        match self {
            Self::Differential(drive) => drive.command(wheels.into()),
            Self::SkidSteer(drive) => drive.command(wheels),
            Self::Omni(drive) => drive.command_sides(wheels.into()),
        }
    }

    /// Sets the speeds of omni wheels in their order, rad/s; other drives ignore it.
    pub fn command_omni(&mut self, speeds: impl IntoIterator<Item = f64>) {
        if let Self::Omni(drive) = self {
            drive.command(speeds);
        }
    }

    /// Sets the velocity of omni wheels; other drives ignore it.
    pub fn command_velocity(&mut self, velocity: Velocity) {
        if let Self::Omni(drive) = self {
            drive.command_velocity(velocity);
        }
    }

    /// Adds systematic errors of the odometry in this run.
    pub fn set_odometry_bias(&mut self, bias: &OdometryDescription, random: Random) {
        match self {
            Self::Differential(drive) => drive.odometer.set_bias(bias, random),
            Self::SkidSteer(drive) => drive.odometer.set_bias(bias, random),
            Self::Omni(drive) => drive.set_bias(bias, random),
        }
    }

    /// Returns pose and twist (m/s, rad/s) by odometry.
    pub fn odometry(&self) -> (Pose, (f64, f64)) {
        let odometer = match self {
            Self::Differential(drive) => &drive.odometer,
            Self::SkidSteer(drive) => &drive.odometer,
            Self::Omni(drive) => return drive.odometry(),
        };
        (odometer.pose, odometer.measured)
    }
}

/// Returns the next wheel speed from `speed` towards `command`, rate-limited.
/// The limit is `change`.
fn follow(speed: f64, command: f64, change: f64) -> f64 {
    speed + clamp(command - speed, -change, change)
}

/// Limits a command; 0 for NaN.
fn held(speed: f64, limit: f64) -> f64 {
    if speed.is_finite() { clamp(speed, -limit, limit) } else { 0.0 }
}
