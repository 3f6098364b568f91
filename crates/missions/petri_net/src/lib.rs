//! Petri Net Plans (PNP): missions of robots as Petri nets.
//!
//! [`read_pnml`] reads a net as the editors of PNP write it, [`PetriPlan`] combines it with its sub-plans, and
//! [`PetriNetExecutor`] executes it: a [`PlanHost`] performs the actions and knows the conditions. [`check_net`] finds
//! defects of a net before it runs, with the firing sequence that leads to them, and [`generate_net`] makes the net of
//! a linear plan with execution rules. None of them needs an agent.
//!
//! The labels of places and transitions, and the step, are those of PNP 1.4.7 (Ziparo et al., *Petri Net Plans*,
//! Autonomous Agents and Multi-Agent Systems 23, 2011). Three defects of PNP are mended:
//!
//! - Conflicting transitions fire in the order of the file or in a seeded one, not in that of memory addresses, and
//!   conflicts are reported ([`ConflictOrder`], [`PetriNetExecutor::conflicts`]).
//! - `interrupt` of a sub-plan interrupts its actions, and `resume` continues them where they were; PNP ends them.
//! - A token in an `.exec` place means that the action runs: one that arrives without `start` starts it (PNP steps what
//!   it has not started), and when the last leaves without `end`, `fail` or `interrupt`, the action is interrupted (PNP
//!   keeps it active).
//!
//! Where PNP's definition is open, Slate is strict:
//!
//! - The first transition that leads to a goal or a failure is the last one, also within a step; what still runs is
//!   ended.
//! - An unknown condition satisfies neither a guard nor its negation.
//! - All guards of a step, those of sub-plans included, see one value of a condition.
//! - A guard that names an unknown action is refused on loading, as are sub-plans that contain themselves.
//! - An arc without its place, a second net, two nodes of one id, and a weight of zero are refused with their line.
//!
//! ```
//! use slate_petri_net::*;
//!
//! /// A robot whose actions succeed at once.
//! struct Robot(Vec<String>);
//!
//! impl PlanHost for Robot {
//!     fn condition(&mut self, _: usize, name: &str) -> Option<bool> {
//!         Some(name == "person")
//!     }
//!     fn progress(&mut self, _: usize, _: &PlanAction) -> ActionProgress {
//!         ActionProgress::Succeeded
//!     }
//!     fn control(&mut self, _: usize, action: &PlanAction, event: ActionEvent) {
//!         self.0.push(format!("{} {}", event.word(), action.text()));
//!     }
//! }
//!
//! let mut net = NetBuilder::new("greet");
//! let start = net.place("start", 1);
//! let looking = net.place("look.exec", 0);
//! let waving = net.place("wave_2.exec", 0);
//! let goal = net.place("goal", 0);
//! net.transition("*.start", &[(start, 1)], &[(looking, 1)]);
//! net.transition("look.end wave_2.start [person]", &[(looking, 1)], &[(waving, 1)]);
//! net.transition("look.end [not person]", &[(looking, 1)], &[(goal, 1)]);
//! net.transition("wave_2.end", &[(waving, 1)], &[(goal, 1)]);
//! let plan = PetriPlan::new(net.finish()?, |_| Ok(None))?;
//!
//! let mut robot = Robot(Vec::new());
//! let mut executor = PetriNetExecutor::new(plan.into(), ConflictOrder::File);
//! while executor.step(&mut robot)? == ActionProgress::Running {}
//! assert_eq!(robot.0, ["start look", "end look", "start wave_2", "end wave_2"]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod analysis;
mod builder;
mod error;
mod executor;
mod generator;
mod guard;
mod joint;
mod label;
mod net;
mod plan;
mod pnml;
mod synchronizer;

pub use analysis::{
    CheckLimits, FindingKind, FiringPath, NetFinding, NetReport, StateSpace, check_joint, check_net,
    state_space,
};
pub use builder::NetBuilder;
pub use error::NetError;
pub use executor::{
    ActionPhase, ActionProgress, CarryError, ConflictOrder, ExecutorState, ForceError, MOST_TOKENS, NetState,
    PetriNetExecutor, PlanHost, PlanTransition, SavedAction, SavedTokens, StepError,
};
pub use generator::{
    ExecutionRule, LinearAction, PlanRecovery, generate_net, parse_linear_plan, parse_rules,
};
pub use guard::{ActionQuery, NetGuard};
pub use joint::{HardSynchronization, JointNet, ReceivedTokens, RobotNet};
pub use label::{ActionEvent, action_arguments, action_name};
pub use net::{NetPlace, NetTransition, PetriNet};
pub use plan::{PetriPlan, PlanAction};
pub use pnml::{parse_pnml, read_pnml, write_pnml};
pub use synchronizer::{
    RobotStatement, SavedPartner, SavedReceived, SavedSynchronization, SynchronizationEntry,
    SynchronizationError, Synchronizer, SynchronizerState,
};

#[cfg(doctest)]
#[doc = include_str!("../../../../book/src/41-missions.md")]
mod book {}
