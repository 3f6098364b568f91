//! Reflex of the authors of RoCS with its published constants: the baseline.

use slate_avoidance::{Rocs, RocsVariant};
use slate_plugin::interfaces::SonarScan;
use slate_plugin::prelude::*;

use crate::actions::{AvoidObstacle, Evasion};

/// Ring of sonars.
#[ports]
pub struct Sonar {
    #[stale(after = "200ms")]
    sonar: Input<SonarScan>,
}

/// Parameters of [`AvoidWallModel`].
#[params]
pub struct AvoidWallParams {
    #[param(default = false, doc = "whether the authors' clamp is corrected")]
    corrected_clamp: Bool,
}

/// Turns away from obstacles in front.
pub struct AvoidWallModel;

impl ReactiveModel for AvoidWallModel {
    const NAME: &'static str = "avoid_wall_model";
    const DOC: &'static str = "The reactive law that the authors of RoCS ran.";
    type Sensors = Sonar;
    type Params = AvoidWallParams;
    type State = ();

    fn run(_: &mut (), sensors: &Sonar, params: &AvoidWallParams, _: &Tick) -> Option<ActionRequest> {
        let variant = if params.corrected_clamp.get() { RocsVariant::RocsFixed } else { RocsVariant::Rocs };
        let wheels = Rocs { variant }.react(sensors.sonar.fresh()?)?;
        Some(AvoidObstacle::request(Evasion {
            angle: 0.0,
            left: wheels.left,
            right: wheels.right,
            duration: 0.05,
        }))
    }
}
