//! Transition semantics of programs, and the search for plans.

mod effects;
mod endings;
mod ground_action;
mod remaining;
mod search;
mod transition;

pub(crate) use effects::{EffectKind, SituationStore};
pub(crate) use ground_action::GroundAction;
pub(crate) use remaining::{NIL, PlannedStep, Remaining, RemainingPrograms};
pub(crate) use search::{DepthFirstSearch, SearchProgress};
pub(crate) use transition::{ProgramTransition, TransitionMode, TransitionReader};
