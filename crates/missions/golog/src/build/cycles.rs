//! Cycles of defined fluents and of procedures, and the cost of formulas.

use crate::error::GologError;
use crate::text::*;
use crate::theory::formula::GologFormula;
use crate::theory::program::ProgramStep;
use crate::theory::{ActionEffect, ActionTheory, RobotArgument};

/// Deepest evaluation of a formula.
const DEPTH: u64 = 250;
/// Maximum number of parts that an evaluation of a formula may visit.
const MOST_PARTS: u64 = 200_000;

/// Depth of an evaluation, and the most parts that it visits.
type FormulaCost = (u64, u64);

/// Check of a theory for cycles and costs.
pub(super) struct CycleCheck<'a> {
    pub text: &'a str,
    /// First byte of each line.
    pub lines: &'a [usize],
    pub theory: &'a ActionTheory,
}

impl CycleCheck<'_> {
    /// Returns the cost of each step: the maximum number of evaluated formulas.
    /// Parts of formulas count.
    pub fn check(&self, declarations: &[WrittenDeclaration]) -> Result<Vec<u64>, GologError> {
        let costs = self.defined_costs(declarations)?;
        let names = |is_wanted: fn(&WrittenContent) -> bool| -> Vec<TextRange> {
            let own = declarations.iter().filter(|declaration| is_wanted(&declaration.content));
            own.map(|declaration| declaration.name.range).collect()
        };
        let actions = names(|content| matches!(content, WrittenContent::Action { .. }));
        for (action, range) in self.theory.actions.iter().zip(actions) {
            let failure = action.failure_effects.iter().flatten();
            let effects = action.effects.iter().chain(failure);
            let mut worst = effects.map(|effect| self.effect_cost(effect, &costs)).fold((0, 0), joined);
            worst = action.possible.iter().fold(worst, |worst, own| joined(worst, self.cost(own, &costs)));
            for argument in action.performs.iter().flat_map(|(_, arguments)| arguments) {
                if let RobotArgument::Formula(formula) = argument {
                    worst = joined(worst, self.cost(formula, &costs));
                }
            }
            self.check_cost(worst, range)?;
        }
        let procedures = names(|content| matches!(content, WrittenContent::Procedure { .. }));
        let mut parts = Vec::new();
        for node in &self.theory.nodes {
            let cost = self.step_cost(&node.step, &costs);
            let start = self.lines[node.line - 1];
            self.check_cost(cost, TextRange { start, end: start })?;
            parts.push(cost.1);
        }
        self.check_recursion(&procedures)?;
        Ok(parts)
    }

    /// Returns the cost of the formulas that a step evaluates itself.
    fn step_cost(&self, step: &ProgramStep, costs: &[FormulaCost]) -> FormulaCost {
        let sum = |formulas: &[GologFormula]| {
            formulas.iter().fold((0, 0), |sum, part| joined(sum, self.cost(part, costs)))
        };
        match step {
            ProgramStep::Test(formula)
            | ProgramStep::If(formula, ..)
            | ProgramStep::While(formula, _)
            | ProgramStep::Interrupt(formula, _) => self.cost(formula, costs),
            ProgramStep::Act(action, arguments) => {
                let possible = self.theory.actions[*action].possible.iter();
                possible.fold(sum(arguments), |sum, own| joined(sum, self.cost(own, costs)))
            }
            ProgramStep::Call(_, arguments) => sum(arguments),
            _ => (0, 0),
        }
    }

    fn error(&self, range: TextRange, reason: impl Into<String>) -> GologError {
        GologError::at(self.text, range.start, range.end, reason)
    }

    fn check_cost(&self, (depth, parts): FormulaCost, range: TextRange) -> Result<(), GologError> {
        if depth > DEPTH {
            let reason = format!("expected formulas of at most {DEPTH} levels with their defined fluents");
            return Err(self.error(range, reason));
        }
        match parts > MOST_PARTS {
            true => Err(self.error(
                range,
                format!("expected formulas that visit at most {MOST_PARTS} parts: use smaller domains or fewer variables"),
            )),
            false => Ok(()),
        }
    }

    /// Returns the cost of each defined fluent; refuses a cycle with its path.
    fn defined_costs(&self, declarations: &[WrittenDeclaration]) -> Result<Vec<FormulaCost>, GologError> {
        let defined: Vec<TextRange> = declarations
            .iter()
            .filter(|declaration| matches!(declaration.content, WrittenContent::Define { .. }))
            .map(|declaration| declaration.name.range)
            .collect();
        let uses: Vec<Vec<usize>> = self
            .theory
            .defined
            .iter()
            .map(|own| {
                let mut found = Vec::new();
                visit(&own.formula, &mut |part| {
                    if let GologFormula::Defined(other, _) = part {
                        found.push(*other);
                    }
                });
                found
            })
            .collect();
        let order = self.in_order(&uses).map_err(|cycle| {
            let names: Vec<&str> = cycle.iter().map(|own| self.theory.defined[*own].name.as_str()).collect();
            let reason = format!("defined fluents depend on each other: {}", names.join(" -> "));
            let help = "make one of them a fluent that actions change";
            self.error(defined[cycle[0]], reason).with_help(Some(help.into()))
        })?;
        let mut costs = vec![(0, 0); uses.len()];
        for own in order {
            costs[own] = self.cost(&self.theory.defined[own].formula, &costs);
            self.check_cost(costs[own], defined[own])?;
        }
        Ok(costs)
    }

    /// Returns a topological order, used ones first; `Err` has a cycle.
    fn in_order(&self, uses: &[Vec<usize>]) -> Result<Vec<usize>, Vec<usize>> {
        let mut order = Vec::new();
        // 0 is new, 1 on the path, 2 done.
        let mut marks = vec![0u8; uses.len()];
        for start in 0..uses.len() {
            let mut path = vec![(start, 0)];
            if marks[start] != 0 {
                continue;
            }
            marks[start] = 1;
            while let Some((node, next)) = path.last_mut() {
                let node = *node;
                let Some(other) = uses[node].get(*next).copied() else {
                    marks[node] = 2;
                    order.push(node);
                    path.pop();
                    continue;
                };
                *next += 1;
                match marks[other] {
                    0 => {
                        marks[other] = 1;
                        path.push((other, 0));
                    }
                    1 => {
                        let cycle = path.iter().map(|(node, _)| *node).skip_while(|node| *node != other);
                        return Err(cycle.chain([other]).collect());
                    }
                    _ => {}
                }
            }
        }
        Ok(order)
    }

    fn cost(&self, formula: &GologFormula, costs: &[FormulaCost]) -> FormulaCost {
        let inner = |parts: &[GologFormula]| {
            parts.iter().fold((0, 0), |sum, part| joined(sum, self.cost(part, costs)))
        };
        let (depth, parts) = match formula {
            GologFormula::Constant(_) | GologFormula::Variable(_) => (0, 0),
            GologFormula::Fluent(_, arguments) => inner(arguments),
            GologFormula::Defined(defined, arguments) => joined(inner(arguments), costs[*defined]),
            GologFormula::Not(part) | GologFormula::Known(part) | GologFormula::Negative(part) => {
                self.cost(part, costs)
            }
            GologFormula::All(parts) | GologFormula::Any(parts) => inner(parts),
            GologFormula::Compare(_, sides) | GologFormula::Sum(sides) | GologFormula::Difference(sides) => {
                inner(&**sides)
            }
            GologFormula::Quantified(_, _, domain, part) => {
                let (depth, parts) = self.cost(part, costs);
                (depth, parts.saturating_mul(self.theory.domains[*domain].size() as u64))
            }
        };
        (depth + 1, parts.saturating_add(1))
    }

    fn effect_cost(&self, effect: &ActionEffect, costs: &[FormulaCost]) -> FormulaCost {
        let own = effect.condition.iter().chain([&effect.value]).chain(effect.arguments.iter());
        let (depth, parts) = own.fold((0, 0), |sum, part| joined(sum, self.cost(part, costs)));
        let sizes = effect.variables.iter().map(|(_, domain)| self.theory.domains[*domain].size() as u64);
        (depth, sizes.fold(parts, u64::saturating_mul))
    }

    /// Refuses procedures without arguments that call themselves before any step.
    fn check_recursion(&self, ranges: &[TextRange]) -> Result<(), GologError> {
        let uses: Vec<Vec<usize>> = self
            .theory
            .procedures
            .iter()
            .map(|procedure| {
                let mut calls = Vec::new();
                if procedure.domains.is_empty() {
                    self.first_calls(procedure.body, &mut calls);
                }
                calls
            })
            .collect();
        self.in_order(&uses).map(|_| ()).map_err(|cycle| {
            let names: Vec<&str> =
                cycle.iter().map(|own| self.theory.procedures[*own].name.as_str()).collect();
            let reason = format!("the procedure calls itself before any step: {}", names.join(" -> "));
            let help = "put an action or a test before the call";
            self.error(ranges[cycle[0]], reason).with_help(Some(help.into()))
        })
    }

    /// Collects the procedures that a program may call before its first step.
    /// Returns true if it may end without a step.
    fn first_calls(&self, node: usize, calls: &mut Vec<usize>) -> bool {
        match &self.theory.nodes[node].step {
            ProgramStep::Nil => true,
            ProgramStep::Test(_) | ProgramStep::Act(..) => false,
            ProgramStep::Call(procedure, _) => {
                calls.push(*procedure);
                false
            }
            ProgramStep::Sequence(head, tail) => {
                self.first_calls(*head, calls) && self.first_calls(*tail, calls)
            }
            ProgramStep::Choice(branches) => {
                let mut ends = false;
                for branch in branches {
                    ends |= self.first_calls(*branch, calls);
                }
                ends
            }
            ProgramStep::If(_, first, second) => {
                let ends = self.first_calls(*first, calls);
                self.first_calls(*second, calls) || ends
            }
            ProgramStep::Concurrent(first, second) | ProgramStep::Priority(first, second) => {
                let ends = self.first_calls(*first, calls);
                self.first_calls(*second, calls) && ends
            }
            ProgramStep::Pick(_, _, body)
            | ProgramStep::For(_, _, body)
            | ProgramStep::ForRound(_, _, body)
            | ProgramStep::Search(body) => self.first_calls(*body, calls),
            ProgramStep::Repeat(body)
            | ProgramStep::While(_, body)
            | ProgramStep::ParallelRepeat(body)
            | ProgramStep::Interrupt(_, body) => {
                self.first_calls(*body, calls);
                true
            }
        }
    }
}

fn joined(one: FormulaCost, other: FormulaCost) -> FormulaCost {
    (one.0.max(other.0), one.1.saturating_add(other.1))
}

/// Visits a formula and its parts.
fn visit(formula: &GologFormula, seen: &mut impl FnMut(&GologFormula)) {
    seen(formula);
    match formula {
        GologFormula::Constant(_) | GologFormula::Variable(_) => {}
        GologFormula::Fluent(_, parts)
        | GologFormula::Defined(_, parts)
        | GologFormula::All(parts)
        | GologFormula::Any(parts) => {
            parts.iter().for_each(|part| visit(part, seen));
        }
        GologFormula::Not(part) | GologFormula::Known(part) | GologFormula::Negative(part) => {
            visit(part, seen)
        }
        GologFormula::Compare(_, sides) | GologFormula::Sum(sides) | GologFormula::Difference(sides) => {
            sides.iter().for_each(|part| visit(part, seen));
        }
        GologFormula::Quantified(_, _, _, part) => visit(part, seen),
    }
}
