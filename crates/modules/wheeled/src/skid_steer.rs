//! Four driven wheels that steer by skidding, such as those of a Summit XL.

use slate_plugin::interfaces::{FourWheelSpeeds, WheelSpeeds};
use slate_plugin::prelude::*;

use crate::actions::{
    AvoidObstacle, GoToOrigin, KeepWall, ReleaseBumper, SetWheelSpeed, TurnAngle, TurnToOrigin,
};
use crate::body::{BodyModel, WheeledBody};

/// Wheels of a drive that steers by skidding.
#[ports]
pub struct FourWheels {
    /// Velocities of all four wheels.
    #[safe(FourWheelSpeeds::ZERO)]
    wheels: Command<FourWheelSpeeds>,
}

/// Four driven wheels, such as those of a Summit XL.
pub type SkidSteerBody = (BodyModel, FourWheels);

impl WheeledBody for SkidSteerBody {
    fn model(&self) -> &BodyModel {
        &self.0
    }

    fn turn_wheels(&self, WheelSpeeds { left, right }: WheelSpeeds, priority: Priority) {
        let wheels =
            FourWheelSpeeds { front_left: left, front_right: right, back_left: left, back_right: right };
        self.1.wheels.send(wheels, priority);
    }
}

repertoire! {
    /// Actions of a robot with four driven wheels.
    pub enum SkidSteerActions for SkidSteerBody as "skid_steer_execute" {
        SetWheelSpeed, TurnAngle, TurnToOrigin, GoToOrigin, AvoidObstacle, ReleaseBumper, KeepWall
    }
}
