//! Conditions and exogenous actions that the robot reports.

use crate::interpreter::GroundAction;
use crate::theory::{ActionTheory, MOST_ARGUMENTS};

/// Exogenous action that a condition of its name reports.
#[derive(Clone, Debug)]
pub(super) struct ObservedAction {
    pub name: String,
    pub action: GroundAction,
    /// Value of the condition; while true, the action is not reported again.
    pub holds: bool,
}

/// Names of the robot's conditions and exogenous actions.
#[derive(Clone, Debug)]
pub(super) struct ObservedNames {
    /// Conditions with their cells.
    pub conditions: Vec<(String, usize)>,
    pub actions: Vec<ObservedAction>,
}

impl ObservedNames {
    pub fn is_empty(&self) -> bool {
        self.conditions.is_empty() && self.actions.is_empty()
    }

    pub fn new(theory: &ActionTheory) -> Self {
        let mut own = Self { conditions: Vec::new(), actions: Vec::new() };
        for fluent in theory.fluents.iter().filter(|fluent| fluent.is_condition) {
            own.conditions
                .extend((0..fluent.count).map(|cell| (theory.cell_name(fluent, cell), fluent.base + cell)));
        }
        for (number, model) in theory.actions.iter().enumerate().filter(|(_, model)| model.is_exogenous) {
            for index in 0..theory.combinations(&model.domains) {
                let mut arguments = [0; MOST_ARGUMENTS];
                arguments[..model.domains.len()].copy_from_slice(&theory.arguments_at(&model.domains, index));
                let name = theory.call_name(&model.name, &model.domains, &arguments);
                // A theory has few actions.
                let action = GroundAction { action: number as u32, arguments };
                own.actions.push(ObservedAction { name, action, holds: false });
            }
        }
        own
    }
}
