//! Strategy `none`: no adaptation.

use slate_plugin::module::aspect::{Aspect, Settings};
use slate_plugin::prelude::*;

use super::Groundings;
use crate::interfaces::{Function, FunctionDesigns, VehicleMission};

/// Ports of the manager.
#[ports]
pub struct UnmanagedIo {
    settings: Aspect<Settings>,
    designs: Required<FunctionDesigns>,
    mission: Required<VehicleMission>,
}

/// Parameters of the manager.
#[params]
pub struct UnmanagedParams {
    #[param(default = "spiral_low", doc = "design of the search")]
    search: Text<28>,
    #[param(default = "follow_pipeline", doc = "design of the inspection")]
    inspect: Text<28>,
}

/// Turns the function of the present task on, always in the same design.
pub struct UnmanagedMission;

#[module(stage = Think)]
impl Module for UnmanagedMission {
    type Io = UnmanagedIo;
    type Params = UnmanagedParams;
    type State = Groundings;

    fn tick(state: &mut Groundings, io: &UnmanagedIo, params: &UnmanagedParams, now: &Tick) -> Outcome {
        let (designs, task) = (&io.designs, io.mission.task);
        if !state.begin(task, designs, &io.settings, now) {
            return Outcome::Ok;
        }
        for (function, name) in [(Function::SEARCH, &params.search), (Function::INSPECT, &params.inspect)] {
            if !function.serves(task) {
                continue;
            }
            let Some((place, _)) = designs.of(function).find(|(_, design)| design.name == *name) else {
                now.error(format_args!("unknown design `{}` of {}", name.as_str(), function.name()));
                return Outcome::Failed;
            };
            state.set(function, place, designs, &io.settings, now);
        }
        Outcome::Ok
    }
}
