//! Main loop of two stages for slow actuation.
//! `Sense` runs in each cycle, `Act` in one of several.
//!
//! Modules stay in the stages that they name: `Sense` runs those of `PreLoop` to `WorldState`, and `Act` those of `Think`
//! to `PostLoop`. The loop is taken while the module `sense_act` is there, which may come and go while the agent runs
//! (`slate plugin load slate-sense-act`, `slate plugin unload slate-sense-act`):
//!
//! ```toml
//! [plugins.slate-sense-act]
//! file = "target/release/libslate_sense_act.so"
//! load = false
//! [modules.sense_act]
//! params.every = 4
//! ```

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use serde::{Deserialize, Serialize};
use slate_module::Stage;
use slate_module::aspect::{Aspect, LoopPlace, LoopStage, MainLoop, Policy};
use slate_module::prelude::*;

/// Ports of [`SenseAct`].
#[ports]
pub struct SenseActIo {
    main_loop: Aspect<MainLoop>,
}

/// Parameters of [`SenseAct`].
#[params]
pub struct SenseActParams {
    #[param(default = 1, range = 1..=1_000_000, doc = "number of cycles per action")]
    every: u64,
}

/// State of [`SenseAct`].
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct SenseActState {
    /// Cycles per action of the policy; 0 before there is one.
    #[serde(skip)]
    every: Arc<AtomicU64>,
}

/// Module of the main loop with the stages `Sense` and `Act`.
pub struct SenseAct;

#[module(stage = PreLoop)]
impl Module for SenseAct {
    type Io = SenseActIo;
    type Params = SenseActParams;
    type State = SenseActState;

    fn tick(state: &mut SenseActState, io: &SenseActIo, params: &SenseActParams, now: &Tick) -> Outcome {
        // A direct write to the blackboard may be 0.
        let every = params.every.max(1);
        // A state that was restored has no policy, though one of before may still be there.
        let is_new = state.every.swap(every, Ordering::Relaxed) == 0;
        if !is_new && io.main_loop.is_held() {
            return Outcome::Ok;
        }
        let (sense, act) = Stage::ALL.split_at(5);
        let stages = [
            LoopStage { name: "Sense", members: sense, timeout: None },
            LoopStage { name: "Act", members: act, timeout: None },
        ];
        match io.main_loop.take(&stages, Alternation { every: Arc::clone(&state.every) }) {
            Ok(()) => Outcome::Ok,
            Err(refusal) => {
                now.error(format_args!("{refusal}"));
                Outcome::Failed
            }
        }
    }
}

/// Senses in every cycle, and acts in one of some.
struct Alternation {
    every: Arc<AtomicU64>,
}

impl Policy for Alternation {
    fn next(&mut self, place: &LoopPlace) -> Option<usize> {
        let sense = place.find("Sense");
        match place.after() {
            None => sense,
            after if after == sense && place.cycle.is_multiple_of(self.every.load(Ordering::Relaxed)) => {
                place.find("Act")
            }
            _ => None,
        }
    }
}

slate_module::plugin!(SenseAct);
