//! Plan of the managing loop.

use serde::{Deserialize, Serialize};
use slate_plugin::module::Level;
use slate_plugin::prelude::*;

use super::Groundings;
use super::actions::{Ground, GroundDesign};
use super::outlook::{DueDesign, TaskChange, ThrusterChange};
use crate::interfaces::{Function, FunctionDesigns};

/// Percepts and knowledge of the Plan.
#[ports]
pub struct ManagerNoticed {
    search: Noticed<DueDesign>,
    thrusters: Noticed<ThrusterChange>,
    task: Noticed<TaskChange>,
    designs: Required<FunctionDesigns>,
}

/// State of the Plan.
#[derive(Default, Serialize, Deserialize)]
pub struct ManagerMemory {
    /// Designs that were decided on.
    groundings: Groundings,
    /// Design that the visibility requires.
    search: Option<usize>,
    /// True if a thruster has failed.
    is_failed: bool,
    /// Number of the newest decision.
    decision: u64,
    /// Failed attempts since the newest change.
    failures: u32,
}

/// Number of attempts until another change.
const MAX_ATTEMPTS: u32 = 3;

/// Chooses the best design of each function of the present task.
pub struct ManagerPlan;

impl Plan for ManagerPlan {
    const NAME: &'static str = "suave_planner";
    const DOC: &'static str = "Chooses the designs of the vehicle's functions.";
    type Noticed = ManagerNoticed;
    type Params = ();
    type State = ManagerMemory;

    fn run(
        memory: &mut ManagerMemory,
        noticed: &ManagerNoticed,
        situation: &Situation<'_>,
        _: &(),
        now: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        if let Some(due) = noticed.search.newest() {
            memory.search = Some(due.place as usize);
            memory.failures = 0;
        }
        if let Some(change) = noticed.thrusters.newest() {
            memory.is_failed = change.failed != 0;
            memory.failures = 0;
        }
        if let Some(change) = noticed.task.newest() {
            memory.groundings.task = Some(change.task);
            memory.failures = 0;
            // Actions for the previous task are of no use.
            plan.clear();
            memory.groundings.places = [None; 3];
        }
        if situation.ended().any(|ended| ended.ending == Ending::FAILED) {
            memory.failures += 1;
            if memory.failures == MAX_ATTEMPTS {
                let what =
                    "plan: the designs are given up until something changes: see why they were refused";
                now.log_with(Level::Error, format_args!("{what}"), &[("decision", memory.decision.into())]);
            } else {
                // The present design is unknown: all is decided anew.
                memory.groundings.places = [None; 3];
            }
        }
        if memory.failures >= MAX_ATTEMPTS {
            return;
        }
        let Some(task) = memory.groundings.task else { return };
        let designs = &noticed.designs;
        let (is_failed, due) = (memory.is_failed, memory.search);
        // Functions are turned on before others are turned off.
        let mut order: [(usize, Function); 3] = [0, 1, 2].map(|at| (at, Function::ALL[at]));
        order.sort_by_key(|(_, function)| !function.serves(task));
        for (at, function) in order {
            let best = match function {
                _ if !function.serves(task) => designs.off(function),
                Function::SEARCH => due,
                _ => designs.best(function, |design| !(design.all_thrusters.get() && is_failed)),
            };
            let Some(best) = best else { continue };
            if memory.groundings.places[at] == Some(best) {
                continue;
            }
            memory.decision += 1;
            let (decision, place) = (memory.decision as f64, best as f64);
            if plan.append(GroundDesign::request(Ground { place, decision })).is_none() {
                return;
            }
            memory.groundings.places[at] = Some(best);
            let fields = [
                ("decision", memory.decision.into()),
                ("function", function.name().into()),
                ("design", designs.name(best).into()),
            ];
            now.log_with(Level::Info, format_args!("plan: another design"), &fields);
        }
    }
}
