//! State of a run by names, for snapshots and for a changed plan.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{ActionPhase, ActionProgress, ActionState, ConflictOrder, PetriNetExecutor};
use crate::net::PetriNet;
use crate::plan::{Performer, PetriPlan};

/// State of a run: tokens and actions by their names.
/// It thus fits into a changed plan.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct ExecutorState {
    /// Number of steps.
    pub steps: u64,
    /// State of the random order.
    pub random: u64,
    /// Plan, then its sub-plans.
    pub nets: Vec<NetState>,
}

/// State of a plan or sub-plan.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct NetState {
    /// Path of actions to it, such as `inspect_3/look`.
    /// Empty for the plan itself.
    pub path: String,
    /// True if it runs or is interrupted.
    pub live: bool,
    /// Progress.
    pub progress: ActionProgress,
    /// Places with tokens.
    pub tokens: Vec<SavedTokens>,
    /// Actions that were started.
    pub actions: Vec<SavedAction>,
}

/// Tokens of a place.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct SavedTokens {
    /// Label of the place, if it is unique.
    pub place: String,
    /// Identifier of the place.
    pub id: String,
    /// Number of tokens.
    pub tokens: u32,
}

/// State of an action.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct SavedAction {
    /// Action with its arguments.
    pub action: String,
    /// Phase of the action.
    pub phase: ActionPhase,
    /// Progress.
    pub progress: ActionProgress,
}

/// State that doesn't fit into a plan.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the state of the run doesn't fit into the plan: {0}; restart the plan, or keep that name")]
pub struct CarryError(String);

impl PetriNetExecutor {
    /// Returns the state.
    pub fn state(&self) -> ExecutorState {
        let live = self.live();
        let nets = (0..self.plan.instances.len()).map(|instance| self.net_state(instance, live[instance]));
        ExecutorState { steps: self.steps, random: self.random, nets: nets.collect() }
    }

    /// Creates an executor from a saved state, also of another plan version.
    ///
    /// Places are found by their label, or by their identifier where several have the label.
    pub fn restore(
        plan: Arc<PetriPlan>,
        order: ConflictOrder,
        state: &ExecutorState,
    ) -> Result<Self, CarryError> {
        let mut executor = Self::new(plan, order);
        if state.nets.is_empty() {
            return Ok(executor);
        }
        let mut restored = vec![false; executor.plan.instances.len()];
        for net in &state.nets {
            let found = (0..restored.len()).find(|instance| executor.relative_path(*instance) == net.path);
            let fits = match found {
                Some(instance) => executor.restore_net(instance, net).map(|()| restored[instance] = true),
                None => Err(CarryError(format!("`{}` runs, and is not a sub-plan any more", net.path))),
            };
            if net.live {
                fits?;
            } else if let (Err(_), Some(instance)) = (fits, found) {
                executor.reset(instance);
            }
        }
        let live = executor.live();
        if let Some(missing) = (0..restored.len()).find(|instance| live[*instance] && !restored[*instance]) {
            let path = executor.relative_path(missing);
            return Err(CarryError(format!("the action `{path}` runs, and is a sub-plan now")));
        }
        executor.steps = state.steps;
        if let ConflictOrder::Seed(_) = order {
            executor.random = state.random;
        }
        Ok(executor)
    }

    /// Replaces the plan while it runs.
    /// The old one continues if the state doesn't fit.
    pub fn reload(&mut self, plan: Arc<PetriPlan>) -> Result<(), CarryError> {
        *self = Self::restore(plan, self.order, &self.state())?;
        Ok(())
    }

    fn relative_path(&self, instance: usize) -> &str {
        let path = &self.plan.instances[instance].path;
        path[self.plan.instances[0].path.len()..].trim_start_matches('/')
    }

    /// Returns for each run of a net whether it is active or suspended.
    fn live(&self) -> Vec<bool> {
        self.reached_by(|phase| phase != ActionPhase::Inactive)
    }

    /// Returns for each run of a net whether all actions above are in a phase.
    /// They are the actions that lead to it.
    pub(super) fn reached_by(&self, is_fit: impl Fn(ActionPhase) -> bool) -> Vec<bool> {
        let mut live = vec![false; self.plan.instances.len()];
        live[0] = true;
        // Those inside have greater numbers.
        for (instance, own) in self.plan.instances.iter().enumerate() {
            for (action, performer) in own.performers.iter().enumerate() {
                if let Performer::Instance(inner) = performer {
                    live[*inner] = live[instance] && is_fit(self.actions[own.states + action].phase);
                }
            }
        }
        live
    }

    fn net_state(&self, instance: usize, live: bool) -> NetState {
        let own = &self.plan.instances[instance];
        let net = &self.plan.nets[own.net];
        let marked = net.places.iter().zip(self.marking(instance)).filter(|(_, tokens)| **tokens > 0);
        let tokens = marked.map(|(place, tokens)| SavedTokens {
            place: if named(net, &place.name).count() == 1 { place.name.clone() } else { String::new() },
            id: place.id.clone(),
            tokens: *tokens,
        });
        let actions = net.actions.iter().zip(&self.actions[own.states..]);
        let started = actions.filter(|(_, state)| **state != ActionState::default());
        NetState {
            path: self.relative_path(instance).into(),
            live,
            progress: self.progress[instance],
            tokens: tokens.collect(),
            actions: started
                .map(|(action, state)| SavedAction {
                    action: action.clone(),
                    phase: state.phase,
                    progress: state.progress,
                })
                .collect(),
        }
    }

    fn restore_net(&mut self, instance: usize, saved: &NetState) -> Result<(), CarryError> {
        let plan = Arc::clone(&self.plan);
        let own = &plan.instances[instance];
        let net = &plan.nets[own.net];
        self.marking[own.places..own.places + net.places.len()].fill(0);
        for SavedTokens { place, id, tokens } in &saved.tokens {
            let found = find_place(net, place, id).ok_or_else(|| {
                let name = if place.is_empty() { id } else { place };
                CarryError(format!(
                    "`{}` has {tokens} tokens in a place `{name}`, which is missing",
                    own.path
                ))
            })?;
            self.marking[own.places + found] = *tokens;
        }
        for SavedAction { action, phase, progress } in &saved.actions {
            match net.actions.iter().position(|other| other == action) {
                Some(index) => {
                    self.actions[own.states + index] = ActionState { phase: *phase, progress: *progress };
                }
                // The end of a missing action matters to no guard.
                None if *phase == ActionPhase::Inactive => {}
                None => {
                    return Err(CarryError(format!("`{}` has no action `{action}`, which runs", own.path)));
                }
            }
        }
        self.progress[instance] = saved.progress;
        Ok(())
    }
}

fn named<'a>(net: &'a PetriNet, name: &'a str) -> impl Iterator<Item = usize> + 'a {
    let places = net.places.iter().enumerate();
    places.filter(move |(_, place)| !name.is_empty() && place.name == name).map(|(index, _)| index)
}

fn find_place(net: &PetriNet, name: &str, id: &str) -> Option<usize> {
    let mut same = named(net, name);
    match (same.next(), same.next()) {
        (Some(only), None) => Some(only),
        (None, _) if !name.is_empty() => None,
        _ => net.places.iter().position(|place| place.id == id),
    }
}
