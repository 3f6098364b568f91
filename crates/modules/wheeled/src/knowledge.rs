//! What the robot knows: its goal, and its own body.

use slate_avoidance::{Parameters, Sides};
use slate_plugin::interfaces::{Chassis, Orientation, Point2, Pose2, Position, WheelSpeeds};
use slate_plugin::mapek::prelude::*;
use slate_plugin::mapek::{Device, RobotModel};
use slate_plugin::prelude::*;

/// The body of a robot on wheels.
#[interface]
pub struct WheeledModel {
    /// Place, sensors and actuators.
    pub robot: RobotModel,
    /// Outline and wheels.
    pub chassis: Chassis,
}

impl WheeledModel {
    /// The wheels for a speed forward (m/s) and a turn (rad/s); still ones as long as the body is not known.
    pub fn wheels_for(&self, linear: f64, angular: f64) -> WheelSpeeds {
        let (radius, half) = (self.chassis.wheel_radius, self.chassis.track / 2.0);
        // Nor is what is no number.
        if !(radius > 0.0 && half > 0.0) {
            return WheelSpeeds::ZERO;
        }
        WheelSpeeds { left: (linear - angular * half) / radius, right: (linear + angular * half) / radius }
    }

    /// How hard it brakes when nothing hurries it, m/s²: a heavy robot less than others; not at all while the body is not known.
    pub fn deceleration(&self) -> f64 {
        let greatest = self.chassis.maximum_wheel_acceleration * self.chassis.wheel_radius;
        math::min(Parameters::default().deceleration, greatest)
    }

    /// How its sides follow commands; nothing while the body is not known.
    pub fn sides(&self) -> Option<Sides> {
        let Chassis { track, maximum_wheel_acceleration, wheel_radius, .. } = self.chassis;
        let acceleration = maximum_wheel_acceleration * wheel_radius;
        (track > 0.0 && acceleration > 0.0).then_some(Sides { track, acceleration })
    }
}

/// What it learns from, and what it knows.
#[ports]
pub struct WheeledModels {
    /// From the positioning system.
    position: Input<Position>,
    /// From the compass.
    orientation: Input<Orientation>,
    /// From whatever embodies the robot.
    chassis: Input<Chassis>,
    /// Where the robot shall go.
    goal: Output<Point2>,
    /// The robot's body and place.
    robot: Output<WheeledModel>,
}

/// What it is told from the beginning.
#[params]
pub struct WheeledKnowledgeParams {
    #[param(default = 0.0, unit = "m", doc = "goal, to the east")]
    goal_x: f64,
    #[param(default = 0.0, unit = "m", doc = "goal, to the north")]
    goal_y: f64,
}

/// The knowledge of the robot.
pub struct WheeledKnowledge;

impl Knowledge for WheeledKnowledge {
    const NAME: &'static str = "wheeled_knowledge";
    const DOC: &'static str = "Knows the robot's goal and its body.";
    type Models = WheeledModels;
    type Params = WheeledKnowledgeParams;
    type State = ();

    fn update(_: &mut (), models: &WheeledModels, params: &WheeledKnowledgeParams, _: &Tick) {
        models.goal.set(Point2 { x: params.goal_x, y: params.goal_y });
        // Without a body there is nothing to know of it.
        let Some(chassis) = models.chassis.fresh() else { return };
        let (position, orientation) = (&models.position, &models.orientation);
        let device = |name: &str| Device { mount: Pose2::default(), name: Text::new(name) };
        models.robot.set(WheeledModel {
            robot: RobotModel {
                pose: Pose2 { x: position.x, y: position.y, theta: orientation.theta },
                sensors: Sequence::new(&[device("sonar"), device("position"), device("orientation")]),
                actuators: Sequence::new(&[device("wheels")]),
            },
            chassis: *chassis,
        });
    }
}
