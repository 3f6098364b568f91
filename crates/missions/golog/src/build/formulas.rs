//! Expressions with their types.

use super::{NamedPart, TRUTH, TheoryBuilder};
use crate::error::GologError;
use crate::text::*;
use crate::theory::NumberTable;
use crate::theory::formula::{FormulaComparison, GologFormula};

/// Type of an expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FormulaType {
    /// Truth values are those of the domain [`TRUTH`].
    Symbol(usize),
    Number,
}

impl TheoryBuilder<'_> {
    pub(super) fn type_of(&self, domain: usize) -> FormulaType {
        match self.theory.domains[domain].symbols.is_empty() {
            true => FormulaType::Number,
            false => FormulaType::Symbol(domain),
        }
    }

    fn type_title(&self, own: FormulaType) -> String {
        match own {
            FormulaType::Symbol(TRUTH) => "true or false".into(),
            FormulaType::Symbol(domain) => format!("a value of `{}`", self.theory.domains[domain].name),
            FormulaType::Number => "a number".into(),
        }
    }

    /// Returns an expression that is true or false.
    pub(super) fn truth(&mut self, written: &WrittenExpression) -> Result<GologFormula, GologError> {
        self.typed(written, FormulaType::Symbol(TRUTH))
    }

    /// Returns an expression of a type.
    pub(super) fn typed(
        &mut self,
        written: &WrittenExpression,
        expected: FormulaType,
    ) -> Result<GologFormula, GologError> {
        let (formula, found) = self.formula(written)?;
        match found == expected {
            true => Ok(formula),
            false => {
                let reason =
                    format!("expected {}, found {}", self.type_title(expected), self.type_title(found));
                Err(self.error(written.range, reason))
            }
        }
    }

    /// Arguments of something with a name.
    pub(super) fn arguments(
        &mut self,
        name: &WrittenName,
        written: &[WrittenExpression],
        domains: &[usize],
    ) -> Result<Box<[GologFormula]>, GologError> {
        if written.len() != domains.len() {
            let reason =
                format!("expected {} arguments of `{}`, found {}", domains.len(), name.text, written.len());
            return Err(self.error(name.range, reason));
        }
        let mut arguments = Vec::new();
        for (written, domain) in written.iter().zip(domains) {
            let formula = self.typed(written, self.type_of(*domain))?;
            self.check_constant(&formula, *domain, written.range)?;
            arguments.push(formula);
        }
        Ok(arguments.into())
    }

    /// Refuses a constant outside of a domain.
    pub(super) fn check_constant(
        &self,
        formula: &GologFormula,
        domain: usize,
        range: TextRange,
    ) -> Result<(), GologError> {
        let domain = &self.theory.domains[domain];
        match formula {
            GologFormula::Constant(value) if domain.index(*value).is_none() => {
                Err(self.error(range, format!("expected a value of {}, found {value}", domain.title())))
            }
            _ => Ok(()),
        }
    }

    /// Returns a value of a domain that no situation changes.
    pub(super) fn constant(&mut self, written: &WrittenExpression, domain: usize) -> Result<i32, GologError> {
        let formula = self.typed(written, self.type_of(domain))?;
        self.check_constant(&formula, domain, written.range)?;
        match formula {
            GologFormula::Constant(value) => Ok(value),
            _ => Err(self.error(written.range, "expected a value that no situation changes")),
        }
    }

    fn formula(&mut self, written: &WrittenExpression) -> Result<(GologFormula, FormulaType), GologError> {
        let is_truth = FormulaType::Symbol(TRUTH);
        Ok(match &written.kind {
            WrittenOperation::Number(number) => (GologFormula::Constant(*number), FormulaType::Number),
            WrittenOperation::Real(number) => {
                let reason = format!("expected a whole number, found {number}");
                let help = "other numbers are arguments of the robot's actions, after `performs`";
                return Err(self.error(written.range, reason).with_help(Some(help.into())));
            }
            WrittenOperation::Name(name, arguments) => self.named(name, arguments)?,
            WrittenOperation::Not(inner) => (GologFormula::Not(Box::new(self.truth(inner)?)), is_truth),
            WrittenOperation::Known(inner) => {
                (GologFormula::Known(Box::new(self.formula(inner)?.0)), is_truth)
            }
            WrittenOperation::Negative(inner) => {
                let formula = match self.typed(inner, FormulaType::Number)? {
                    GologFormula::Constant(number) => GologFormula::Constant(-number),
                    inner => GologFormula::Negative(Box::new(inner)),
                };
                (formula, FormulaType::Number)
            }
            WrittenOperation::All(parts) => (GologFormula::All(self.truths(parts)?), is_truth),
            WrittenOperation::Any(parts) => (GologFormula::Any(self.truths(parts)?), is_truth),
            WrittenOperation::Binary(operator, sides) => self.binary(*operator, sides)?,
            WrittenOperation::Quantified(is_all, variable, inner) => {
                let (slot, domain) = self.bind_one(variable)?;
                let inner = self.truth(inner)?;
                self.variables.pop();
                (GologFormula::Quantified(*is_all, slot, domain, Box::new(inner)), is_truth)
            }
        })
    }

    fn truths(&mut self, parts: &[WrittenExpression]) -> Result<Box<[GologFormula]>, GologError> {
        parts.iter().map(|part| self.truth(part)).collect()
    }

    fn binary(
        &mut self,
        operator: WrittenOperator,
        sides: &[WrittenExpression; 2],
    ) -> Result<(GologFormula, FormulaType), GologError> {
        let (left, kind) = self.formula(&sides[0])?;
        let is_equality = matches!(operator, WrittenOperator::Equal | WrittenOperator::Unequal);
        if !is_equality && kind != FormulaType::Number {
            let reason = format!("expected a number, found {}", self.type_title(kind));
            return Err(self.error(sides[0].range, reason));
        }
        let mut both = Box::new([left, self.typed(&sides[1], kind)?]);
        if matches!(operator, WrittenOperator::Greater | WrittenOperator::AtLeast) {
            both.reverse();
        }
        let compare =
            |comparison, both| (GologFormula::Compare(comparison, both), FormulaType::Symbol(TRUTH));
        Ok(match operator {
            WrittenOperator::Plus => (GologFormula::Sum(both), FormulaType::Number),
            WrittenOperator::Minus => (GologFormula::Difference(both), FormulaType::Number),
            WrittenOperator::Equal => compare(FormulaComparison::Equal, both),
            WrittenOperator::Unequal => compare(FormulaComparison::Unequal, both),
            WrittenOperator::Less | WrittenOperator::Greater => compare(FormulaComparison::Less, both),
            WrittenOperator::AtMost | WrittenOperator::AtLeast => compare(FormulaComparison::AtMost, both),
        })
    }

    fn named(
        &mut self,
        name: &WrittenName,
        arguments: &[WrittenExpression],
    ) -> Result<(GologFormula, FormulaType), GologError> {
        if let Some(variable) = self.variables.iter().find(|variable| variable.name == name.text) {
            let (slot, domain) = (variable.slot, variable.domain);
            self.arguments(name, arguments, &[])?;
            return Ok((GologFormula::Variable(slot), self.type_of(domain)));
        }
        match self.names.get(&name.text).copied() {
            Some(NamedPart::Symbol(domain, value)) => {
                self.arguments(name, arguments, &[])?;
                Ok((GologFormula::Constant(value), FormulaType::Symbol(domain)))
            }
            Some(NamedPart::Fluent(fluent)) => {
                self.theory.fluents[fluent].is_read = true;
                let domains = self.theory.fluents[fluent].domains.clone();
                let kind = self.type_of(self.theory.fluents[fluent].value);
                Ok((GologFormula::Fluent(fluent, self.arguments(name, arguments, &domains)?), kind))
            }
            Some(NamedPart::Defined(defined)) => {
                self.theory.defined[defined].is_read = true;
                let domains = self.theory.defined[defined].domains.clone();
                let arguments = self.arguments(name, arguments, &domains)?;
                Ok((GologFormula::Defined(defined, arguments), FormulaType::Symbol(TRUTH)))
            }
            _ => Err(self.unknown(name, "fluent or value", |part| {
                matches!(part, NamedPart::Symbol(..) | NamedPart::Fluent(_) | NamedPart::Defined(_))
            })),
        }
    }

    pub(super) fn define_table(
        &mut self,
        name: &WrittenName,
        entries: &[(Vec<WrittenExpression>, f64)],
    ) -> Result<(), GologError> {
        let Some(NamedPart::Table(table)) = self.names.get(&name.text).copied() else { return Ok(()) };
        let domains = self.theory.tables[table].domains.clone();
        let sizes = domains.iter().map(|domain| self.theory.domains[*domain].size());
        let count = sizes.fold(1usize, usize::saturating_mul);
        if count > super::MOST_CELLS {
            return Err(self.error(name.range, format!("expected at most {} entries", super::MOST_CELLS)));
        }
        let mut values = vec![None; count];
        for (keys, number) in entries {
            let range = keys.first().map_or(name.range, |first| first.range);
            let arguments = self.arguments(name, keys, &domains)?;
            let mut entry = 0;
            for ((key, domain), formula) in keys.iter().zip(&domains).zip(&arguments) {
                let GologFormula::Constant(value) = *formula else {
                    return Err(self.error(key.range, "expected a value that no situation changes"));
                };
                let domain = &self.theory.domains[*domain];
                // The arguments are in their domains.
                entry = entry * domain.size() + domain.index(value).unwrap_or(0);
            }
            if values[entry].replace(*number).is_some() {
                return Err(self.error(range, format!("the table `{}` has this entry twice", name.text)));
            }
        }
        let NumberTable { values: own, .. } = &mut self.theory.tables[table];
        *own = values.iter().map_while(|value| *value).collect();
        match own.len() == count {
            true => Ok(()),
            false => {
                let reason =
                    format!("expected {count} entries of the table `{}`, one for each value", name.text);
                Err(self.error(name.range, reason))
            }
        }
    }
}
