//! Transitions and final programs of ConGolog.
//! De Giacomo, Lespérance and Levesque, ConGolog, 2000, sections 4 and 5.

use super::ground_action::GroundAction;
use super::remaining::{NIL, Remaining, RemainingPrograms};
use crate::error::GologRunError;
use crate::theory::MOST_ARGUMENTS;
use crate::theory::formula::{Bindings, GologFormula, MOST_VARIABLES, SituationView};
use crate::theory::program::{ProgramNode, ProgramStep};

/// Deepest nesting of programs within a transition.
const DEPTH: usize = 400;
/// Maximum number of parts of programs and formulas that a transition may consider.
const MOST_PARTS: u64 = 200_000;

/// Transition of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ProgramTransition {
    /// `None` for a test.
    pub action: Option<GroundAction>,
    /// Program after it; for a search that is needed, the one to search.
    pub program: u32,
    pub needs_search: bool,
}

/// Kind of transitions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TransitionMode<'a> {
    /// All transitions, in the order of the text; actions end at once.
    Planned,
    /// First transition; an action of the robot begins in a slot.
    Executed {
        slot: u32,
        /// Hash of the situation.
        situation: u64,
        /// Programs whose search has found no plan in this situation.
        hopeless: &'a [u32],
        /// Searched program and its plan.
        found: Option<(u32, u32)>,
    },
}

/// Reader of transitions: a theory in a situation, and the programs.
pub(crate) struct TransitionReader<'a> {
    pub view: SituationView<'a>,
    pub programs: &'a mut RemainingPrograms,
    pub mode: TransitionMode<'a>,
    parts: u64,
}

impl<'a> TransitionReader<'a> {
    pub fn new(
        view: SituationView<'a>,
        programs: &'a mut RemainingPrograms,
        mode: TransitionMode<'a>,
    ) -> Self {
        Self { view, programs, mode, parts: 0 }
    }

    /// Adds the transitions of a program.
    pub fn transitions(
        &mut self,
        program: u32,
        found: &mut Vec<ProgramTransition>,
    ) -> Result<(), GologRunError> {
        self.parts = 0;
        self.of_program(program, 0, found)
    }

    /// Returns true if a program may end.
    pub fn is_final(&mut self, program: u32) -> Result<bool, GologRunError> {
        self.parts = 0;
        self.ends(program, 0)
    }

    fn is_enough(&self, from: usize, found: &[ProgramTransition]) -> bool {
        self.mode != TransitionMode::Planned && found.len() > from
    }

    pub(super) fn count(&mut self, depth: usize, node: Option<usize>) -> Result<(), GologRunError> {
        let (line, parts) = match node {
            Some(node) => (self.view.theory.nodes[node].line, self.view.theory.nodes[node].parts),
            None => (0, 0),
        };
        self.parts = self.parts.saturating_add(parts + 1);
        if depth > DEPTH {
            let reason = format!("programs nest deeper than {DEPTH}: check the recursion of procedures");
            return Err(GologRunError { line, reason });
        }
        match self.parts > MOST_PARTS {
            true => Err(GologRunError {
                line,
                reason: format!(
                    "a step considers more than {MOST_PARTS} alternatives: use smaller domains or fewer variables"
                ),
            }),
            false => Ok(()),
        }
    }

