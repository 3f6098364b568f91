//! Referees of a mission, which read ground truth, and which no robot reads.

mod course;
mod motion_record;
mod pursuit;

pub use course::{Metrics, Referee, Stay};
pub use pursuit::{Pursuit, PursuitReferee};
use std::fmt::Write;

use slate_interfaces::{MissionOutcome, MissionState, Verdict};
use slate_module::{Refusal, Setup, Text};

use crate::error::{key, unknown};
use crate::scenario::Scenario;

/// Returns the refusal of a referee whose robot is not in the world.
fn unknown_robot(setup: &Setup<'_>, robot: &str, scenario: &Scenario) -> Refusal {
    let known = scenario.placements.iter().map(|placement| placement.name.as_str());
    Refusal(format!("modules.{}.params.robot: {}", key(setup.name), unknown("robot", robot, known)))
}

/// Returns the verdict on a running mission.
fn running(reason: &str) -> Verdict {
    Verdict { state: MissionState::RUNNING, reason: Text::new(reason), ..Verdict::default() }
}

/// Returns the verdict at the end of a mission with that many caused collisions.
/// Any caused collision is a failure.
fn ended(outcome: MissionOutcome, reason: &str, caused: u64) -> Verdict {
    let outcome = if caused > 0 { MissionOutcome::COLLIDED } else { outcome };
    let state = match outcome {
        MissionOutcome::GOAL_REACHED | MissionOutcome::GAP_KEPT => MissionState::SUCCEEDED,
        _ => MissionState::FAILED,
    };
    let mut verdict = Verdict { state, outcome, reason: Text::new(reason) };
    // Writing to a text in place can't fail.
    let _ = match caused {
        0 => Ok(()),
        1 => write!(verdict.reason, ", with 1 collision caused"),
        caused => write!(verdict.reason, ", with {caused} collisions caused"),
    };
    verdict
}
