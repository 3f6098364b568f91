//! Reflex of the authors of RoCS with its published constants: the baseline.

use slate_avoidance::{Rocs, RocsVariant, SONAR};
use slate_plugin::interfaces::{SonarScan, WheelSpeeds};
use slate_plugin::prelude::*;

use crate::actions::{AvoidObstacle, Evasion};
use crate::knowledge::WheeledModel;
use crate::late_sensors::{has_no_model, is_blind};
use crate::monitors::is_valid;
use crate::rules::WheeledRules;

/// Ring of sonars, and knowledge.
#[ports]
pub struct Sonar {
    #[stale(after = "200ms")]
    sonar: Input<SonarScan>,
    /// Rules from Knowledge: the sensors that must not stop.
    rules: Input<WheeledRules>,
    /// Robot model, from Knowledge.
    robot: Input<WheeledModel>,
}

/// Parameters of [`AvoidWallModel`].
#[params]
pub struct AvoidWallParams {
    #[param(default = false, doc = "correct the authors' clamp")]
    corrected_clamp: Bool,
}

/// Duration of a command unless it is renewed, seconds.
const COMMAND_DURATION: f64 = 0.05;

/// Turns away from obstacles in front.
pub struct AvoidWallModel;

impl ReactiveModel for AvoidWallModel {
    const NAME: &'static str = "avoid_wall_model";
    const DOC: &'static str = "Reactive control law as the authors of RoCS ran it.";
    type Sensors = Sonar;
    type Params = AvoidWallParams;
    type State = ();

    fn run(_: &mut (), sensors: &Sonar, params: &AvoidWallParams, now: &Tick) -> Option<ActionRequest> {
        let Sonar { sonar, rules, robot } = sensors;
        let variant = if params.corrected_clamp.get() { RocsVariant::RocsFixed } else { RocsVariant::Rocs };
        // The law skips a NaN, so that a failed sonar looks like free space.
        let is_blind = has_no_model(robot)
            || is_blind(SONAR, sonar, rules, robot.get()?, now)
            || sonar.get().is_some_and(|scan| !is_valid(scan));
        let wheels = if is_blind { WheelSpeeds::ZERO } else { Rocs { variant }.react(sonar.get()?)? };
        let WheelSpeeds { left, right } = wheels;
        Some(AvoidObstacle::request(Evasion { angle: 0.0, left, right, duration: COMMAND_DURATION }))
    }
}
