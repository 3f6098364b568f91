//! What the actions of a robot on wheels act on, whichever wheels it has.

use slate_avoidance::approach_speed;
use slate_plugin::interfaces::{Orientation, Pose2, Position, WheelSpeeds};
use slate_plugin::prelude::*;

use crate::knowledge::WheeledModel;

/// A robot that steers by driving its sides differently.
pub trait WheeledBody {
    /// Where it is and how it is made.
    fn whereabouts(&self) -> &Whereabouts;

    /// Turns the wheels of both sides.
    fn turn_wheels(&self, speeds: WheelSpeeds, priority: Priority);
}

/// Where the robot is, and how it is made.
#[ports]
pub struct Whereabouts {
    /// From the positioning system.
    #[stale(after = "200ms")]
    position: Input<Position>,
    /// From the compass.
    #[stale(after = "200ms")]
    orientation: Input<Orientation>,
    /// The robot's body, from its knowledge.
    robot: Input<WheeledModel>,
}

impl Whereabouts {
    /// Where the robot is, unless its sensors have stopped or say what is not a number: an action that remembered that
    /// would never end.
    pub fn pose(&self) -> Option<Pose2> {
        let (position, orientation) = (self.position.fresh()?, self.orientation.fresh()?);
        let pose = Pose2 { x: position.x, y: position.y, theta: orientation.theta };
        (pose.x.is_finite() && pose.y.is_finite() && pose.theta.is_finite()).then_some(pose)
    }

    /// How fast (m/s) to go that far (metres) from a place to end at, of that speed at most: slower at the end, and never so fast
    /// that it could not brake.
    pub fn approach_speed(&self, speed: f64, distance: f64) -> f64 {
        approach_speed(speed, distance, self.robot.deceleration())
    }

    /// The wheels for a speed forward (m/s) and a turn (rad/s).
    pub fn wheels_for(&self, linear: f64, angular: f64) -> WheelSpeeds {
        self.robot.wheels_for(linear, angular)
    }
}
