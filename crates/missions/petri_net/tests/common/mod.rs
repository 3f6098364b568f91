//! Nets and hosts for tests.

use std::collections::BTreeMap;

use slate_petri_net::{ActionEvent, ActionProgress, NetBuilder, PetriNet, PlanAction, PlanHost};

/// A host whose actions and conditions the test sets, with a log of its orders.
#[derive(Default)]
pub struct Script {
    pub conditions: BTreeMap<String, bool>,
    pub progress: BTreeMap<String, ActionProgress>,
    pub log: Vec<String>,
}

impl Script {
    pub fn set(&mut self, condition: &str, value: bool) {
        self.conditions.insert(condition.into(), value);
    }

    pub fn end(&mut self, action: &str, progress: ActionProgress) {
        self.progress.insert(action.into(), progress);
    }

    /// The orders since the last call.
    pub fn orders(&mut self) -> Vec<String> {
        std::mem::take(&mut self.log)
    }
}

impl PlanHost for Script {
    fn condition(&mut self, _: usize, name: &str) -> Option<bool> {
        self.conditions.get(name).copied()
    }

    fn progress(&mut self, _: usize, action: &PlanAction) -> ActionProgress {
        self.progress.get(action.text()).copied().unwrap_or(ActionProgress::Running)
    }

    fn control(&mut self, _: usize, action: &PlanAction, event: ActionEvent) {
        if event.activates() {
            self.progress.remove(action.text());
        }
        self.log.push(format!("{} {}", event.word(), action.text()));
    }
}

/// Makes a net of places with tokens, and of transitions with the numbers of the places that they take from and put to.
pub fn net(name: &str, places: &[(&str, u32)], transitions: &[(&str, &[usize], &[usize])]) -> PetriNet {
    let mut builder = NetBuilder::new(name);
    for (label, tokens) in places {
        builder.place(label, *tokens);
    }
    let arcs = |places: &[usize]| places.iter().map(|place| (*place, 1)).collect::<Vec<_>>();
    for (label, inputs, outputs) in transitions {
        builder.transition(label, &arcs(inputs), &arcs(outputs));
    }
    builder.finish().unwrap()
}
