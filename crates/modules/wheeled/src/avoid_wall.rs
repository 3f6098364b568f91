//! The reactive law that the authors of RoCS ran, from its published constants: the baseline.

use slate_avoidance::{Rocs, RocsVariant};
use slate_plugin::interfaces::SonarScan;
use slate_plugin::mapek::prelude::*;
use slate_plugin::prelude::*;

use crate::actions::{AvoidObstacle, Evasion};

/// The ring of sonars.
#[ports]
pub struct Sonar {
    #[stale(after = "200ms")]
    sonar: Input<SonarScan>,
}

/// Which law.
#[params]
pub struct AvoidWallParams {
    #[param(default = false, doc = "with the authors' clamp put right")]
    fixed: Bool,
}

/// Turns away from what the front sonars hear.
pub struct AvoidWallModel;

impl ReactiveModel for AvoidWallModel {
    const NAME: &'static str = "avoid_wall_model";
    const DOC: &'static str = "The reactive law that the authors of RoCS ran.";
    type Sensors = Sonar;
    type Params = AvoidWallParams;
    type State = ();

    fn run(_: &mut (), sensors: &Sonar, params: &AvoidWallParams, _: &Tick) -> Option<ActionRequest> {
        let variant = if params.fixed.get() { RocsVariant::RocsFixed } else { RocsVariant::Rocs };
        let wheels = Rocs { variant }.react(sensors.sonar.fresh()?)?;
        Some(AvoidObstacle::request(Evasion {
            angle: 0.0,
            left: wheels.left,
            right: wheels.right,
            duration: 0.05,
        }))
    }
}
