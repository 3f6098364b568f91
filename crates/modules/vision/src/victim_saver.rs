use std::fmt::Write;

use serde::{Deserialize, Serialize};
use slate_interfaces::{MissionState, Verdict};
use slate_module::prelude::*;

use crate::feature_tracker::FoundVictims;

/// Ports of [`VictimSaver`].
#[ports]
pub struct VictimSaverIo {
    /// Victims that were found.
    victims: Input<FoundVictims>,
    /// Verdict on the mission, at whose end they are saved.
    verdict: Input<Verdict>,
}

/// Parameters of [`VictimSaver`].
#[params]
pub struct VictimSaverParams {
    #[param(default = "victims.csv", doc = "file of the victims at the end of the mission; empty for none")]
    victim_file: Text<252>,
}

/// Writer of the found victims as CSV for RoboCup Rescue.
/// Columns are id, time, name, x, y, z.
///
/// Paths are relative to the folder that the agent runs in.
pub struct VictimSaver;

/// State of [`VictimSaver`].
#[derive(Default, Serialize, Deserialize)]
pub struct VictimSaverState {
    has_ended: bool,
    has_failed: bool,
}

#[module(stage = PostLoop)]
impl Module for VictimSaver {
    type Io = VictimSaverIo;
    type Params = VictimSaverParams;
    type State = VictimSaverState;

    fn tick(
        state: &mut VictimSaverState,
        io: &VictimSaverIo,
        params: &VictimSaverParams,
        now: &Tick,
    ) -> Outcome {
        let is_ended = io.verdict.get().is_some_and(|verdict| verdict.state != MissionState::RUNNING);
        let file = params.victim_file.as_str();
        if is_ended && !std::mem::replace(&mut state.has_ended, is_ended) && !file.is_empty() {
            let written = std::fs::write(file, table(io.victims.get()));
            match &written {
                Ok(()) => now.info(format_args!("victims saved to {file}")),
                Err(error) => now.error(format_args!("victims not saved to {file}: {error}")),
            }
            state.has_failed = written.is_err();
        }
        if state.has_failed { Outcome::Degraded } else { Outcome::Ok }
    }
}

/// A line for each victim; its time is that since the start.
fn table(victims: Option<&FoundVictims>) -> String {
    let mut text = String::from("id,time,name,x,y,z\n");
    for victim in victims.iter().flat_map(|victims| victims.list.iter()) {
        let seconds = victim.time / 1_000_000_000;
        let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
        let (id, [x, y, z]) = (victim.id, [victim.x, victim.y, victim.z]);
        // Writing into a string can't fail.
        let _ = writeln!(text, "{id},{hours:02}:{minutes:02}:{seconds:02},victim {id},{x:.2},{y:.2},{z:.2}");
    }
    text
}