    fn of_program(
        &mut self,
        program: u32,
        depth: usize,
        found: &mut Vec<ProgramTransition>,
    ) -> Result<(), GologRunError> {
        self.count(depth, None)?;
        let from = found.len();
        match self.programs.get(program) {
            Remaining::Nil | Remaining::Performing(_) => {}
            Remaining::Code(node, bindings) => {
                let bindings = self.programs.bindings(bindings);
                self.of_node(node as usize, &bindings, depth + 1, found)?;
            }
            Remaining::Then(first, second) => {
                self.of_program(first, depth + 1, found)?;
                self.wrap(from, found, |programs, inner| programs.then(inner, second));
                if !self.is_enough(from, found) && self.ends(first, depth + 1)? {
                    self.of_program(second, depth + 1, found)?;
                }
            }
            Remaining::Both(first, second) => {
                self.of_program(first, depth + 1, found)?;
                self.wrap(from, found, |programs, inner| programs.both(inner, second));
                if !self.is_enough(from, found) {
                    let from = found.len();
                    self.of_program(second, depth + 1, found)?;
                    self.wrap(from, found, |programs, inner| programs.both(first, inner));
                }
            }
            Remaining::Priority(high, low) => {
                self.of_program(high, depth + 1, found)?;
                self.wrap(from, found, |programs, inner| programs.priority(inner, low));
                if found.len() == from && !self.programs.is_performing(high) {
                    self.of_program(low, depth + 1, found)?;
                    self.wrap(from, found, |programs, inner| programs.priority(high, inner));
                }
            }
            Remaining::Search(inner) => self.search(inner, depth, found)?,
            Remaining::Plan(step) => self.plan(step, depth, found)?,
        }
        Ok(())
    }

    /// Embeds the remaining programs of transitions in their context.
    /// It begins at the given transition; a program to search stays unchanged.
    fn wrap(
        &mut self,
        from: usize,
        found: &mut [ProgramTransition],
        mut place: impl FnMut(&mut RemainingPrograms, u32) -> u32,
    ) {
        for transition in found[from..].iter_mut().filter(|transition| !transition.needs_search) {
            transition.program = place(self.programs, transition.program);
        }
    }

    /// Returns a transition of a searched program.
    /// It is the first of its plan, or the search itself.
    fn search(
        &mut self,
        inner: u32,
        depth: usize,
        found: &mut Vec<ProgramTransition>,
    ) -> Result<(), GologRunError> {
        match self.mode {
            // A plan within a plan is a part of it.
            TransitionMode::Planned => self.of_program(inner, depth + 1, found),
            TransitionMode::Executed { found: Some((searched, plan)), .. } if searched == inner => {
                self.plan(plan, depth + 1, found)
            }
            TransitionMode::Executed { hopeless, .. } => {
                if !hopeless.contains(&inner) {
                    found.push(ProgramTransition { action: None, program: inner, needs_search: true });
                }
                Ok(())
            }
        }
    }

    fn plan(
        &mut self,
        step: u32,
        depth: usize,
        found: &mut Vec<ProgramTransition>,
    ) -> Result<(), GologRunError> {
        self.count(depth, None)?;
        let step = self.programs.plans[step as usize];
        let TransitionMode::Executed { situation, slot, .. } = self.mode else {
            return self.of_program(step.program, depth + 1, found);
        };
        if situation != step.expected {
            // Another event has changed the situation.
            return match self.ends(step.program, depth + 1)? {
                true => Ok(()),
                false => self.search(step.program, depth + 1, found),
            };
        }
        let Some(next) = step.next else { return Ok(()) };
        let rest = self.programs.add(Remaining::Plan(next));
        let begun = match step.action {
            Some(action) => self.begun(action.action as usize, slot),
            None => NIL,
        };
        let program = self.programs.then(begun, rest);
        found.push(ProgramTransition { action: step.action, program, needs_search: false });
        Ok(())
    }

    /// Returns the program right after the start of an action.
    fn begun(&mut self, action: usize, slot: u32) -> u32 {
        match self.view.theory.actions[action].performs {
            Some(_) => self.programs.add(Remaining::Performing(slot)),
            None => NIL,
        }
    }

