//! Effects of actions on a situation.

use super::ground_action::GroundAction;
use crate::error::GologRunError;
use crate::theory::formula::{MOST_VARIABLES, SituationView, UNKNOWN};
use crate::theory::program::stable_hash;
use crate::theory::{ActionEffect, ActionTheory, MOST_ARGUMENTS};

/// Outcome of an action, which its effects depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum EffectKind {
    /// Not performed: its sensed fluent becomes unknown.
    Planned,
    /// Ended, with the sensed value.
    Ended(Option<bool>),
    Failed,
}

/// Values of all fluents, with the changes that can be undone.
#[derive(Clone, Debug, Default)]
pub(crate) struct SituationStore {
    pub cells: Vec<i32>,
    /// Cell and its value before, of each change.
    log: Vec<(u32, i32)>,
    /// Cells and values of the newest effects.
    writes: Vec<(usize, i32)>,
}

impl SituationStore {
    pub fn new(cells: Vec<i32>) -> Self {
        Self { cells, ..Self::default() }
    }

    /// Returns the hash of all values.
    pub fn hash(&self) -> u64 {
        self.cells.iter().fold(0, |hash, value| stable_hash(hash, &value.to_le_bytes()))
    }

    /// Returns a mark to which changes can be undone.
    pub fn mark(&self) -> usize {
        self.log.len()
    }

    pub fn undo(&mut self, mark: usize) {
        while self.log.len() > mark
            && let Some((cell, value)) = self.log.pop()
        {
            self.cells[cell as usize] = value;
        }
    }

    /// Forgets how to undo.
    pub fn commit(&mut self) {
        self.log.clear();
    }

    /// Sets a value; returns whether it was another one.
    pub fn set(&mut self, cell: usize, value: i32) -> bool {
        let before = std::mem::replace(&mut self.cells[cell], value);
        if before != value {
            // A theory has few cells.
            self.log.push((cell as u32, before));
        }
        before != value
    }

    /// Applies the effects of an action: all conditions and values are those before it.
    pub fn apply(
        &mut self,
        theory: &ActionTheory,
        action: &GroundAction,
        kind: EffectKind,
    ) -> Result<(), GologRunError> {
        let model = &theory.actions[action.action as usize];
        let view = SituationView { theory, cells: &self.cells };
        let refused = |reason| GologRunError {
            line: model.line,
            reason: format!("action `{}`: {reason}", action.text(theory)),
        };
        self.writes.clear();
        let mut bindings = [0; MOST_VARIABLES];
        bindings[..MOST_ARGUMENTS].copy_from_slice(&action.arguments);
        if let (Some((fluent, arguments)), false) = (&model.senses, kind == EffectKind::Failed) {
            let cell = view.cell(*fluent, arguments, &mut bindings).map_err(refused)?;
            let cell = cell.ok_or_else(|| refused("expected known arguments of what it senses".into()))?;
            self.writes.push(match kind {
                EffectKind::Ended(Some(value)) => (cell, i32::from(value)),
                _ => (cell, UNKNOWN),
            });
        }
        let effects = match kind {
            EffectKind::Failed => model.failure_effects.as_deref().unwrap_or_default(),
            _ => &model.effects,
        };
        for effect in effects {
            spread(view, effect, 0, &mut bindings, &mut self.writes).map_err(refused)?;
        }
        for at in 0..self.writes.len() {
            let (cell, value) = self.writes[at];
            self.set(cell, value);
        }
        Ok(())
    }
}

/// Adds the writes of an effect, for all values of its variables from one on.
fn spread(
    view: SituationView<'_>,
    effect: &ActionEffect,
    variable: usize,
    bindings: &mut [i32; MOST_VARIABLES],
    writes: &mut Vec<(usize, i32)>,
) -> Result<(), String> {
    if let Some((slot, domain)) = effect.variables.get(variable) {
        let domain = &view.theory.domains[*domain];
        for value in domain.low..=domain.high {
            bindings[*slot] = value;
            spread(view, effect, variable + 1, bindings, writes)?;
        }
        bindings[*slot] = 0;
        return Ok(());
    }
    let condition = match &effect.condition {
        Some(condition) => view.evaluate(condition, bindings)?,
        None => 1,
    };
    if condition == 0 {
        return Ok(());
    }
    let fluent = &view.theory.fluents[effect.fluent];
    let cell = view.cell(effect.fluent, &effect.arguments, bindings)?;
    let cell = cell.ok_or_else(|| format!("expected known arguments of `{}`", fluent.name))?;
    let mut value = view.evaluate(&effect.value, bindings)?;
    let domain = &view.theory.domains[fluent.value];
    if value != UNKNOWN && domain.index(value).is_none() {
        return Err(format!("{}; add a precondition", domain.outside(value, &fluent.name)));
    }
    if condition == UNKNOWN && value != view.cells[cell] {
        value = UNKNOWN;
    }
    // The first of several effects on a fluent counts; a theory has few of them for one action.
    if !writes.iter().any(|(own, _)| *own == cell) {
        writes.push((cell, value));
    }
    Ok(())
}
