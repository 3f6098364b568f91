//! Function `motion` of a vehicle with a failed thruster: restart the thrusters.

use serde::{Deserialize, Serialize};
use slate_plugin::prelude::*;

use super::is_activated;
use crate::interfaces::{FunctionStatus, ThrusterRestart};

/// Ports of the recovery.
#[ports]
pub struct RecoverIo {
    /// Thrusters to restart.
    repairs: Outbox<ThrusterRestart>,
    /// Sign of life.
    active: Output<FunctionStatus>,
}

/// Parameters of the recovery.
#[params]
pub struct RecoverParams {
    #[param(default = 10.0, range = 0.0..=3600.0, unit = "s", doc = "time until the first restart")]
    preparation_time: f64,
    #[param(default = 0.25, range = 0.0..=60.0, unit = "s", doc = "time between two restarts")]
    restart_period: f64,
}

/// Progress of the recovery.
#[derive(Default, Serialize, Deserialize)]
pub struct RecoverState {
    /// Time of the activation, seconds.
    since: f64,
    /// Number of restarted thrusters.
    restarted: u32,
}

/// Number of thrusters.
const THRUSTERS: u32 = 6;

/// Restarts all thrusters, one after the other.
pub struct RecoverThrusters;

#[module(stage = Skill)]
impl Module for RecoverThrusters {
    type Io = RecoverIo;
    type Params = RecoverParams;
    type State = RecoverState;

    fn tick(state: &mut RecoverState, io: &RecoverIo, params: &RecoverParams, now: &Tick) -> Outcome {
        if is_activated(now) {
            *state = RecoverState { since: now.seconds(), restarted: 0 };
        }
        io.active.set(FunctionStatus { altitude: 0.0 });
        let due = params.preparation_time + f64::from(state.restarted) * params.restart_period;
        if state.restarted < THRUSTERS && now.seconds() - state.since >= due - 1e-6 {
            state.restarted += 1;
            io.repairs.send(ThrusterRestart { thruster: state.restarted });
        }
        Outcome::Ok
    }
}
