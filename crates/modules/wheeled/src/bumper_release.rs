//! Reflex: backs away from a pressed bumper.

use slate_avoidance::ReflexRules;
use slate_plugin::interfaces::{Bumper, WheelSpeeds};
use slate_plugin::prelude::*;

use crate::actions::{Release, ReleaseBumper};
use crate::knowledge::WheeledModel;
use crate::late_sensors::{is_blind, is_late};
use crate::rules::BUMPER;

/// Sensors and knowledge of the reflex.
#[ports]
pub struct BumperSensors {
    #[stale(after = "200ms")]
    bumper: Input<Bumper>,
    /// Which sensors must not stop, from Knowledge.
    rules: Input<ReflexRules>,
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
    #[param(default = 3.0, range = 0.1..=60.0, unit = "s", doc = "time after which a robot with a bumper that stays pressed stands")]
    release_timeout: f64,
}

/// Backs away from a pressed bumper, and by the release distance more. It has no memory: the action drives on after the release.
pub struct BumperReleaseModel;

impl ReactiveModel for BumperReleaseModel {
    const NAME: &'static str = "bumper_release_model";
    const DOC: &'static str = "Backs away from a pressed bumper.";
    /// Above the reflexes by range: a contact was not detected in time.
    const RANK: i32 = 2;
    type Sensors = BumperSensors;
    type Params = BumperReleaseParams;
    type State = ();

    fn run(
        (): &mut (),
        sensors: &BumperSensors,
        params: &BumperReleaseParams,
        now: &Tick,
    ) -> Option<ActionRequest> {
        let BumperSensors { bumper, rules, robot } = sensors;
        let robot = robot.get()?;
        let BumperReleaseParams { linear_velocity, release_distance, release_timeout: time_limit } = *params;
        if is_blind(BUMPER, bumper, rules, robot, now) {
            return Some(ReleaseBumper::request(Release {
                left: 0.0,
                right: 0.0,
                duration: HOLD,
                time_limit,
            }));
        }
        let bumper = bumper
            .get()
            .filter(|bumper| bumper.pressed() && !is_late(BUMPER, &sensors.bumper, robot, now))?;
        let direction = match (bumper.front.get(), bumper.back.get()) {
            (true, true) => 0.0,
            (true, false) => -1.0,
            _ => 1.0,
        };
        let WheelSpeeds { left, right } = robot.wheels_for(direction * linear_velocity, 0.0);
        let duration = math::max(release_distance / linear_velocity, HOLD);
        Some(ReleaseBumper::request(Release { left, right, duration, time_limit }))
    }
}

/// Duration of a stop unless it is renewed, seconds.
const HOLD: f64 = 0.2;
