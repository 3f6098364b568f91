//! Actions of the managing loop.
//! They change the settings of a function, and confirm the effect.

use serde::{Deserialize, Serialize};
use slate_plugin::module::Level;
use slate_plugin::module::aspect::{Aspect, RequestAnswer, Settings};
use slate_plugin::prelude::*;

use super::health::ActiveFunctions;
use crate::interfaces::{Function, FunctionDesigns};

/// Settings of the agent, knowledge of the designs, and sensor of the effect.
#[ports]
pub struct ManagerBody {
    settings: Aspect<Settings>,
    designs: Required<FunctionDesigns>,
    functions: Input<ActiveFunctions>,
}

/// Design, and the decision that it was chosen by.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub struct Ground {
    /// Place of the design among all, from 0.
    pub place: f64,
    /// Number of the decision, from 1.
    pub decision: f64,
}
arguments!(Ground { place, decision });

/// Grounds a function in a design: changes its settings, and waits for the effect.
#[derive(Serialize, Deserialize)]
pub struct GroundDesign {
    ground: Ground,
    /// Request to the host, and its time, nanoseconds.
    request: Option<(u64, u64)>,
}

/// Timeout of the effect, nanoseconds.
const EFFECT_TIMEOUT: u64 = 1_000_000_000;

impl ActionKind for GroundDesign {
    const KIND: &'static str = "GroundDesign";
    type Arguments = Ground;

    fn start(ground: Ground) -> Self {
        Self { ground, request: None }
    }
}

impl Action<ManagerBody> for GroundDesign {
    fn act(&mut self, acting: &Acting<'_, ManagerBody>) -> Step {
        let Acting { body, now, .. } = acting;
        // The cast clamps places out of range.
        let place = self.ground.place as usize;
        let log = |level, text: &str| {
            let fields = [
                ("decision", (self.ground.decision as u64).into()),
                ("design", body.designs.name(place).into()),
            ];
            now.log_with(level, format_args!("{text}"), &fields);
        };
        let Some((request, since)) = self.request else {
            log(Level::Info, "action: other settings are requested");
            self.request = Some((body.settings.change(body.designs.changes(place)), now.now()));
            return Step::Running;
        };
        match body.settings.answer(request) {
            RequestAnswer::Refused(reason) => {
                now.error(format_args!("action: the settings are refused: {reason}"));
                Step::Failed
            }
            RequestAnswer::Done(_) if is_effective(body, place) => {
                log(Level::Info, "effect: the design is active");
                Step::Done
            }
            _ if now.now().saturating_sub(since) > EFFECT_TIMEOUT => {
                log(Level::Error, "effect: the design is not active");
                Step::Failed
            }
            _ => Step::Running,
        }
    }
}

/// Returns true if the functions have the settings of a design.
fn is_effective(body: &ManagerBody, place: usize) -> bool {
    let (Some(design), Some(active)) = (body.designs.list.get(place), body.functions.get()) else {
        return false;
    };
    let is_on = design.performance > 0.0;
    match design.function {
        Function::SEARCH => active.search_altitude == design.altitude,
        Function::INSPECT => active.inspects.get() == is_on,
        // Healthy thrusters need no function of their own.
        _ => active.recovers.get() == (is_on && !design.all_thrusters.get()),
    }
}

repertoire! {
    /// Actions of the managing loop.
    pub enum ManagerActions for ManagerBody as "suave_execute" { GroundDesign }
}
