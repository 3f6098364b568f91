//! Place/transition nets with the labels of Petri Net Plans.

use crate::guard::{GuardText, NetGuard};
use crate::label::ActionEvent;

/// Place of a [`PetriNet`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NetPlace {
    /// Identifier in the file.
    pub id: String,
    /// Label, such as `goto_6_2.exec`.
    pub name: String,
    /// Tokens at the start.
    pub initial: u32,
    /// Action that runs while the place has a token: an index of [`PetriNet::actions`].
    pub action: Option<usize>,
    /// Tokens of the place in the goal marking.
    pub goal: Option<u32>,
    /// Tokens of the place in the marking in which the plan has failed.
    pub fail: Option<u32>,
}

impl NetPlace {
    /// Returns the label, or the identifier of a place without one.
    pub fn title(&self) -> &str {
        match self.name.trim() {
            "" => &self.id,
            name => name,
        }
    }
}

/// Transition of a [`PetriNet`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NetTransition {
    /// Identifier in the file.
    pub id: String,
    /// Label, such as `goto_6_2.interrupt [obstacle]`.
    pub name: String,
    /// Input arcs: places with the number of tokens taken.
    pub inputs: Vec<(usize, u32)>,
    /// Output arcs: places with the number of tokens put.
    pub outputs: Vec<(usize, u32)>,
    /// Events of actions, in this order.
    pub events: Vec<(usize, ActionEvent)>,
    /// Guard, also that of an `end` without one.
    pub guard: Option<NetGuard>,
    /// Words of the label that are neither an event nor a guard.
    pub unknown: Vec<String>,
}

impl NetTransition {
    /// Returns the label with the identifier.
    pub fn title(&self) -> String {
        match self.name.trim() {
            "" => self.id.clone(),
            name => format!("{} ({name})", self.id),
        }
    }

    /// Returns true if the marking has the tokens that the transition takes.
    pub fn is_enabled(&self, marking: &[u32]) -> bool {
        self.inputs.iter().all(|(place, weight)| marking[*place] >= *weight)
    }

    /// Fires an enabled transition: moves its tokens.
    /// Returns a place that would have more than `limit`, if one would; the marking is then unchanged.
    pub fn fire(&self, marking: &mut [u32], limit: u32) -> Result<(), usize> {
        for (place, weight) in &self.inputs {
            marking[*place] -= weight;
        }
        let full = self
            .outputs
            .iter()
            .find(|(place, weight)| marking[*place].checked_add(*weight).is_none_or(|tokens| tokens > limit));
        if let Some((full, _)) = full {
            for (place, weight) in &self.inputs {
                marking[*place] += weight;
            }
            return Err(*full);
        }
        for (place, weight) in &self.outputs {
            marking[*place] += weight;
        }
        Ok(())
    }
}

/// Place/transition net with the labels of Petri Net Plans, checked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PetriNet {
    pub(crate) name: String,
    pub(crate) places: Vec<NetPlace>,
    pub(crate) transitions: Vec<NetTransition>,
    pub(crate) actions: Vec<String>,
    pub(crate) conditions: Vec<String>,
}

impl PetriNet {
    /// Returns the name of the plan.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the places, in the order of the file.
    pub fn places(&self) -> &[NetPlace] {
        &self.places
    }

    /// Returns the transitions, in the order of the file.
    pub fn transitions(&self) -> &[NetTransition] {
        &self.transitions
    }

    /// Returns the actions with their arguments, such as `goto_6_2`.
    pub fn actions(&self) -> &[String] {
        &self.actions
    }

    /// Returns the conditions of guards that the host answers.
    pub fn conditions(&self) -> &[String] {
        &self.conditions
    }

    /// Returns the tokens of each place at the start.
    pub fn initial_marking(&self) -> Vec<u32> {
        self.places.iter().map(|place| place.initial).collect()
    }

    /// Returns true if a marking is the goal.
    /// Each place with a goal has exactly that many tokens, and at least one has a goal.
    pub fn is_goal(&self, marking: &[u32]) -> bool {
        self.fits(marking, |place| place.goal)
    }

    /// Returns whether the plan has failed in a marking.
    pub fn is_failure(&self, marking: &[u32]) -> bool {
        self.fits(marking, |place| place.fail)
    }

    fn fits(&self, marking: &[u32], count: impl Fn(&NetPlace) -> Option<u32>) -> bool {
        let mut is_declared = false;
        for (place, tokens) in self.places.iter().zip(marking) {
            if let Some(count) = count(place) {
                is_declared = true;
                if count != *tokens {
                    return false;
                }
            }
        }
        is_declared
    }

    /// Returns a guard as text.
    pub fn guard_text(&self, guard: &NetGuard) -> String {
        GuardText { guard, conditions: &self.conditions, actions: &self.actions }.to_string()
    }

    /// Returns a marking as text.
    /// The places that have tokens, with their number where it is not 1.
    pub fn marking_text(&self, marking: &[u32]) -> String {
        let marked = self.places.iter().zip(marking).filter(|(_, tokens)| **tokens > 0);
        let texts: Vec<String> = marked
            .map(|(place, tokens)| match tokens {
                1 => place.title().to_owned(),
                _ => format!("{tokens} x {}", place.title()),
            })
            .collect();
        if texts.is_empty() { "no token".into() } else { texts.join(", ") }
    }
}
