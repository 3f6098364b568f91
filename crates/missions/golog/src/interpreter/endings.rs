//! Programs that may end without a transition.

use super::remaining::Remaining;
use super::transition::{TransitionMode, TransitionReader};
use crate::error::GologRunError;
use crate::theory::formula::Bindings;
use crate::theory::program::ProgramStep;

impl TransitionReader<'_> {
    /// Returns true if a program may end without a transition.
    pub(super) fn ends(&mut self, program: u32, depth: usize) -> Result<bool, GologRunError> {
        self.count(depth, None)?;
        Ok(match self.programs.get(program) {
            Remaining::Nil => true,
            Remaining::Performing(_) => false,
            Remaining::Code(node, bindings) => {
                let bindings = self.programs.bindings(bindings);
                self.node_ends(node as usize, &bindings, depth + 1)?
            }
            Remaining::Then(first, second)
            | Remaining::Both(first, second)
            | Remaining::Priority(first, second) => {
                self.ends(first, depth + 1)? && self.ends(second, depth + 1)?
            }
            Remaining::Search(inner) => self.ends(inner, depth + 1)?,
            Remaining::Plan(step) => {
                let step = self.programs.plans[step as usize];
                let is_reached = match self.mode {
                    TransitionMode::Executed { situation, .. } => {
                        step.next.is_none() && situation == step.expected
                    }
                    TransitionMode::Planned => false,
                };
                is_reached || self.ends(step.program, depth + 1)?
            }
        })
    }

    pub(super) fn node_ends(
        &mut self,
        node: usize,
        bindings: &Bindings,
        depth: usize,
    ) -> Result<bool, GologRunError> {
        self.count(depth, Some(node))?;
        let inner = depth + 1;
        Ok(match &self.view.theory.nodes[node].step {
            ProgramStep::Nil | ProgramStep::Repeat(_) | ProgramStep::ParallelRepeat(_) => true,
            ProgramStep::Test(_) | ProgramStep::Act(..) => false,
            ProgramStep::Call(procedure, arguments) => {
                let body = self.view.theory.procedures[*procedure].body;
                match self.called(node, *procedure, arguments, bindings)? {
                    Some(own) => self.node_ends(body, &own, inner)?,
                    None => false,
                }
            }
            ProgramStep::Sequence(first, second)
            | ProgramStep::Concurrent(first, second)
            | ProgramStep::Priority(first, second) => {
                self.node_ends(*first, bindings, inner)? && self.node_ends(*second, bindings, inner)?
            }
            ProgramStep::Choice(branches) => {
                for branch in branches {
                    if self.node_ends(*branch, bindings, inner)? {
                        return Ok(true);
                    }
                }
                false
            }
            ProgramStep::Pick(slot, domain, body) => {
                let mut own = *bindings;
                let domain = &self.view.theory.domains[*domain];
                for value in domain.low..=domain.high {
                    own[*slot] = value;
                    if self.node_ends(*body, &own, inner)? {
                        return Ok(true);
                    }
                }
                false
            }
            ProgramStep::For(slot, domain, round) => {
                let mut own = *bindings;
                own[*slot] = self.view.theory.domains[*domain].low;
                self.node_ends(*round, &own, inner)?
            }
            ProgramStep::ForRound(slot, domain, body) => {
                let mut own = *bindings;
                for value in bindings[*slot]..=self.view.theory.domains[*domain].high {
                    own[*slot] = value;
                    if !self.node_ends(*body, &own, inner)? {
                        return Ok(false);
                    }
                }
                true
            }
            ProgramStep::If(condition, then, otherwise) => {
                match self.branch(node, condition, *then, *otherwise, bindings)? {
                    Some(branch) => self.node_ends(branch, bindings, inner)?,
                    None => false,
                }
            }
            ProgramStep::While(condition, body) => {
                let mut own = *bindings;
                let value = self.view.evaluate(condition, &mut own);
                value.map_err(|reason| self.refused(node, reason))? == 0
                    || self.node_ends(*body, bindings, inner)?
            }
            // It has nothing to do.
            ProgramStep::Interrupt(condition, _) => !self.holds(node, condition, bindings)?,
            ProgramStep::Search(body) => self.node_ends(*body, bindings, inner)?,
        })
    }
}
