//! Execution of plans, step by step.

mod state;
mod step;

use std::sync::Arc;

use serde::{Deserialize, Serialize};
pub use state::{CarryError, ExecutorState, NetState, SavedAction, SavedTokens};

use crate::guard::NetGuard;
use crate::label::ActionEvent;
use crate::net::PetriNet;
use crate::plan::{Performer, PetriPlan, PlanAction};

/// Maximum number of tokens of a place while a plan runs.
pub const MOST_TOKENS: u32 = 1_000_000;

/// Progress of an action or a plan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ActionProgress {
    /// Not started.
    #[default]
    Idle,
    /// Runs.
    Running,
    /// Goal reached.
    Succeeded,
    /// Failed.
    Failed,
    /// Preempted from above the plan, for example by a reflex.
    Preempted,
}

/// Host of a plan: performs its actions and evaluates its conditions.
pub trait PlanHost {
    /// Returns the value of a condition.
    /// `None` while it is unknown, which satisfies neither it nor its negation.
    ///
    /// A step asks once at most, so that all guards of a step see one value.
    fn condition(&mut self, index: usize, name: &str) -> Option<bool>;

    /// Returns the progress of an active action.
    /// A step calls it once for each.
    fn progress(&mut self, index: usize, action: &PlanAction) -> ActionProgress;

    /// Returns whether a transition fires that has its tokens.
    /// `holds` is the value of its guard; by default it decides.
    ///
    /// A host of a robot in a team overrides it.
    fn permits(&mut self, _transition: PlanTransition, holds: bool) -> bool {
        holds
    }

    /// Starts, continues, or ends an action.
    fn control(&mut self, index: usize, action: &PlanAction, event: ActionEvent);
}

/// Phase of an action: start, step or stop by the plan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ActionPhase {
    /// Not performed by the plan at present.
    #[default]
    Inactive,
    /// Started, and not ended.
    Active,
    /// Suspended by an interruption of its plan; `resume` continues it.
    Suspended,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct ActionState {
    phase: ActionPhase,
    progress: ActionProgress,
}

/// Order in which enabled transitions of a step fire, which decides conflicts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ConflictOrder {
    /// Order of the file.
    #[default]
    File,
    /// Random order, from a seed.
    Seed(u64),
}

/// Transition of a plan or sub-plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PlanTransition {
    /// Number of the run of a net, 0 for the plan itself.
    /// See [`PetriNetExecutor::path`].
    pub instance: usize,
    /// Index among the transitions of its net.
    pub transition: usize,
}

/// Step that can't be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "plan `{plan}`: transition `{transition}` would put more than {MOST_TOKENS} tokens into place `{place}`; \
     check the plan for unbounded places"
)]
pub struct StepError {
    /// Path of the plan.
    pub plan: String,
    /// Transition.
    pub transition: String,
    /// Place.
    pub place: String,
}

/// Reason for which a transition can't be forced.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ForceError {
    /// The plan has reached its goal, or has failed.
    #[error("the plan has ended; restart it")]
    Ended,
    /// Sub-plan that does not run.
    #[error("the sub-plan `{0}` does not run; force what starts it")]
    Inactive(String),
    /// A place lacks tokens.
    #[error("place `{place}` has {tokens} of {needed} tokens; force what puts one there")]
    Tokens {
        /// Place.
        place: String,
        /// Present tokens.
        tokens: u32,
        /// Required tokens.
        needed: u32,
    },
    /// A place would overflow.
    #[error(transparent)]
    Step(#[from] StepError),
}

