//! Reflex: backs away from a pressed bumper.

use slate_plugin::interfaces::{Bumper, WheelSpeeds};
use slate_plugin::prelude::*;

use crate::actions::{Release, ReleaseBumper};
use crate::knowledge::WheeledModel;
use crate::late_sensors::{has_no_model, is_blind, is_late};
use crate::rules::{BUMPER, BumperReleaseRules, WheeledRules};

/// Sensors and knowledge of the reflex.
#[ports]
pub struct BumperSensors {
    #[stale(after = "200ms")]
    bumper: Input<Bumper>,
    /// Thresholds, from Knowledge.
    rules: Input<WheeledRules>,
    /// Robot model, from Knowledge.
    robot: Input<WheeledModel>,
}

/// Backs away from a pressed bumper, and by the release distance more.
/// It has no memory: the action drives on after the release.
pub struct BumperReleaseModel;

impl ReactiveModel for BumperReleaseModel {
    const NAME: &'static str = "bumper_release_model";
    const DOC: &'static str = "Backs away from a pressed bumper.";
    /// Above the reflexes by range: a contact was not detected in time.
    const RANK: i32 = 2;
    type Sensors = BumperSensors;
    type Params = ();
    type State = ();

    fn run((): &mut (), sensors: &BumperSensors, (): &(), now: &Tick) -> Option<ActionRequest> {
        let BumperSensors { bumper, rules, robot } = sensors;
        let known = rules.get();
        let time_limit = known.map_or(STOP_DURATION, |rules| rules.bumper_release.timeout);
        let stop = Some(ReleaseBumper::request(Release {
            left: 0.0,
            right: 0.0,
            duration: STOP_DURATION,
            time_limit,
        }));
        if has_no_model(robot) {
            return stop;
        }
        let robot = robot.get()?;
        let (false, Some(known)) = (is_blind(BUMPER, bumper, rules, robot, now), known) else {
            return stop;
        };
        let BumperReleaseRules { linear_velocity, distance, .. } = known.bumper_release;
        let bumper = bumper
            .get()
            .filter(|bumper| bumper.pressed() && !is_late(BUMPER, &sensors.bumper, robot, now))?;
        let direction = match (bumper.front.get(), bumper.back.get()) {
            (true, true) => 0.0,
            (true, false) => -1.0,
            _ => 1.0,
        };
        let WheelSpeeds { left, right } = robot.wheels_for(direction * linear_velocity, 0.0);
        let duration = math::max(distance / linear_velocity, STOP_DURATION);
        Some(ReleaseBumper::request(Release { left, right, duration, time_limit }))
    }
}

/// Duration of a stop unless it is renewed, seconds.
const STOP_DURATION: f64 = 0.2;
