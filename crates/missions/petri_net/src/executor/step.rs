//! Step of a plan.

use std::sync::Arc;

use super::{
    ActionPhase, ActionProgress, ActionState, ConflictOrder, ForceError, MOST_TOKENS, PetriNetExecutor,
    PlanHost, PlanTransition, StepError,
};
use crate::guard::{ActionQuery, NetGuard};
use crate::label::ActionEvent;
use crate::net::NetTransition;
use crate::plan::{NetRun, Performer, PetriPlan};

impl PetriNetExecutor {
    /// Performs a step, and returns the progress of the plan.
    /// After the goal or a failure it has no effect.
    pub fn step(&mut self, host: &mut impl PlanHost) -> Result<ActionProgress, StepError> {
        self.answers.fill(None);
        self.fired.clear();
        self.conflicts.clear();
        self.steps += 1;
        let plan = Arc::clone(&self.plan);
        self.advance(&plan, 0, host)
    }

    /// Fires a transition that has its tokens, whatever its guard says.
    /// Everything else is as in a step.
    ///
    /// # Errors
    /// The reason why it can't fire; the marking is then unchanged.
    pub fn force(&mut self, forced: PlanTransition, host: &mut impl PlanHost) -> Result<(), ForceError> {
        let PlanTransition { instance, transition } = forced;
        if self.progress[0] != ActionProgress::Running {
            return Err(ForceError::Ended);
        }
        if !self.is_running(instance) {
            return Err(ForceError::Inactive(self.path(instance).into()));
        }
        let plan = Arc::clone(&self.plan);
        let own = &plan.instances[instance];
        let net = &plan.nets[own.net];
        let marking = self.marking(instance);
        let lacks = |(place, weight): &&(usize, u32)| marking[*place] < *weight;
        if let Some((place, needed)) = net.transitions[transition].inputs.iter().find(lacks) {
            let (place, tokens) = (net.places[*place].title().to_owned(), marking[*place]);
            return Err(ForceError::Tokens { place, tokens, needed: *needed });
        }
        self.fired.clear();
        self.conflicts.clear();
        self.candidates.push(forced);
        let outcome = self.fire(&plan, instance, self.candidates.len() - 1, host);
        self.candidates.clear();
        outcome?;
        self.complete(instance, host);
        Ok(())
    }

    /// Sets the progress of a net from its marking.
    /// Ends its actions after a goal or a failure.
    fn complete(&mut self, instance: usize, host: &mut impl PlanHost) {
        self.progress[instance] = self.reached(instance);
        if self.progress[instance] != ActionProgress::Running {
            self.stop(instance, ActionEvent::End, host);
        }
    }

    /// Steps a run of a net and those inside.
    fn advance(
        &mut self,
        plan: &PetriPlan,
        instance: usize,
        host: &mut impl PlanHost,
    ) -> Result<ActionProgress, StepError> {
        if self.progress[instance] != ActionProgress::Running {
            return Ok(self.progress[instance]);
        }
        self.execute(plan, instance, host)?;
        let first = self.candidates.len();
        self.collect(plan, instance, host);
        let outcome = self.fire(plan, instance, first, host);
        self.candidates.truncate(first);
        outcome?;
        self.complete(instance, host);
        Ok(self.progress[instance])
    }

    /// Starts actions reached without `start`, and reads their progress.
    fn execute(
        &mut self,
        plan: &PetriPlan,
        instance: usize,
        host: &mut impl PlanHost,
    ) -> Result<(), StepError> {
        let own = &plan.instances[instance];
        for (at, place) in plan.nets[own.net].places.iter().enumerate() {
            if let Some(action) = place.action
                && self.marking[own.places + at] > 0
                && self.actions[own.states + action].phase != ActionPhase::Active
            {
                self.control(plan, own, action, ActionEvent::Start, host);
            }
        }
        for (action, performer) in own.performers.iter().enumerate() {
            if self.actions[own.states + action].phase != ActionPhase::Active {
                continue;
            }
            let progress = match *performer {
                Performer::Host(index) => host.progress(index, &plan.actions[index]),
                Performer::Instance(inner) => self.advance(plan, inner, host)?,
            };
            self.actions[own.states + action].progress = progress;
        }
        Ok(())
    }

    /// Collects the enabled transitions whose guard holds, in firing order.
    fn collect(&mut self, plan: &PetriPlan, instance: usize, host: &mut impl PlanHost) {
        let own = &plan.instances[instance];
        let net = &plan.nets[own.net];
        let first = self.candidates.len();
        for (index, transition) in net.transitions.iter().enumerate() {
            if !transition.is_enabled(&self.marking[own.places..]) {
                continue;
            }
            let holds = match &transition.guard {
                None => true,
                Some(guard) => {
                    let mut value = |atom: &NetGuard| self.value(plan, own, atom, host);
                    guard.evaluate(&mut value) == Some(true)
                }
            };
            let candidate = PlanTransition { instance, transition: index };
            if host.permits(candidate, holds) {
                self.candidates.push(candidate);
            }
        }
        if let ConflictOrder::Seed(_) = self.order {
            for last in (first + 1..self.candidates.len()).rev() {
                let other = first + (self.random() % (last - first + 1) as u64) as usize;
                self.candidates.swap(last, other);
            }
        }
    }

