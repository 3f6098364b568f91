//! Drive at a commanded velocity, for robots without blocks.

use slate_plugin::interfaces::{Chassis, Twist2, WheelSpeeds};
use slate_plugin::mapek::{Kinematics, Steering};
use slate_plugin::prelude::*;

/// Ports of [`VelocityControl`].
#[ports]
pub struct VelocityControlIo {
    /// Geometry and limits of the robot.
    chassis: Input<Chassis>,
    /// Velocity of the robot, until the next one or `velocity_timeout`.
    velocity: Input<Twist2>,
    /// Speeds of the two wheels.
    wheels: Command<WheelSpeeds>,
}

/// Parameters of [`VelocityControl`].
#[params]
pub struct VelocityControlParams {
    /// Age from which a velocity is no longer driven; 0 drives it until the next one.
    #[param(default = 0.2, range = 0.0..=3600.0, unit = "s", doc = "age from which a velocity is not driven; 0: until the next")]
    pub velocity_timeout: f64,
}

/// Drives a robot with two wheels at a commanded velocity.
///
/// If a wheel exceeds its limit, both are slowed by one factor, so that the robot keeps its curve. Without a velocity, with
/// an old one, or with a NaN target, the gate has its safe command.
pub struct VelocityControl;

#[module(stage = Act)]
impl Module for VelocityControl {
    type Io = VelocityControlIo;
    type Params = VelocityControlParams;
    type State = ();

    fn tick((): &mut (), io: &VelocityControlIo, params: &VelocityControlParams, now: &Tick) -> Outcome {
        let (Some(chassis), Some(velocity)) = (io.chassis.get(), io.velocity.get()) else {
            return Outcome::Ok;
        };
        let age = now.now().saturating_sub(io.velocity.stamp().time) as f64 * 1e-9;
        if params.velocity_timeout > 0.0 && age >= params.velocity_timeout {
            return Outcome::Degraded;
        }
        if !velocity.linear.is_finite() || !velocity.angular.is_finite() {
            return Outcome::Degraded;
        }
        io.wheels.send(wheels(chassis, *velocity), Priority::Plan);
        Outcome::Ok
    }
}

/// Returns the wheel speeds for a velocity, within the limit of the wheels.
fn wheels(chassis: &Chassis, velocity: Twist2) -> WheelSpeeds {
    let kinematics = Kinematics {
        wheel_radius: chassis.wheel_radius,
        track: chassis.track,
        steering: Steering::DIFFERENTIAL,
    };
    let WheelSpeeds { left, right } = kinematics.wheels_for(velocity);
    let fastest = math::max(left.abs(), right.abs());
    let share =
        if fastest > chassis.maximum_wheel_speed { chassis.maximum_wheel_speed / fastest } else { 1.0 };
    WheelSpeeds { left: share * left, right: share * right }
}
