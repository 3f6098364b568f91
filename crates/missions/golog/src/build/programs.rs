//! Programs of procedures.

use super::{NamedPart, TheoryBuilder};
use crate::error::GologError;
use crate::text::*;
use crate::theory::VariableScope;
use crate::theory::program::{ProgramNode, ProgramStep, stable_hash};

/// Maximum number of nodes of all programs.
const MOST_NODES: usize = 100_000;

/// Builder of the program of a procedure.
pub(super) struct ProgramBuilder<'a, 'text> {
    builder: &'a mut TheoryBuilder<'text>,
    procedure: usize,
    /// Innermost visible variable.
    scope: Option<usize>,
}

impl<'a, 'text> ProgramBuilder<'a, 'text> {
    /// Returns the builder of a procedure whose arguments are visible.
    pub fn new(builder: &'a mut TheoryBuilder<'text>, procedure: usize) -> Self {
        Self { builder, procedure, scope: None }
    }

    pub fn build(mut self, body: &WrittenProgram) -> Result<(), GologError> {
        for variable in self.builder.variables.clone() {
            self.open_scope(&variable.name, variable.slot, variable.domain);
        }
        let key = stable_hash(0, self.builder.theory.procedures[self.procedure].name.as_bytes());
        self.builder.theory.procedures[self.procedure].body = self.program(body, key, false)?;
        Ok(())
    }

    fn open_scope(&mut self, name: &str, slot: usize, domain: usize) {
        let outer = self.scope;
        self.scope = Some(self.builder.theory.scopes.len());
        self.builder.theory.scopes.push(VariableScope { outer, name: name.into(), slot, domain });
    }

    /// Adds a node; `key` is that of its place.
    fn add(&mut self, step: ProgramStep, key: u64, range: TextRange) -> Result<usize, GologError> {
        if self.builder.theory.nodes.len() == MOST_NODES {
            return Err(self.builder.error(range, format!("expected at most {MOST_NODES} steps")));
        }
        let title = self.builder.text[range.start..range.end].lines().next().unwrap_or_default();
        let title: String = title.chars().take(60).collect();
        self.builder.theory.nodes.push(ProgramNode {
            step,
            line: self.builder.line(range),
            key,
            scope: self.scope,
            slots: self.builder.variables.len(),
            parts: 0,
            title: title.trim_end().into(),
        });
        Ok(self.builder.theory.nodes.len() - 1)
    }

    /// Adds a program; `key` is that of its place.
    ///
    /// A step and the steps from it to the end of the block are at one place: the key is that of the latter, and of a
    /// step that others follow another one. Then what is after a step can change.
    fn program(
        &mut self,
        written: &WrittenProgram,
        key: u64,
        is_followed: bool,
    ) -> Result<usize, GologError> {
        let step_key = stable_hash(key, b"step");
        let below = |place: &str| stable_hash(step_key, place.as_bytes());
        let step = match &written.kind {
            WrittenStep::Nil => ProgramStep::Nil,
            WrittenStep::Test(formula) => ProgramStep::Test(self.builder.truth(formula)?),
            WrittenStep::Call(name, arguments) => self.call(name, arguments)?,
            WrittenStep::Sequence(steps) => {
                return self.sequence(steps, if is_followed { step_key } else { key });
            }
            WrittenStep::Choice(branches) => {
                let nodes: Result<Vec<usize>, GologError> = branches
                    .iter()
                    .enumerate()
                    .map(|(number, branch)| self.program(branch, below(&format!("branch {number}")), false))
                    .collect();
                ProgramStep::Choice(nodes?.into())
            }
            WrittenStep::Pick(variable, body) => {
                let (slot, domain, body) = self.with_variable(variable, body, below("pick"))?;
                ProgramStep::Pick(slot, domain, body)
            }
            WrittenStep::For(variable, body) => {
                return self.each(variable, body, key, is_followed, written.range);
            }
            WrittenStep::Repeat(body) => ProgramStep::Repeat(self.program(body, below("repeat"), false)?),
            WrittenStep::If(condition, branches) => {
                let condition = self.builder.truth(condition)?;
                let then = self.program(&branches[0], below("then"), false)?;
                ProgramStep::If(condition, then, self.program(&branches[1], below("else"), false)?)
            }
            WrittenStep::While(condition, body) => {
                let condition = self.builder.truth(condition)?;
                ProgramStep::While(condition, self.program(body, below("while"), false)?)
            }
            WrittenStep::Concurrent(sides) => {
                let left = self.program(&sides[0], below("left"), false)?;
                ProgramStep::Concurrent(left, self.program(&sides[1], below("right"), false)?)
            }
            WrittenStep::Priority(sides) => {
                let high = self.program(&sides[0], below("high"), false)?;
                ProgramStep::Priority(high, self.program(&sides[1], below("low"), false)?)
            }
            WrittenStep::ParallelRepeat(body) => {
                ProgramStep::ParallelRepeat(self.program(body, below("parallel"), false)?)
            }
            WrittenStep::Interrupt(condition, body) => {
                let condition = self.builder.truth(condition)?;
                ProgramStep::Interrupt(condition, self.program(body, below("interrupt"), false)?)
            }
            WrittenStep::Search(body) => ProgramStep::Search(self.program(body, below("search"), false)?),
        };
        self.add(step, if is_followed { step_key } else { key }, written.range)
    }

