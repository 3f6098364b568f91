//! Actions with preconditions and effects.

use super::formulas::FormulaType;
use super::{NamedPart, TRUTH, TheoryBuilder};
use crate::error::GologError;
use crate::text::*;
use crate::theory::formula::GologFormula;
use crate::theory::{ActionEffect, RobotArgument};

impl TheoryBuilder<'_> {
    pub(super) fn define_initial(
        &mut self,
        name: &WrittenName,
        arguments: &[WrittenExpression],
        value: &WrittenExpression,
    ) -> Result<(), GologError> {
        let fluent = self.fluent(name)?;
        let (domains, domain) =
            (self.theory.fluents[fluent].domains.clone(), self.theory.fluents[fluent].value);
        let formulas = self.arguments(name, arguments, &domains)?;
        let mut values = Vec::new();
        for (formula, written) in formulas.iter().zip(arguments) {
            match formula {
                GologFormula::Constant(value) => values.push(*value),
                _ => return Err(self.error(written.range, "expected a value that no situation changes")),
            }
        }
        let value = self.constant(value, domain)?;
        if let Some(cell) = self.theory.cell_of(&self.theory.fluents[fluent], &values) {
            self.theory.initial[cell] = value;
        }
        Ok(())
    }

    fn fluent(&self, name: &WrittenName) -> Result<usize, GologError> {
        match self.names.get(&name.text) {
            Some(NamedPart::Fluent(fluent)) => Ok(*fluent),
            _ => Err(self.unknown(name, "fluent", |part| matches!(part, NamedPart::Fluent(_)))),
        }
    }

    pub(super) fn define_action(&mut self, index: usize, written: &WrittenAction) -> Result<(), GologError> {
        let possible = written.possible.as_ref().map(|formula| self.truth(formula)).transpose()?;
        let performs = match &written.performs {
            Some((None, _)) => None,
            Some((Some(name), arguments)) => {
                let arguments: Result<_, _> =
                    arguments.iter().map(|argument| self.robot_argument(argument)).collect();
                Some((name.text.clone(), arguments?))
            }
            None if written.is_exogenous => None,
            None => Some((self.theory.actions[index].name.clone(), self.own_arguments(index))),
        };
        let senses = match &written.senses {
            Some((name, arguments)) => {
                let fluent = self.written_fluent(name)?;
                if self.theory.fluents[fluent].value != TRUTH {
                    let reason = format!("expected a fluent that is true or false, found `{}`", name.text);
                    return Err(self.error(name.range, reason));
                }
                let domains = self.theory.fluents[fluent].domains.clone();
                Some((fluent, self.arguments(name, arguments, &domains)?))
            }
            None => None,
        };
        if let (true, Some((name, _))) = (written.is_exogenous, &written.senses) {
            return Err(self.error(name.range, "expected an effect: an exogenous action senses nothing"));
        }
        let effects = self.effects(&written.effects)?;
        let failure_effects = self.effects(&written.failure_effects)?;
        let action = &mut self.theory.actions[index];
        (action.possible, action.performs, action.senses) = (possible, performs, senses);
        action.effects = effects;
        action.failure_effects = written.handles_failure.then_some(failure_effects);
        Ok(())
    }

    /// Returns the action's numeric arguments, as those of the robot's action.
    fn own_arguments(&self, index: usize) -> Vec<RobotArgument> {
        let domains = self.theory.actions[index].domains.iter().enumerate();
        let numbers = domains.filter(|(_, domain)| self.type_of(**domain) == FormulaType::Number);
        numbers.map(|(slot, _)| RobotArgument::Formula(GologFormula::Variable(slot))).collect()
    }

    fn written_fluent(&mut self, name: &WrittenName) -> Result<usize, GologError> {
        let fluent = self.fluent(name)?;
        if self.theory.fluents[fluent].is_condition {
            let reason =
                format!("expected a fluent, found `{}`, a condition that the robot reports", name.text);
            return Err(self.error(name.range, reason));
        }
        self.theory.fluents[fluent].is_written = true;
        Ok(fluent)
    }

    fn effects(&mut self, written: &[WrittenEffect]) -> Result<Vec<ActionEffect>, GologError> {
        written.iter().map(|effect| self.effect(effect)).collect()
    }

    fn effect(&mut self, written: &WrittenEffect) -> Result<ActionEffect, GologError> {
        let visible = self.variables.len();
        let variables: Result<Vec<_>, _> =
            written.variables.iter().map(|variable| self.bind_one(variable)).collect();
        let fluent = self.written_fluent(&written.fluent)?;
        let domains = self.theory.fluents[fluent].domains.clone();
        let arguments = self.arguments(&written.fluent, &written.arguments, &domains)?;
        let domain = self.theory.fluents[fluent].value;
        let value = self.typed(&written.value, self.type_of(domain))?;
        self.check_constant(&value, domain, written.value.range)?;
        let condition = written.condition.as_ref().map(|condition| self.truth(condition)).transpose()?;
        self.variables.truncate(visible);
        Ok(ActionEffect { variables: variables?, fluent, arguments, value, condition })
    }

    fn robot_argument(&mut self, written: &WrittenExpression) -> Result<RobotArgument, GologError> {
        match &written.kind {
            WrittenOperation::Real(number) => Ok(RobotArgument::Number(*number)),
            WrittenOperation::Negative(inner) => match inner.kind {
                WrittenOperation::Real(number) => Ok(RobotArgument::Number(-number)),
                _ => Ok(RobotArgument::Formula(self.typed(written, FormulaType::Number)?)),
            },
            WrittenOperation::Name(name, arguments) => match self.names.get(&name.text).copied() {
                Some(NamedPart::Table(table)) => {
                    let domains = self.theory.tables[table].domains.clone();
                    Ok(RobotArgument::Table(table, self.arguments(name, arguments, &domains)?))
                }
                _ => Ok(RobotArgument::Formula(self.typed(written, FormulaType::Number)?)),
            },
            _ => Ok(RobotArgument::Formula(self.typed(written, FormulaType::Number)?)),
        }
    }
}