/// Executor of a [`PetriPlan`]: PNP's step, with corrections.
/// The crate's page lists the defects that they mend.
///
/// A step first asks how far the active actions have come, and steps active sub-plans; then it collects the enabled
/// transitions whose guard holds, and fires each that is still enabled at its turn. It allocates nothing.
#[derive(Clone, Debug)]
pub struct PetriNetExecutor {
    plan: Arc<PetriPlan>,
    order: ConflictOrder,
    random: u64,
    /// Tokens of the places of all instances.
    marking: Vec<u32>,
    /// Actions of all instances.
    actions: Vec<ActionState>,
    /// Progress of each instance.
    progress: Vec<ActionProgress>,
    /// Answers of this step; `None` for conditions not queried yet.
    answers: Vec<Option<Option<bool>>>,
    /// Candidates of the instances that are stepped.
    candidates: Vec<PlanTransition>,
    fired: Vec<PlanTransition>,
    conflicts: Vec<PlanTransition>,
    steps: u64,
}

impl PetriNetExecutor {
    /// Returns an executor at the start of the plan.
    pub fn new(plan: Arc<PetriPlan>, order: ConflictOrder) -> Self {
        let random = match order {
            ConflictOrder::File => 0,
            ConflictOrder::Seed(seed) => seed,
        };
        // An instance fires a transition once in a step.
        let transitions = plan.instances.iter().map(|own| plan.nets[own.net].transitions.len()).sum();
        let mut executor = Self {
            order,
            random,
            marking: vec![0; plan.places],
            actions: vec![ActionState::default(); plan.states],
            progress: vec![ActionProgress::Idle; plan.instances.len()],
            answers: vec![None; plan.conditions.len()],
            candidates: Vec::with_capacity(transitions),
            fired: Vec::with_capacity(transitions),
            conflicts: Vec::with_capacity(transitions),
            steps: 0,
            plan,
        };
        executor.reset(0);
        executor
    }

    /// Returns the plan.
    pub fn plan(&self) -> &Arc<PetriPlan> {
        &self.plan
    }

    /// Returns how far the plan has come.
    pub fn progress(&self) -> ActionProgress {
        self.progress[0]
    }

    /// Returns the number of steps.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Returns the transitions that the last step fired, in order.
    pub fn fired(&self) -> &[PlanTransition] {
        &self.fired
    }

    /// Returns the transitions of the last step that lost a conflict.
    /// Another one disabled them before their turn.
    pub fn conflicts(&self) -> &[PlanTransition] {
        &self.conflicts
    }

    /// Returns the tokens of the places of a run of a net, 0 for the plan itself.
    pub fn marking(&self, instance: usize) -> &[u32] {
        let own = &self.plan.instances[instance];
        &self.marking[own.places..own.places + self.plan.nets[own.net].places.len()]
    }

    /// Returns the number of runs of nets: the plan itself, and each of its sub-plans.
    pub fn instances(&self) -> usize {
        self.plan.instances.len()
    }

    /// Returns the net of a run of a net.
    pub fn net(&self, instance: usize) -> &PetriNet {
        &self.plan.nets[self.plan.instances[instance].net]
    }

    /// Returns true if a run of a net continues.
    /// It and all above it are active, and it has not ended.
    pub fn is_running(&self, instance: usize) -> bool {
        self.runs()[instance]
    }

    /// Returns for each run of a net whether it continues.
    pub fn runs(&self) -> Vec<bool> {
        let active = self.reached_by(|phase| phase == ActionPhase::Active);
        let is_running = |progress: &ActionProgress| *progress == ActionProgress::Running;
        active.into_iter().zip(&self.progress).map(|(active, own)| active && is_running(own)).collect()
    }

    /// Returns whether the plan performs an action of a net.
    pub fn is_active(&self, instance: usize, action: usize) -> bool {
        self.actions[self.plan.instances[instance].states + action].phase == ActionPhase::Active
    }

    /// Returns the number of a net's action among [`PetriPlan::actions`].
    /// `None` for a sub-plan.
    pub fn host_action(&self, instance: usize, action: usize) -> Option<usize> {
        match self.plan.instances[instance].performers[action] {
            Performer::Host(index) => Some(index),
            Performer::Instance(_) => None,
        }
    }

