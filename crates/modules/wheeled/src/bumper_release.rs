//! A reflex of a robot that touches something: it backs away from the side that is pressed.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::Bumper;
use slate_plugin::mapek::prelude::*;
use slate_plugin::prelude::*;

use crate::actions::{ReleaseBumper, Speeds};
use crate::knowledge::WheeledModel;

/// What presses on the robot.
#[ports]
pub struct BumperSensors {
    #[stale(after = "200ms")]
    bumper: Input<Bumper>,
    /// The robot's body, from its knowledge.
    robot: Input<WheeledModel>,
}

/// How it backs away.
#[params]
pub struct BumperReleaseParams {
    #[param(default = 0.15, range = 0.01..=1.0, unit = "m/s", doc = "how fast it backs away")]
    speed: f64,
    #[param(default = 0.12, range = 0.0..=1.0, unit = "m", doc = "how much farther it goes when nothing presses any more")]
    distance: f64,
    #[param(default = 3.0, range = 0.1..=60.0, unit = "s", doc = "who is still pressed after so long leaves it to the other reflexes until nothing presses")]
    patience: f64,
}

/// A release that is under way.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub struct Release {
    /// When it began, seconds.
    since: f64,
    /// When something pressed last, seconds.
    pressed: f64,
    /// The direction: 1 ahead, -1 back, 0 when it is pressed from both sides.
    direction: f64,
}

/// A command holds for this long unless it is renewed, seconds.
const HOLD: f64 = 0.1;

/// Backs away from what presses on the bumpers, and a bit farther.
pub struct BumperReleaseModel;

impl ReactiveModel for BumperReleaseModel {
    const NAME: &'static str = "bumper_release_model";
    const DOC: &'static str = "Backs away from what presses on the bumpers.";
    /// Above whatever looks ahead: what it did not see is here.
    const RANK: i32 = 2;
    type Sensors = BumperSensors;
    type Params = BumperReleaseParams;
    type State = Option<Release>;

    fn run(
        under_way: &mut Option<Release>,
        sensors: &BumperSensors,
        params: &BumperReleaseParams,
        now: &Tick,
    ) -> Option<ActionRequest> {
        let (bumper, robot) = (sensors.bumper.fresh()?, sensors.robot.fresh()?);
        let now = now.seconds();
        if bumper.pressed() {
            let release = under_way.get_or_insert(Release { since: now, pressed: now, direction: 0.0 });
            release.pressed = now;
            release.direction = match (bumper.front.get(), bumper.back.get()) {
                (true, true) => 0.0,
                (true, false) => -1.0,
                _ => 1.0,
            };
        }
        let release = (*under_way)?;
        if !bumper.pressed() && (now - release.pressed) * params.speed >= params.distance {
            *under_way = None;
            return None;
        }
        if now - release.since > params.patience {
            return None;
        }
        let wheels = robot.wheels_for(release.direction * params.speed, 0.0);
        Some(ReleaseBumper::request(Speeds { left: wheels.left, right: wheels.right, duration: HOLD }))
    }
}
