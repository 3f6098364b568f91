//! Expressions over a situation.

use crate::theory::ActionTheory;

/// Value of an unknown fluent.
pub(crate) const UNKNOWN: i32 = i32::MIN;

/// Maximum number of variables of a procedure, an action or a defined fluent.
pub(crate) const MOST_VARIABLES: usize = 16;

/// Values of variables; those without a value are 0.
pub(crate) type Bindings = [i32; MOST_VARIABLES];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FormulaComparison {
    Equal,
    Unequal,
    Less,
    AtMost,
}

/// Expression of a theory; truth is 1 and 0, symbols count from 0.
#[derive(Clone, Debug)]
pub(crate) enum GologFormula {
    Constant(i32),
    Variable(usize),
    Fluent(usize, Box<[GologFormula]>),
    Defined(usize, Box<[GologFormula]>),
    Not(Box<GologFormula>),
    Known(Box<GologFormula>),
    Negative(Box<GologFormula>),
    All(Box<[GologFormula]>),
    Any(Box<[GologFormula]>),
    Compare(FormulaComparison, Box<[GologFormula; 2]>),
    Sum(Box<[GologFormula; 2]>),
    Difference(Box<[GologFormula; 2]>),
    /// Quantifier: true for "for all", the variable, its domain, and the formula.
    Quantified(bool, usize, usize, Box<GologFormula>),
}

/// Theory and the values of its fluents.
#[derive(Clone, Copy)]
pub(crate) struct SituationView<'a> {
    pub theory: &'a ActionTheory,
    pub cells: &'a [i32],
}

impl SituationView<'_> {
    /// Evaluates with three values: what depends on an unknown fluent is unknown.
    pub fn evaluate(self, formula: &GologFormula, bindings: &mut Bindings) -> Result<i32, String> {
        Ok(match formula {
            GologFormula::Constant(value) => *value,
            GologFormula::Variable(slot) => bindings[*slot],
            GologFormula::Fluent(fluent, arguments) => match self.cell(*fluent, arguments, bindings)? {
                Some(cell) => self.cells[cell],
                None => UNKNOWN,
            },
            GologFormula::Defined(defined, arguments) => {
                let defined = &self.theory.defined[*defined];
                match self.arguments(&defined.domains, &defined.name, arguments, bindings)? {
                    Some(mut own) => self.evaluate(&defined.formula, &mut own)?,
                    None => UNKNOWN,
                }
            }
            GologFormula::Not(inner) => match self.evaluate(inner, bindings)? {
                UNKNOWN => UNKNOWN,
                value => 1 - value,
            },
            GologFormula::Known(inner) => i32::from(self.evaluate(inner, bindings)? != UNKNOWN),
            GologFormula::Negative(inner) => match self.evaluate(inner, bindings)? {
                UNKNOWN => UNKNOWN,
                value => checked(value.checked_neg())?,
            },
            GologFormula::All(parts) => self.join(parts, 0, bindings)?,
            GologFormula::Any(parts) => self.join(parts, 1, bindings)?,
            GologFormula::Compare(comparison, sides) => match self.both(sides, bindings)? {
                None => UNKNOWN,
                Some((left, right)) => i32::from(match comparison {
                    FormulaComparison::Equal => left == right,
                    FormulaComparison::Unequal => left != right,
                    FormulaComparison::Less => left < right,
                    FormulaComparison::AtMost => left <= right,
                }),
            },
            GologFormula::Sum(sides) => match self.both(sides, bindings)? {
                None => UNKNOWN,
                Some((left, right)) => checked(left.checked_add(right))?,
            },
            GologFormula::Difference(sides) => match self.both(sides, bindings)? {
                None => UNKNOWN,
                Some((left, right)) => checked(left.checked_sub(right))?,
            },
            GologFormula::Quantified(is_all, slot, domain, inner) => {
                let domain = &self.theory.domains[*domain];
                let decisive = i32::from(!is_all);
                let mut joined = 1 - decisive;
                for value in domain.low..=domain.high {
                    bindings[*slot] = value;
                    match self.evaluate(inner, bindings)? {
                        UNKNOWN => joined = UNKNOWN,
                        value if value == decisive => {
                            joined = decisive;
                            break;
                        }
                        _ => {}
                    }
                }
                bindings[*slot] = 0;
                joined
            }
        })
    }

    /// Returns true if a formula is known to hold.
    pub fn holds(self, formula: &GologFormula, bindings: &Bindings) -> Result<bool, String> {
        Ok(self.evaluate(formula, &mut bindings.clone())? == 1)
    }

    /// Joins formulas by `and` or `or`, up to the first that decides.
    fn join(self, parts: &[GologFormula], decisive: i32, bindings: &mut Bindings) -> Result<i32, String> {
        let mut joined = 1 - decisive;
        for part in parts {
            match self.evaluate(part, bindings)? {
                UNKNOWN => joined = UNKNOWN,
                value if value == decisive => return Ok(decisive),
                _ => {}
            }
        }
        Ok(joined)
    }

    fn both(self, sides: &[GologFormula; 2], bindings: &mut Bindings) -> Result<Option<(i32, i32)>, String> {
        let (left, right) = (self.evaluate(&sides[0], bindings)?, self.evaluate(&sides[1], bindings)?);
        Ok((left != UNKNOWN && right != UNKNOWN).then_some((left, right)))
    }

    /// Returns the cell of a fluent; `None` if an argument is unknown.
    pub fn cell(
        self,
        fluent: usize,
        arguments: &[GologFormula],
        bindings: &mut Bindings,
    ) -> Result<Option<usize>, String> {
        let fluent = &self.theory.fluents[fluent];
        let mut cell = 0;
        for (argument, domain) in arguments.iter().zip(&fluent.domains) {
            let value = self.evaluate(argument, bindings)?;
            if value == UNKNOWN {
                return Ok(None);
            }
            let domain = &self.theory.domains[*domain];
            cell = cell * domain.size()
                + domain.index(value).ok_or_else(|| domain.outside(value, &fluent.name))?;
        }
        Ok(Some(fluent.base + cell))
    }

    /// Values of arguments as bindings; `None` if one is unknown.
    pub fn arguments(
        self,
        domains: &[usize],
        name: &str,
        arguments: &[GologFormula],
        bindings: &mut Bindings,
    ) -> Result<Option<Bindings>, String> {
        let mut own = [0; MOST_VARIABLES];
        for (slot, (argument, domain)) in arguments.iter().zip(domains).enumerate() {
            let value = self.evaluate(argument, bindings)?;
            if value == UNKNOWN {
                return Ok(None);
            }
            let domain = &self.theory.domains[*domain];
            domain.index(value).ok_or_else(|| domain.outside(value, name))?;
            own[slot] = value;
        }
        Ok(Some(own))
    }
}

fn checked(value: Option<i32>) -> Result<i32, String> {
    let value = value.filter(|value| *value != UNKNOWN);
    value.ok_or_else(|| "expected a sum within 32 bits".into())
}
