//! Reflex: backs away from a pressed bumper.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::Bumper;
use slate_plugin::prelude::*;

use crate::actions::{ReleaseBumper, Speeds};
use crate::knowledge::WheeledModel;

/// Sensors and knowledge of the reflex.
#[ports]
pub struct BumperSensors {
    #[stale(after = "200ms")]
    bumper: Input<Bumper>,
    /// Robot model, from Knowledge.
    robot: Input<WheeledModel>,
}

/// Parameters of [`BumperReleaseModel`].
#[params]
pub struct BumperReleaseParams {
    #[param(default = 0.15, range = 0.01..=1.0, unit = "m/s", doc = "linear velocity away from the contact")]
    linear_velocity: f64,
    #[param(default = 0.12, range = 0.0..=1.0, unit = "m", doc = "distance to travel after the bumper is released")]
    release_distance: f64,
    #[param(default = 3.0, range = 0.1..=60.0, unit = "s", doc = "time after which a bumper that stays pressed is left to other reflexes")]
    release_timeout: f64,
}

/// A release in progress.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub struct Release {
    /// Start time, seconds.
    since: f64,
    /// Time of the newest contact, seconds.
    pressed: f64,
    /// Direction: 1 ahead, -1 back, 0 if pressed on both sides.
    direction: f64,
}

/// Duration of a command unless it is renewed, seconds.
const HOLD: f64 = 0.1;

/// Backs away from a pressed bumper, and by the release distance more.
pub struct BumperReleaseModel;

impl ReactiveModel for BumperReleaseModel {
    const NAME: &'static str = "bumper_release_model";
    const DOC: &'static str = "Backs away from a pressed bumper.";
    /// Above the reflexes by range: a contact was not detected in time.
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
        if !bumper.pressed() && (now - release.pressed) * params.linear_velocity >= params.release_distance {
            *under_way = None;
            return None;
        }
        if now - release.since > params.release_timeout {
            return None;
        }
        let wheels = robot.wheels_for(release.direction * params.linear_velocity, 0.0);
        Some(ReleaseBumper::request(Speeds { left: wheels.left, right: wheels.right, duration: HOLD }))
    }
}
