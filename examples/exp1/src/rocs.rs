//! The reactive law that the authors of RoCS ran, from its published constants: the baseline.
//!
//! Each of the front eight sonars that hears something slows the wheel on the other side or reverses it. As the
//! authors ran it, the clamp of the range is inverted, so that everything heard counts as if it were quite near; the
//! parameter `fixed` puts that right.

use slate::interfaces::SonarScan;
use slate::mapek::prelude::*;
use slate::prelude::*;

use crate::actions::{AvoidObstacle, Evasion};

/// What is not heard within this does not count, metres.
const FARTHEST: f64 = 0.3;
/// What is nearer counts no more than this, metres.
const NEAREST: f64 = 0.1;
/// The wheels without anything near, radians per second.
const BASE: f64 = 1.5;
/// A smaller change of speed is no reason for a reflex, radians per second.
const LEAST_CHANGE: f64 = 0.1;
/// What each of the front sonars does to the left wheel, from left to right; the right wheel mirrors it.
const WEIGHTS: [f64; 8] = [-0.2, -0.4, -0.6, -0.8, -1.0, -1.2, -1.4, -1.6];

/// The ring of sonars.
#[ports]
pub struct Sonar {
    #[stale(after = "200ms")]
    sonar: Input<SonarScan>,
}

/// Which law.
#[params]
pub struct AvoidWallParams {
    #[param(default = false, doc = "with the clamp put right")]
    fixed: Bool,
}

/// Turns away from walls.
pub struct AvoidWallModel;

impl ReactiveModel for AvoidWallModel {
    const NAME: &'static str = "avoid_wall_model";
    const DOC: &'static str = "The reactive law that the authors of RoCS ran.";
    type Sensors = Sonar;
    type Params = AvoidWallParams;
    type State = ();

    fn run(_: &mut (), sensors: &Sonar, params: &AvoidWallParams, _: &Tick) -> Option<ActionRequest> {
        let scan = sensors.sonar.fresh()?;
        let (mut left, mut right) = (BASE, BASE);
        for (i, echo) in scan.echoes.iter().take(8).enumerate() {
            if !echo.heard.get() || echo.range >= FARTHEST {
                continue;
            }
            let range = if params.fixed.get() {
                math::max(echo.range, NEAREST)
            } else {
                math::min(echo.range, NEAREST)
            };
            let nearness = 1.0 - (range - NEAREST) / (FARTHEST - NEAREST);
            left += WEIGHTS[i] * nearness;
            right += WEIGHTS[7 - i] * nearness;
        }
        let changed = (left - BASE).abs() > LEAST_CHANGE || (right - BASE).abs() > LEAST_CHANGE;
        changed.then(|| AvoidObstacle::request(Evasion { angle: 0.0, left, right, duration: 0.05 }))
    }
}
