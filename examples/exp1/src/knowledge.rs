//! What the robot knows: its goal, and its own body.

use slate_plugin::interfaces::{Orientation, Point2, Pose2, Position};
use slate_plugin::mapek::prelude::*;
use slate_plugin::mapek::{Device, RobotModel};
use slate_plugin::prelude::*;

/// The body of a Pioneer P3-DX.
#[interface]
pub struct PioneerP3dxModel {
    /// Place, sensors and actuators.
    pub robot: RobotModel,
    /// Radius of the wheels.
    #[unit("m")]
    pub wheel_radius: f64,
    /// Distance between the wheels.
    #[unit("m")]
    pub track: f64,
}

/// What it learns from, and what it knows.
#[ports]
pub struct PioneerModels {
    /// From the positioning system.
    position: Input<Position>,
    /// From the compass.
    orientation: Input<Orientation>,
    /// Where the robot shall go.
    goal: Output<Point2>,
    /// The robot's body and place.
    robot: Output<PioneerP3dxModel>,
}

/// What it is told from the beginning.
#[params]
pub struct PioneerParams {
    #[param(default = 0.0, unit = "m", doc = "goal, to the east")]
    goal_x: f64,
    #[param(default = 0.0, unit = "m", doc = "goal, to the north")]
    goal_y: f64,
    #[param(default = 0.0975, range = 0.001..=10.0, unit = "m", doc = "radius of the wheels")]
    wheel_radius: f64,
    #[param(default = 0.331, range = 0.001..=10.0, unit = "m", doc = "distance between the wheels")]
    track: f64,
}

/// The knowledge of the robot.
pub struct PioneerKnowledge;

impl Knowledge for PioneerKnowledge {
    const NAME: &'static str = "pioneer_knowledge";
    const DOC: &'static str = "Knows the robot's goal and its body.";
    type Models = PioneerModels;
    type Params = PioneerParams;
    type State = ();

    fn update(_: &mut (), models: &PioneerModels, params: &PioneerParams, _: &Tick) {
        models.goal.set(Point2 { x: params.goal_x, y: params.goal_y });
        let (position, orientation) = (&models.position, &models.orientation);
        let device = |name: &str| Device { mount: Pose2::default(), name: Text::new(name) };
        models.robot.set(PioneerP3dxModel {
            robot: RobotModel {
                pose: Pose2 { x: position.x, y: position.y, theta: orientation.theta },
                sensors: Sequence::new(&[device("sonar"), device("position"), device("orientation")]),
                actuators: Sequence::new(&[device("wheels")]),
            },
            wheel_radius: params.wheel_radius,
            track: params.track,
        });
    }
}
