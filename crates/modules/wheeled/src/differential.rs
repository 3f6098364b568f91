//! Two driven wheels, such as those of a Pioneer.

use slate_plugin::interfaces::WheelSpeeds;
use slate_plugin::prelude::*;

use crate::actions::{
    AvoidObstacle, GoToOrigin, KeepWall, ReleaseBumper, SetWheelSpeed, TurnAngle, TurnToOrigin,
};
use crate::body::{BodyModel, WheeledBody};

/// Wheels of a differential drive.
#[ports]
pub struct TwoWheels {
    /// Both wheels.
    #[safe(WheelSpeeds::ZERO)]
    wheels: Command<WheelSpeeds>,
}

/// Two driven wheels, such as those of a Pioneer.
pub type DifferentialBody = (BodyModel, TwoWheels);

impl WheeledBody for DifferentialBody {
    fn model(&self) -> &BodyModel {
        &self.0
    }

    fn turn_wheels(&self, speeds: WheelSpeeds, priority: Priority) {
        self.1.wheels.send(speeds, priority);
    }
}

repertoire! {
    /// Actions of a robot with two driven wheels.
    pub enum DifferentialActions for DifferentialBody as "differential_execute" {
        SetWheelSpeed, TurnAngle, TurnToOrigin, GoToOrigin, AvoidObstacle, ReleaseBumper, KeepWall
    }
}
