//! Strategy `metacontrol`: rules of MROS with the exemplar's ontology.
//!
//! | concept | here |
//! |---|---|
//! | objective | each function of the present task; new ones are ungrounded until the next reasoning |
//! | function design | its performance, the visibility that it requires, whether it needs all thrusters |
//! | Analyze | an objective is adapted when it is ungrounded, when a component of its design has failed or recovered, when the measured visibility is below that of its design, and the search always |
//! | Plan | the realisable design with the highest performance whose visibility is not above the measured one |
//! | Execute | the settings of that design, unless it is the present one |
//!
//! Source: kas-lab/suave 1.5.0, `suave_metacontrol/config/suave.owl` and `task_bridge_metacontrol.py`;
//! meta-control/mc_mros_reasoner, `tomasys.py` and `reasoner.py`. Reasoning takes no time here.

use serde::{Deserialize, Serialize};
use slate_plugin::module::aspect::{Aspect, Settings};
use slate_plugin::prelude::*;

use super::Groundings;
use crate::interfaces::{
    Function, FunctionDesign, FunctionDesigns, ThrusterHealth, VehicleMission, WaterVisibility,
};

/// Ports of the manager.
#[ports]
pub struct MetacontrolIo {
    settings: Aspect<Settings>,
    designs: Required<FunctionDesigns>,
    mission: Required<VehicleMission>,
    visibility: Input<WaterVisibility>,
    thrusters: Input<ThrusterHealth>,
}

/// Parameters of the manager.
#[params]
pub struct MetacontrolParams {
    #[param(default = 1.5, range = 0.05..=3600.0, unit = "s", doc = "period of the reasoning")]
    reasoning_period: f64,
}

/// State of the manager.
#[derive(Default, Serialize, Deserialize)]
pub struct MetacontrolState {
    groundings: Groundings,
    /// Time of the last reasoning, seconds.
    reasoned: Option<f64>,
    /// True if a thruster was failed at the last reasoning.
    was_failed: bool,
}

/// Reasons in a fixed period about the designs of the functions.
pub struct Metacontrol;

#[module(stage = Think)]
impl Module for Metacontrol {
    type Io = MetacontrolIo;
    type Params = MetacontrolParams;
    type State = MetacontrolState;

    fn tick(
        state: &mut MetacontrolState,
        io: &MetacontrolIo,
        params: &MetacontrolParams,
        now: &Tick,
    ) -> Outcome {
        let (designs, task) = (&io.designs, io.mission.task);
        // A task that ends is cancelled at once; the next one waits for the reasoning.
        state.groundings.begin(task, designs, &io.settings, now);
        // The phase of the period against the mission is drawn, as both begin on their own.
        let begin = || now.random(|random| random.uniform(-params.reasoning_period, 0.0)) + now.seconds();
        let reasoned = *state.reasoned.get_or_insert_with(begin);
        if now.seconds() - reasoned < params.reasoning_period - 1e-6 {
            return Outcome::Ok;
        }
        state.reasoned = Some(reasoned + params.reasoning_period);
        let is_failed = io.thrusters.get().is_some_and(|thrusters| thrusters.failed != 0);
        let is_recovered = state.was_failed && !is_failed;
        state.was_failed = is_failed;
        let visibility = io.visibility.get().map(|visibility| visibility.distance);
        let is_realisable = |design: &FunctionDesign| !(design.all_thrusters.get() && is_failed);
        let is_clear =
            |design: &FunctionDesign| visibility.is_none_or(|measured| measured >= design.visibility);
        for function in Function::ALL.into_iter().filter(|function| function.serves(task)) {
            let present = state.groundings.of(function).and_then(|place| designs.list.get(place));
            let is_adapted = function == Function::SEARCH
                || is_recovered
                || present.is_none_or(|design| {
                    design.performance <= 0.0 || !is_realisable(design) || !is_clear(design)
                });
            let is_suitable = |design: &FunctionDesign| is_realisable(design) && is_clear(design);
            if is_adapted && let Some(best) = designs.best(function, is_suitable) {
                state.groundings.set(function, best, designs, &io.settings, now);
            }
        }
        Outcome::Ok
    }
}
