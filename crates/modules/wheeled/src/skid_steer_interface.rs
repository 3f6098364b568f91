//! Hardware interface of a skid-steered robot.
//! Its readers know no hardware.

use slate_plugin::interfaces::{Chassis, FourWheelSpeeds, LaserScan, Odometry, Twist2, WheelSpeeds};
use slate_plugin::mapek::{Kinematics, Steering};
use slate_plugin::prelude::*;

/// Ports of [`SkidSteerInterface`].
#[ports]
pub struct SkidSteerInterfaceIo {
    /// Geometry and limits of the robot, from its driver.
    chassis: Input<Chassis>,
    /// Odometry of the driver.
    driver_odometry: Input<Odometry>,
    /// Scan of the driver's laser.
    driver_scan: Input<LaserScan>,
    /// Velocity that the robot should have; without a fresh one it stops.
    #[stale(after = "300ms")]
    control_speed: Input<Twist2>,
    /// Odometry of the wheels.
    odometry: Output<Odometry>,
    /// Scan of the laser.
    #[capacity(4096)]
    laser_scan: Output<LaserScan>,
    /// Velocity of the robot, by its wheels.
    actual_speed: Output<Twist2>,
    /// Speeds of the four wheels.
    wheels: Command<FourWheelSpeeds>,
}

/// Hardware interface of a skid-steered robot: OpenRDK's `hwInterface`.
/// It publishes the sensors, and drives at a commanded velocity.
///
/// What is around it reads and writes velocities and scans, whichever driver or simulator is behind it.
pub struct SkidSteerInterface;

#[module(stage = SensorAcquire)]
impl Module for SkidSteerInterface {
    type Io = SkidSteerInterfaceIo;
    type Params = ();
    type State = ();

    fn tick((): &mut (), io: &SkidSteerInterfaceIo, (): &(), _: &Tick) -> Outcome {
        if let Some(odometry) = io.driver_odometry.updated() {
            io.odometry.set(*odometry);
            io.actual_speed.set(odometry.twist);
        }
        if io.driver_scan.is_new() {
            io.laser_scan.copy(&io.driver_scan);
        }
        let (Some(chassis), Some(speed)) = (io.chassis.get(), io.control_speed.fresh()) else {
            // Without a command the gate has its safe one.
            return Outcome::Ok;
        };
        io.wheels.send(wheels(chassis, *speed), Priority::Plan);
        Outcome::Ok
    }
}

/// Returns the wheel speeds for a velocity.
/// If one exceeds its limit, all are slowed by one factor, so that the robot keeps its curve.
fn wheels(chassis: &Chassis, speed: Twist2) -> FourWheelSpeeds {
    let kinematics = Kinematics {
        wheel_radius: chassis.wheel_radius,
        track: chassis.track,
        steering: Steering::SKID_STEER,
    };
    let WheelSpeeds { left, right } = kinematics.wheels_for(speed);
    let fastest = math::max(left.abs(), right.abs());
    let share =
        if fastest > chassis.maximum_wheel_speed { chassis.maximum_wheel_speed / fastest } else { 1.0 };
    let (left, right) = (share * left, share * right);
    FourWheelSpeeds { front_left: left, front_right: right, back_left: left, back_right: right }
}