    /// Returns the present value of a guard, or of an atom of it.
    /// `None` while it is unknown.
    ///
    /// `condition` answers a condition by its name.
    pub fn holds(
        &self,
        instance: usize,
        guard: &NetGuard,
        condition: &mut impl FnMut(&str) -> Option<bool>,
    ) -> Option<bool> {
        let own = &self.plan.instances[instance];
        guard.evaluate(&mut |atom| match atom {
            NetGuard::Condition(index) => condition(&self.plan.conditions[own.conditions[*index]]),
            NetGuard::Action(action, query) => Some(self.answers_query(own.states + action, *query)),
            NetGuard::And(_) | NetGuard::Or(_) | NetGuard::Not(_) => None,
        })
    }

    /// Returns the names that lead to a run of a net, such as `patrol/inspect_3`.
    pub fn path(&self, instance: usize) -> &str {
        &self.plan.instances[instance].path
    }

    /// Returns the label of a transition, with the plan's path.
    pub fn title(&self, transition: PlanTransition) -> String {
        let own = &self.plan.instances[transition.instance];
        format!("{}: {}", own.path, self.plan.nets[own.net].transitions[transition.transition].title())
    }

    /// Ends running actions, and restarts the plan.
    pub fn restart(&mut self, host: &mut impl PlanHost) {
        self.stop(0, ActionEvent::End, host);
        self.reset(0);
    }

    /// Resets a run of a net to its start; no action of it may be active.
    fn reset(&mut self, instance: usize) {
        let own = &self.plan.instances[instance];
        let net = &self.plan.nets[own.net];
        for (tokens, place) in self.marking[own.places..].iter_mut().zip(&net.places) {
            *tokens = place.initial;
        }
        self.actions[own.states..own.states + net.actions.len()].fill(ActionState::default());
        self.progress[instance] = self.reached(instance);
    }

    /// Returns how far a run of a net has come by its marking.
    fn reached(&self, instance: usize) -> ActionProgress {
        let own = &self.plan.instances[instance];
        let net = &self.plan.nets[own.net];
        let marking = self.marking(instance);
        if net.is_goal(marking) {
            ActionProgress::Succeeded
        } else if net.is_failure(marking) {
            ActionProgress::Failed
        } else {
            ActionProgress::Running
        }
    }

    /// Ends or interrupts all active actions of a run of a net, innermost last.
    fn stop(&mut self, instance: usize, event: ActionEvent, host: &mut impl PlanHost) {
        let plan = Arc::clone(&self.plan);
        let own = &plan.instances[instance];
        for (action, performer) in own.performers.iter().enumerate() {
            let state = own.states + action;
            let was = self.actions[state].phase;
            let is_ended = event != ActionEvent::Interrupt;
            if was == ActionPhase::Inactive || was == ActionPhase::Suspended && !is_ended {
                continue;
            }
            self.actions[state].phase = if is_ended { ActionPhase::Inactive } else { ActionPhase::Suspended };
            match *performer {
                Performer::Host(index) if was == ActionPhase::Active => {
                    host.control(index, &plan.actions[index], event);
                }
                Performer::Host(_) => {}
                Performer::Instance(inner) => self.stop(inner, event, host),
            }
        }
    }

    fn resume_inside(&mut self, instance: usize, host: &mut impl PlanHost) {
        let plan = Arc::clone(&self.plan);
        let own = &plan.instances[instance];
        for (action, performer) in own.performers.iter().enumerate() {
            let state = &mut self.actions[own.states + action];
            if state.phase != ActionPhase::Suspended {
                continue;
            }
            *state = ActionState { phase: ActionPhase::Active, progress: ActionProgress::Running };
            match *performer {
                Performer::Host(index) => {
                    host.control(index, &plan.actions[index], ActionEvent::Resume);
                }
                Performer::Instance(inner) => self.resume_inside(inner, host),
            }
        }
    }
}