    fn of_node(
        &mut self,
        node: usize,
        bindings: &Bindings,
        depth: usize,
        found: &mut Vec<ProgramTransition>,
    ) -> Result<(), GologRunError> {
        self.count(depth, Some(node))?;
        let nodes: &'a [ProgramNode] = &self.view.theory.nodes;
        let from = found.len();
        let inner = depth + 1;
        match &nodes[node].step {
            ProgramStep::Nil => {}
            ProgramStep::Test(formula) => {
                if self.holds(node, formula, bindings)? {
                    found.push(ProgramTransition { action: None, program: NIL, needs_search: false });
                }
            }
            ProgramStep::Act(action, arguments) => self.act(node, *action, arguments, bindings, found)?,
            ProgramStep::Call(procedure, arguments) => {
                let body = self.view.theory.procedures[*procedure].body;
                if let Some(own) = self.called(node, *procedure, arguments, bindings)? {
                    self.of_node(body, &own, inner, found)?;
                }
            }
            ProgramStep::Sequence(head, tail) => self.sequence(*head, *tail, bindings, inner, found)?,
            ProgramStep::Choice(branches) => {
                for branch in branches {
                    if self.is_enough(from, found) {
                        break;
                    }
                    self.of_node(*branch, bindings, inner, found)?;
                }
            }
            ProgramStep::Pick(slot, domain, body) => {
                self.pick((*slot, *domain, *body), bindings, inner, found)?;
            }
            ProgramStep::For(slot, domain, round) => {
                let mut own = *bindings;
                own[*slot] = self.view.theory.domains[*domain].low;
                self.of_node(*round, &own, inner, found)?;
            }
            ProgramStep::ForRound(slot, domain, body) => {
                self.round(node, (*slot, *domain, *body), bindings, inner, found)?;
            }
            ProgramStep::If(condition, then, otherwise) => {
                if let Some(branch) = self.branch(node, condition, *then, *otherwise, bindings)? {
                    self.of_node(branch, bindings, inner, found)?;
                }
            }
            ProgramStep::Repeat(body) => self.again(node, *body, bindings, inner, found)?,
            ProgramStep::While(condition, body) | ProgramStep::Interrupt(condition, body) => {
                if self.holds(node, condition, bindings)? {
                    self.again(node, *body, bindings, inner, found)?;
                }
            }
            ProgramStep::ParallelRepeat(body) => {
                self.of_node(*body, bindings, inner, found)?;
                if found.len() > from {
                    let rest = self.programs.code(nodes, node, bindings);
                    self.wrap(from, found, |programs, own| programs.both(own, rest));
                }
            }
            ProgramStep::Concurrent(..) | ProgramStep::Priority(..) | ProgramStep::Search(_) => {
                let program = self.opened(node, bindings);
                self.of_program(program, inner, found)?;
            }
        }
        Ok(())
    }

    fn sequence(
        &mut self,
        head: usize,
        tail: usize,
        bindings: &Bindings,
        depth: usize,
        found: &mut Vec<ProgramTransition>,
    ) -> Result<(), GologRunError> {
        let from = found.len();
        self.of_node(head, bindings, depth, found)?;
        if found.len() > from {
            let rest = self.programs.code(&self.view.theory.nodes, tail, bindings);
            self.wrap(from, found, |programs, own| programs.then(own, rest));
        }
        if !self.is_enough(from, found) && self.node_ends(head, bindings, depth)? {
            self.of_node(tail, bindings, depth, found)?;
        }
        Ok(())
    }

    /// Transitions of a body for each value of a variable.
    fn pick(
        &mut self,
        (slot, domain, body): (usize, usize, usize),
        bindings: &Bindings,
        depth: usize,
        found: &mut Vec<ProgramTransition>,
    ) -> Result<(), GologRunError> {
        let from = found.len();
        let mut own = *bindings;
        let domain = &self.view.theory.domains[domain];
        for value in domain.low..=domain.high {
            own[slot] = value;
            self.of_node(body, &own, depth, found)?;
            if self.is_enough(from, found) {
                break;
            }
        }
        Ok(())
    }

    /// Returns a node of concurrency or search as a program with parts.
    fn opened(&mut self, node: usize, bindings: &Bindings) -> u32 {
        let nodes: &'a [ProgramNode] = &self.view.theory.nodes;
        let programs = &mut *self.programs;
        match &nodes[node].step {
            ProgramStep::Concurrent(first, second) => {
                let (first, second) =
                    (programs.code(nodes, *first, bindings), programs.code(nodes, *second, bindings));
                programs.both(first, second)
            }
            ProgramStep::Priority(high, low) => {
                let (high, low) =
                    (programs.code(nodes, *high, bindings), programs.code(nodes, *low, bindings));
                programs.priority(high, low)
            }
            ProgramStep::Search(body) => {
                let body = programs.code(nodes, *body, bindings);
                programs.add(Remaining::Search(body))
            }
            _ => programs.code(nodes, node, bindings),
        }
    }

