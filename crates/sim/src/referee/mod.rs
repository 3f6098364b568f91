//! The judges of a mission: they see the truth, and no robot sees them.

mod conduct;
mod course;
mod pursuit;

pub use course::{Metrics, Referee, Stay};
pub use pursuit::{Pursuit, PursuitReferee};
use slate_interfaces::{MissionState, Verdict};
use slate_module::{Refusal, Setup, Text};

use crate::error::{key, unknown};
use crate::scenario::Scenario;

/// The refusal of a referee whose robot is not in the world.
fn unknown_robot(setup: &Setup<'_>, robot: &str, scenario: &Scenario) -> Refusal {
    let known = scenario.placements.iter().map(|placement| placement.name.as_str());
    Refusal(format!("modules.{}.params.robot: {}", key(setup.name), unknown("robot", robot, known)))
}

fn verdict(state: MissionState, reason: &str) -> Verdict {
    Verdict { state, reason: Text::new(reason) }
}
