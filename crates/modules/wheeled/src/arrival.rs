//! Whether the robot has arrived, by what it knows itself: the judge of a mission where nobody sees the truth.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{MissionState, Point2, Position, Verdict};
use slate_plugin::prelude::*;

/// Where it is, and where it shall go.
#[ports]
pub struct ArrivalIo {
    #[stale(after = "1s")]
    position: Input<Position>,
    goal: Input<Point2>,
    /// How the mission stands.
    verdict: Output<Verdict>,
}

/// When it has arrived.
#[params]
pub struct ArrivalParams {
    #[param(default = 0.1, range = 0.0..=10.0, unit = "m", doc = "the goal is reached within this distance")]
    tolerance: f64,
    #[param(default = 120.0, range = 0.0..=1e9, unit = "s", doc = "the time that the mission may take, since the robot first knew where it is")]
    time_limit: f64,
}

/// Since when it knows where it is, and whether it is decided.
#[derive(Default, Serialize, Deserialize)]
pub struct ArrivalState {
    begun: Option<f64>,
    decided: bool,
}

/// Judges whether the robot believes to be at its goal in time.
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
        let verdict = |state, reason: &str| Verdict { state, reserved: [0; 3], reason: Text::new(reason) };
        let (Some(position), Some(goal)) = (io.position.fresh(), io.goal.fresh()) else {
            // A robot that never knew where it is has not begun.
            let late = state.begun.is_some_and(|begun| now.seconds() - begun >= params.time_limit);
            if late {
                state.decided = true;
                io.verdict.set(verdict(
                    MissionState::FAILED,
                    "time is up, and the robot does not know where it is",
                ));
            }
            return Outcome::Degraded;
        };
        let begun = *state.begun.get_or_insert(now.seconds());
        let verdict = if math::hypot(goal.x - position.x, goal.y - position.y) <= params.tolerance {
            verdict(MissionState::SUCCEEDED, "goal reached, as far as the robot knows")
        } else if now.seconds() - begun >= params.time_limit {
            verdict(MissionState::FAILED, "time is up")
        } else {
            verdict(MissionState::RUNNING, "on the way")
        };
        state.decided = verdict.state != MissionState::RUNNING;
        io.verdict.set(verdict);
        Outcome::Ok
    }
}
