//! Actions with arguments.

use crate::theory::{ActionTheory, MOST_ARGUMENTS};

/// Action with its arguments.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct GroundAction {
    pub action: u32,
    pub arguments: [i32; MOST_ARGUMENTS],
}

impl GroundAction {
    pub fn text(&self, theory: &ActionTheory) -> String {
        let model = &theory.actions[self.action as usize];
        theory.call_name(&model.name, &model.domains, &self.arguments)
    }
}
