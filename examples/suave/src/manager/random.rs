//! Strategy `random`: another design now and then.

use serde::{Deserialize, Serialize};
use slate_plugin::module::aspect::{Aspect, Settings};
use slate_plugin::prelude::*;

use super::Groundings;
use crate::interfaces::{Function, FunctionDesigns, VehicleMission};

/// Ports of the manager.
#[ports]
pub struct RandomIo {
    settings: Aspect<Settings>,
    designs: Required<FunctionDesigns>,
    mission: Required<VehicleMission>,
}

/// Parameters of the manager.
#[params]
pub struct RandomParams {
    // The published setting of 30 s has another name than the parameter that it is for, so the runs had its default.
    #[param(default = 15.0, range = 0.1..=1e6, unit = "s", doc = "period of the adaptation")]
    period: f64,
}

/// State of the manager.
#[derive(Default, Serialize, Deserialize)]
pub struct RandomState {
    groundings: Groundings,
    /// Number of adaptations.
    adaptations: u64,
}

/// Draws a design of the present task's function in each period.
/// The designs that turn it off are among them.
pub struct RandomManager;

#[module(stage = Think)]
impl Module for RandomManager {
    type Io = RandomIo;
    type Params = RandomParams;
    type State = RandomState;

    fn tick(state: &mut RandomState, io: &RandomIo, params: &RandomParams, now: &Tick) -> Outcome {
        let (designs, task) = (&io.designs, io.mission.task);
        state.groundings.begin(task, designs, &io.settings, now);
        if now.seconds() < (state.adaptations + 1) as f64 * params.period - 1e-6 {
            return Outcome::Ok;
        }
        state.adaptations += 1;
        for function in [Function::SEARCH, Function::INSPECT] {
            let count = designs.of(function).count();
            if !function.serves(task) || count == 0 {
                continue;
            }
            // As a mode of the node's own beside those of the function: the low spiral, and the inspection turned off.
            let drawn = now.random(|random| random.uniform(0.0, (count + 1) as f64)) as usize;
            let own = match function {
                Function::SEARCH => {
                    designs.of(function).find(|(_, design)| design.name.as_str() == "spiral_low")
                }
                _ => designs.of(function).find(|(_, design)| design.performance <= 0.0),
            };
            if let Some((place, _)) = designs.of(function).nth(drawn).or(own) {
                state.groundings.set(function, place, designs, &io.settings, now);
            }
        }
        Outcome::Ok
    }
}
