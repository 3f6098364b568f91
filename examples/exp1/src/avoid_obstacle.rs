//! The reactive behaviour: round what the sonars hear, towards the goal.

use slate_avoidance::{Avoider, Decision, Footprint, Parameters};
use slate_plugin::interfaces::{Orientation, Point2, Pose2, Position, SonarScan};
use slate_plugin::mapek::prelude::*;
use slate_plugin::prelude::*;

use crate::actions::{AvoidObstacle, Evasion};
use crate::knowledge::PioneerP3dxModel;

/// The sensors it reacts to, and what it knows.
#[ports]
pub struct AvoidObstacleSensors {
    #[stale(after = "200ms")]
    sonar: Input<SonarScan>,
    #[stale(after = "200ms")]
    position: Input<Position>,
    #[stale(after = "200ms")]
    orientation: Input<Orientation>,
    /// Where the robot shall go, from its knowledge.
    goal: Input<Point2>,
    /// The robot's body, from its knowledge.
    robot: Input<PioneerP3dxModel>,
}

/// How it avoids.
#[params]
pub struct AvoidObstacleParams {
    #[param(default = 0.4, range = 0.0..=1.2, unit = "m/s", doc = "highest speed forward")]
    speed: f64,
    #[param(default = 1.2, range = 0.1..=5.0, unit = "rad/s", doc = "highest rate of turn")]
    turn_rate: f64,
    #[param(default = 0.025, range = 0.0..=1.0, unit = "m", doc = "least distance to what stands")]
    margin: f64,
}

/// The outline of the robot with its sonars and wheels, around the midpoint of its axle, metres.
pub const FOOTPRINT: [[f64; 2]; 12] = [
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
];

/// A command holds for this long unless it is renewed, seconds.
const HOLD: f64 = 0.1;

/// Leads the robot round what its sonars hear.
pub struct AvoidObstacleModel;

impl ReactiveModel for AvoidObstacleModel {
    const NAME: &'static str = "avoid_obstacle_model";
    const DOC: &'static str = "Leads the robot round what its sonars hear.";
    type Sensors = AvoidObstacleSensors;
    type Params = AvoidObstacleParams;
    type State = Option<Avoider>;

    fn run(
        avoider: &mut Option<Avoider>,
        sensors: &AvoidObstacleSensors,
        params: &AvoidObstacleParams,
        now: &Tick,
    ) -> Option<ActionRequest> {
        let (scan, position, orientation) =
            (sensors.sonar.fresh()?, sensors.position.fresh()?, sensors.orientation.fresh()?);
        let (goal, robot) = (sensors.goal.fresh()?, sensors.robot.fresh()?);
        let avoider = match avoider {
            Some(avoider) => avoider,
            // The outline is convex, so this can't fail; without one there is no reflex.
            None => avoider.insert(Avoider::new(Footprint::new(&FOOTPRINT).ok()?)),
        };
        let pose = Pose2 { x: position.x, y: position.y, theta: orientation.theta };
        let parameters = Parameters {
            speed: params.speed,
            turn_rate: params.turn_rate,
            margin: params.margin,
            ..Parameters::default()
        };
        avoider.hear(pose, scan, &parameters, now.seconds());
        let Decision::Avoid(twist) = avoider.steer(pose, *goal, &parameters, now.seconds()) else {
            return None;
        };
        let half = robot.track / 2.0;
        let wheel = |side: f64| (twist.linear + side * twist.angular * half) / robot.wheel_radius;
        Some(AvoidObstacle::request(Evasion {
            angle: 0.0,
            left: wheel(-1.0),
            right: wheel(1.0),
            duration: HOLD,
        }))
    }
}
