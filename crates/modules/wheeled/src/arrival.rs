//! Referee of a mission by the robot's own estimate, without ground truth.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{MissionOutcome, MissionState, Point2, Position, Verdict};
use slate_plugin::prelude::*;

/// Position and goal.
#[ports]
pub struct ArrivalIo {
    #[stale(after = "1s")]
    position: Input<Position>,
    goal: Input<Point2>,
    /// Verdict on the mission.
    verdict: Output<Verdict>,
}

/// Parameters of [`Arrival`].
#[params]
pub struct ArrivalParams {
    #[param(default = 0.1, range = 0.0..=10.0, unit = "m", doc = "distance from the goal at which it counts as reached")]
    goal_tolerance: f64,
    #[param(default = 120.0, range = 0.0..=1e9, unit = "s", doc = "time limit of the mission, from the first position estimate on")]
    time_limit: f64,
}

/// State of [`Arrival`].
#[derive(Default, Serialize, Deserialize)]
pub struct ArrivalState {
    begun: Option<f64>,
    decided: bool,
}

/// Judges whether the robot reaches its goal in time, by its own estimate.
pub struct Arrival;

#[module(stage = PostLoop)]
impl Module for Arrival {
    type Io = ArrivalIo;
    type Params = ArrivalParams;
    type State = ArrivalState;

    fn tick(state: &mut ArrivalState, io: &ArrivalIo, params: &ArrivalParams, now: &Tick) -> Outcome {
        if state.decided {
            return Outcome::Ok;
        }
        let verdict = |state, outcome, reason: &str| Verdict { state, outcome, reason: Text::new(reason) };
        let timed_out = |reason| verdict(MissionState::FAILED, MissionOutcome::TIMED_OUT, reason);
        let (Some(position), Some(goal)) = (io.position.fresh(), io.goal.fresh()) else {
            // The mission begins with the first position estimate.
            let late = state.begun.is_some_and(|begun| now.seconds() - begun >= params.time_limit);
            if late {
                state.decided = true;
                io.verdict.set(timed_out("time limit exceeded without a position estimate"));
            }
            return Outcome::Degraded;
        };
        let begun = *state.begun.get_or_insert(now.seconds());
        let verdict = if math::hypot(goal.x - position.x, goal.y - position.y) <= params.goal_tolerance {
            let reason = "goal reached by the robot's own estimate";
            verdict(MissionState::SUCCEEDED, MissionOutcome::GOAL_REACHED, reason)
        } else if now.seconds() - begun >= params.time_limit {
            timed_out("time limit exceeded")
        } else {
            verdict(MissionState::RUNNING, MissionOutcome::OTHER, "on the way")
        };
        state.decided = verdict.state != MissionState::RUNNING;
        io.verdict.set(verdict);
        Outcome::Ok
    }
}