    /// Returns the transitions of a body that is followed by the node again.
    fn again(
        &mut self,
        node: usize,
        body: usize,
        bindings: &Bindings,
        depth: usize,
        found: &mut Vec<ProgramTransition>,
    ) -> Result<(), GologRunError> {
        let from = found.len();
        self.of_node(body, bindings, depth, found)?;
        if found.len() > from {
            let rest = self.programs.code(&self.view.theory.nodes, node, bindings);
            self.wrap(from, found, |programs, own| programs.then(own, rest));
        }
        Ok(())
    }

    /// Transitions of a loop whose variable has the value of this round.
    fn round(
        &mut self,
        node: usize,
        (slot, domain, body): (usize, usize, usize),
        bindings: &Bindings,
        depth: usize,
        found: &mut Vec<ProgramTransition>,
    ) -> Result<(), GologRunError> {
        let from = found.len();
        self.of_node(body, bindings, depth, found)?;
        let mut next = *bindings;
        next[slot] += 1;
        let has_next = bindings[slot] < self.view.theory.domains[domain].high;
        if found.len() > from && has_next {
            let rest = self.programs.code(&self.view.theory.nodes, node, &next);
            self.wrap(from, found, |programs, own| programs.then(own, rest));
        }
        if has_next && !self.is_enough(from, found) && self.node_ends(body, bindings, depth)? {
            self.of_node(node, &next, depth, found)?;
        }
        Ok(())
    }

    fn act(
        &mut self,
        node: usize,
        action: usize,
        arguments: &[GologFormula],
        bindings: &Bindings,
        found: &mut Vec<ProgramTransition>,
    ) -> Result<(), GologRunError> {
        let model = &self.view.theory.actions[action];
        let mut own = *bindings;
        let values = self.view.arguments(&model.domains, &model.name, arguments, &mut own);
        let Some(values) = values.map_err(|reason| self.refused(node, reason))? else { return Ok(()) };
        if let Some(possible) = &model.possible
            && !self.holds(node, possible, &values)?
        {
            return Ok(());
        }
        let program = match self.mode {
            TransitionMode::Planned => NIL,
            TransitionMode::Executed { slot, .. } => self.begun(action, slot),
        };
        let mut arguments = [0; MOST_ARGUMENTS];
        arguments.copy_from_slice(&values[..MOST_ARGUMENTS]);
        // A theory has few actions.
        let action = Some(GroundAction { action: action as u32, arguments });
        found.push(ProgramTransition { action, program, needs_search: false });
        Ok(())
    }

    pub(super) fn called(
        &self,
        node: usize,
        procedure: usize,
        arguments: &[GologFormula],
        bindings: &Bindings,
    ) -> Result<Option<[i32; MOST_VARIABLES]>, GologRunError> {
        let model = &self.view.theory.procedures[procedure];
        let mut own = *bindings;
        let values = self.view.arguments(&model.domains, &model.name, arguments, &mut own);
        values.map_err(|reason| self.refused(node, reason))
    }

    pub(super) fn branch(
        &self,
        node: usize,
        condition: &GologFormula,
        then: usize,
        otherwise: usize,
        bindings: &Bindings,
    ) -> Result<Option<usize>, GologRunError> {
        let mut own = *bindings;
        let value = self.view.evaluate(condition, &mut own).map_err(|reason| self.refused(node, reason))?;
        Ok(match value {
            1 => Some(then),
            0 => Some(otherwise),
            _ => None,
        })
    }

    pub(super) fn holds(
        &self,
        node: usize,
        formula: &GologFormula,
        bindings: &Bindings,
    ) -> Result<bool, GologRunError> {
        self.view.holds(formula, bindings).map_err(|reason| self.refused(node, reason))
    }

    pub(super) fn refused(&self, node: usize, reason: String) -> GologRunError {
        let ProgramNode { line, title, .. } = &self.view.theory.nodes[node];
        GologRunError { line: *line, reason: format!("`{title}`: {reason}") }
    }
}