    /// Returns a sequence; the key of each step has the text of the steps before.
    fn sequence(&mut self, steps: &[WrittenProgram], key: u64) -> Result<usize, GologError> {
        let mut keys = vec![key];
        for step in steps {
            let before = keys[keys.len() - 1];
            keys.push(stable_hash(
                before,
                plain(&self.builder.text[step.range.start..step.range.end]).as_bytes(),
            ));
        }
        let mut tail = None;
        for (step, own) in steps.iter().zip(&keys).rev() {
            let head = self.program(step, *own, tail.is_some())?;
            tail = Some(match tail {
                None => head,
                Some(tail) => self.add(ProgramStep::Sequence(head, tail), *own, step.range)?,
            });
        }
        match tail {
            Some(tail) => Ok(tail),
            None => self.add(ProgramStep::Nil, key, TextRange { start: 0, end: 0 }),
        }
    }

    fn with_variable(
        &mut self,
        variable: &WrittenVariable,
        body: &WrittenProgram,
        key: u64,
    ) -> Result<(usize, usize, usize), GologError> {
        let outer = self.scope;
        let (slot, domain) = self.builder.bind_one(variable)?;
        self.open_scope(&variable.name.text, slot, domain);
        let body = self.program(body, key, false)?;
        self.builder.variables.pop();
        self.scope = outer;
        Ok((slot, domain, body))
    }

    fn each(
        &mut self,
        variable: &WrittenVariable,
        body: &WrittenProgram,
        key: u64,
        is_followed: bool,
        range: TextRange,
    ) -> Result<usize, GologError> {
        let step_key = stable_hash(key, b"step");
        let outer = self.scope;
        let (slot, domain) = self.builder.bind_one(variable)?;
        self.open_scope(&variable.name.text, slot, domain);
        let body = self.program(body, stable_hash(step_key, b"for"), false)?;
        let round =
            self.add(ProgramStep::ForRound(slot, domain, body), stable_hash(step_key, b"round"), range)?;
        self.builder.variables.pop();
        self.scope = outer;
        self.add(ProgramStep::For(slot, domain, round), if is_followed { step_key } else { key }, range)
    }

    fn call(
        &mut self,
        name: &WrittenName,
        arguments: &[WrittenExpression],
    ) -> Result<ProgramStep, GologError> {
        match self.builder.names.get(&name.text).copied() {
            Some(NamedPart::Action(action)) => {
                if self.builder.theory.actions[action].is_exogenous {
                    let reason = format!(
                        "expected an action of the robot, found `{}`, an exogenous action",
                        name.text
                    );
                    return Err(self.builder.error(name.range, reason));
                }
                self.builder.theory.actions[action].is_used = true;
                let domains = self.builder.theory.actions[action].domains.clone();
                Ok(ProgramStep::Act(action, self.builder.arguments(name, arguments, &domains)?))
            }
            Some(NamedPart::Procedure(procedure)) => {
                let domains = self.builder.theory.procedures[procedure].domains.clone();
                let caller = self.procedure;
                self.builder.theory.procedures[caller].calls.push(procedure);
                Ok(ProgramStep::Call(procedure, self.builder.arguments(name, arguments, &domains)?))
            }
            _ => {
                let error = self.builder.unknown(name, "action or procedure", |part| {
                    matches!(part, NamedPart::Action(_) | NamedPart::Procedure(_))
                });
                let is_truth = matches!(
                    self.builder.names.get(&name.text),
                    Some(NamedPart::Fluent(_) | NamedPart::Defined(_) | NamedPart::Symbol(..))
                );
                Err(match is_truth {
                    true => error.with_help(Some(format!("`test {}` waits until it holds", name.text))),
                    false => error,
                })
            }
        }
    }
}

/// Returns a text without comments and with single spaces.
fn plain(text: &str) -> String {
    let lines = text.lines().map(|line| line.split('#').next().unwrap_or_default());
    lines.flat_map(str::split_whitespace).collect::<Vec<&str>>().join(" ")
}