    fn value(
        &mut self,
        plan: &PetriPlan,
        own: &NetRun,
        atom: &NetGuard,
        host: &mut impl PlanHost,
    ) -> Option<bool> {
        match atom {
            NetGuard::Condition(index) => {
                let index = own.conditions[*index];
                *self.answers[index].get_or_insert_with(|| host.condition(index, &plan.conditions[index]))
            }
            NetGuard::Action(action, query) => Some(self.answers_query(own.states + action, *query)),
            NetGuard::And(_) | NetGuard::Or(_) | NetGuard::Not(_) => None,
        }
    }

    /// Returns true if an action has the state that a guard queries.
    pub(super) fn answers_query(&self, state: usize, query: ActionQuery) -> bool {
        let ActionState { phase, progress } = self.actions[state];
        match query {
            ActionQuery::Finished => progress == ActionProgress::Succeeded,
            ActionQuery::Failed => progress == ActionProgress::Failed,
            ActionQuery::Preempted => progress == ActionProgress::Preempted,
            ActionQuery::Running => phase == ActionPhase::Active && progress == ActionProgress::Running,
        }
    }

    fn fire(
        &mut self,
        plan: &PetriPlan,
        instance: usize,
        first: usize,
        host: &mut impl PlanHost,
    ) -> Result<(), StepError> {
        let own = &plan.instances[instance];
        let net = &plan.nets[own.net];
        for at in first..self.candidates.len() {
            let candidate = self.candidates[at];
            let transition = &net.transitions[candidate.transition];
            let marking = &mut self.marking[own.places..];
            if !transition.is_enabled(marking) {
                self.conflicts.push(candidate);
                continue;
            }
            transition.fire(marking, MOST_TOKENS).map_err(|place| StepError {
                plan: own.path.clone(),
                transition: transition.title(),
                place: net.places[place].title().into(),
            })?;
            for (action, event) in &transition.events {
                self.control(plan, own, *action, *event, host);
            }
            self.release(plan, own, transition, host);
            self.fired.push(candidate);
            // A goal or a failure ends the plan at once, as in its state space.
            if self.reached(instance) != ActionProgress::Running {
                break;
            }
        }
        Ok(())
    }

    /// Interrupts actions that have lost their last token.
    /// Only without `end`, `fail` or `interrupt`.
    fn release(
        &mut self,
        plan: &PetriPlan,
        own: &NetRun,
        transition: &NetTransition,
        host: &mut impl PlanHost,
    ) {
        let net = &plan.nets[own.net];
        for action in transition.inputs.iter().filter_map(|(place, _)| net.places[*place].action) {
            let is_held = |(at, place): (usize, &crate::net::NetPlace)| {
                place.action == Some(action) && self.marking[own.places + at] > 0
            };
            if self.actions[own.states + action].phase == ActionPhase::Active
                && !net.places.iter().enumerate().any(is_held)
            {
                self.control(plan, own, action, ActionEvent::Interrupt, host);
            }
        }
    }

    /// Applies an event to an action, or to the sub-plan that performs it.
    fn control(
        &mut self,
        plan: &PetriPlan,
        own: &NetRun,
        action: usize,
        event: ActionEvent,
        host: &mut impl PlanHost,
    ) {
        let state = own.states + action;
        let was = self.actions[state].phase;
        let next = match event {
            ActionEvent::Start | ActionEvent::Resume => ActionPhase::Active,
            ActionEvent::End | ActionEvent::Fail => ActionPhase::Inactive,
            ActionEvent::Interrupt => ActionPhase::Suspended,
        };
        // An event that finds the action where it leads to changes nothing, except that a start begins anew.
        if was == next && event != ActionEvent::Start || was == ActionPhase::Inactive && !event.activates() {
            return;
        }
        self.actions[state].phase = next;
        if event.activates() {
            self.actions[state].progress = ActionProgress::Running;
        }
        match own.performers[action] {
            Performer::Host(index) => {
                if was == ActionPhase::Active || event.activates() {
                    host.control(index, &plan.actions[index], event);
                }
            }
            Performer::Instance(inner) => match event {
                ActionEvent::Resume if was == ActionPhase::Suspended => self.resume_inside(inner, host),
                ActionEvent::Start | ActionEvent::Resume => {
                    self.stop(inner, ActionEvent::End, host);
                    self.reset(inner);
                    self.actions[state].progress = self.progress[inner];
                }
                ActionEvent::End | ActionEvent::Fail | ActionEvent::Interrupt => {
                    self.stop(inner, event, host);
                }
            },
        }
    }

    /// Returns the next random number (SplitMix64).
    fn random(&mut self) -> u64 {
        self.random = self.random.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.random;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^ (bits >> 31)
    }
}
