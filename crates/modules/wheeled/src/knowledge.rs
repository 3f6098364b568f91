//! Knowledge of a wheeled robot: goal and robot model.

use slate_avoidance::{Parameters, Sides};
use slate_plugin::interfaces::{Chassis, Orientation, Point2, Pose2, Position, WheelSpeeds};
use slate_plugin::mapek::{Device, RobotModel};
use slate_plugin::prelude::*;

/// Model of a wheeled robot.
#[interface]
pub struct WheeledModel {
    /// Pose, sensors and actuators.
    pub robot: RobotModel,
    /// Outline and wheels.
    pub chassis: Chassis,
}

impl WheeledModel {
    /// Inverse kinematics: wheel speeds of a twist (m/s, rad/s); zero while the chassis is unknown.
    pub fn wheels_for(&self, linear: f64, angular: f64) -> WheelSpeeds {
        let (radius, half) = (self.chassis.wheel_radius, self.chassis.track / 2.0);
        // NaN is not greater than zero either.
        if !(radius > 0.0 && half > 0.0) {
            return WheelSpeeds::ZERO;
        }
        WheelSpeeds { left: (linear - angular * half) / radius, right: (linear + angular * half) / radius }
    }

    /// Usual deceleration, m/s², limited by the wheels; zero while the chassis is unknown.
    pub fn deceleration(&self) -> f64 {
        let greatest = self.chassis.maximum_wheel_acceleration * self.chassis.wheel_radius;
        math::min(Parameters::default().deceleration, greatest)
    }

    /// Response of the wheels of each side; `None` while the chassis is unknown.
    pub fn sides(&self) -> Option<Sides> {
        let Chassis { track, maximum_wheel_acceleration, wheel_radius, .. } = self.chassis;
        let acceleration = maximum_wheel_acceleration * wheel_radius;
        (track > 0.0 && acceleration > 0.0).then_some(Sides { track, acceleration })
    }
}

/// Inputs and facts of the knowledge.
#[ports]
pub struct WheeledModels {
    /// From the positioning system.
    position: Input<Position>,
    /// From the compass.
    orientation: Input<Orientation>,
    /// From the simulator or driver.
    chassis: Input<Chassis>,
    /// Goal of the robot.
    goal: Output<Point2>,
    /// Robot model and pose.
    robot: Output<WheeledModel>,
}

/// Parameters of [`WheeledKnowledge`].
#[params]
pub struct WheeledKnowledgeParams {
    #[param(default = 0.0, unit = "m", doc = "x of the goal")]
    goal_x: f64,
    #[param(default = 0.0, unit = "m", doc = "y of the goal")]
    goal_y: f64,
}

/// Knowledge of the robot.
pub struct WheeledKnowledge;

impl Knowledge for WheeledKnowledge {
    const NAME: &'static str = "wheeled_knowledge";
    const DOC: &'static str = "Knows the robot's goal and model.";
    type Models = WheeledModels;
    type Params = WheeledKnowledgeParams;
    type State = ();

    fn update(_: &mut (), models: &WheeledModels, params: &WheeledKnowledgeParams, _: &Tick) {
        models.goal.set(Point2 { x: params.goal_x, y: params.goal_y });
        // Without a chassis and a pose the model is unknown.
        let (Some(chassis), Some(position), Some(orientation)) =
            (models.chassis.fresh(), models.position.get(), models.orientation.get())
        else {
            return;
        };
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
