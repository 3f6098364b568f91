//! The reactive behaviour.
use slate::interfaces::SonarScan;
use slate::mapek::prelude::*;
use slate::prelude::*;

use crate::actions::{AvoidObstacle, Evasion};

/// The ring of sonars.
#[ports]
pub struct Sonar {
    #[stale(after = "200ms")]
    sonar: Input<SonarScan>,
}

/// Keeps off what is near.
pub struct AvoidObstacleModel;

impl ReactiveModel for AvoidObstacleModel {
    const NAME: &'static str = "avoid_obstacle_model";
    type Sensors = Sonar;
    type Params = ();
    type State = ();

    fn run(_: &mut (), sensors: &Sonar, _: &(), _: &Tick) -> Option<ActionRequest> {
        let scan = sensors.sonar.fresh()?;
        let near = scan.echoes.iter().take(8).any(|echo| echo.heard.get() && echo.range < 0.2);
        near.then(|| AvoidObstacle::request(Evasion { angle: 0.0, left: -1.0, right: 1.0, duration: 0.05 }))
    }
}
