//! Remaining programs, each stored once.

use std::collections::HashMap;

use super::ground_action::GroundAction;
use crate::theory::formula::{Bindings, MOST_VARIABLES};
use crate::theory::program::{ProgramNode, ProgramStep};

/// Empty remaining program.
pub(crate) const NIL: u32 = 0;
/// Number of remaining programs below which they are not collected.
const COLLECTION_THRESHOLD: usize = 4096;

/// Program that remains; others are given by their numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Remaining {
    Nil,
    /// Node of a procedure, under bindings.
    Code(u32, u32),
    Then(u32, u32),
    Both(u32, u32),
    Priority(u32, u32),
    Search(u32),
    /// Step of a plan that a search has found.
    Plan(u32),
    /// Action of the robot, by its slot.
    Performing(u32),
}

/// Step of a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PlannedStep {
    /// Program before the step.
    pub program: u32,
    /// Hash of the situation that the plan expects.
    pub expected: u64,
    /// Action of the step; `None` for a test.
    pub action: Option<GroundAction>,
    /// Step after it; `None` at the end, which has no action.
    pub next: Option<u32>,
}

/// Remaining programs, bindings and plans by numbers.
///
/// A program has a greater number than its parts.
#[derive(Clone, Debug)]
pub(crate) struct RemainingPrograms {
    programs: Vec<Remaining>,
    depths: Vec<u16>,
    index: HashMap<Remaining, u32>,
    bindings: Vec<Bindings>,
    binding_index: HashMap<Bindings, u32>,
    pub plans: Vec<PlannedStep>,
    /// Number of programs after the newest collection.
    live: usize,
}

impl RemainingPrograms {
    pub fn new() -> Self {
        let mut own = Self {
            programs: Vec::new(),
            depths: Vec::new(),
            index: HashMap::new(),
            bindings: Vec::new(),
            binding_index: HashMap::new(),
            plans: Vec::new(),
            live: 0,
        };
        own.add(Remaining::Nil);
        own
    }

    pub fn get(&self, program: u32) -> Remaining {
        self.programs[program as usize]
    }

    pub fn len(&self) -> usize {
        self.programs.len()
    }

    /// Returns the nesting depth of a program.
    pub fn depth(&self, program: u32) -> u16 {
        self.depths[program as usize]
    }

    pub fn bindings(&self, bindings: u32) -> Bindings {
        self.bindings[bindings as usize]
    }

    pub fn add(&mut self, program: Remaining) -> u32 {
        if let Some(known) = self.index.get(&program) {
            return *known;
        }
        // Collections keep the number far below.
        let number = self.programs.len() as u32;
        let depth = match program {
            Remaining::Then(first, second)
            | Remaining::Both(first, second)
            | Remaining::Priority(first, second) => {
                self.depth(first).max(self.depth(second)).saturating_add(1)
            }
            Remaining::Search(inner) => self.depth(inner).saturating_add(1),
            _ => 0,
        };
        self.programs.push(program);
        self.depths.push(depth);
        self.index.insert(program, number);
        number
    }

    /// Returns a node under bindings, of which it keeps the visible ones.
    pub fn code(&mut self, nodes: &[ProgramNode], node: usize, bindings: &Bindings) -> u32 {
        let ProgramNode { step, slots, .. } = &nodes[node];
        if matches!(step, ProgramStep::Nil) {
            return NIL;
        }
        let mut visible = [0; MOST_VARIABLES];
        visible[..*slots].copy_from_slice(&bindings[..*slots]);
        let bindings = match self.binding_index.get(&visible) {
            Some(known) => *known,
            None => {
                let number = self.bindings.len() as u32;
                self.bindings.push(visible);
                self.binding_index.insert(visible, number);
                number
            }
        };
        // A theory has few nodes.
        self.add(Remaining::Code(node as u32, bindings))
    }

    pub fn then(&mut self, first: u32, second: u32) -> u32 {
        match (first, second) {
            (NIL, other) | (other, NIL) => other,
            _ => self.add(Remaining::Then(first, second)),
        }
    }

    pub fn both(&mut self, first: u32, second: u32) -> u32 {
        match (first, second) {
            (NIL, other) | (other, NIL) => other,
            _ => self.add(Remaining::Both(first, second)),
        }
    }

    pub fn priority(&mut self, high: u32, low: u32) -> u32 {
        match (high, low) {
            (NIL, other) | (other, NIL) => other,
            _ => self.add(Remaining::Priority(high, low)),
        }
    }

    /// Returns true if a program performs an action of the robot now.
    pub fn is_performing(&self, program: u32) -> bool {
        match self.get(program) {
            Remaining::Performing(_) => true,
            Remaining::Then(first, _) => self.is_performing(first),
            Remaining::Both(first, second) | Remaining::Priority(first, second) => {
                self.is_performing(first) || self.is_performing(second)
            }
            _ => false,
        }
    }

    /// Returns the program after the action of a slot has ended.
    pub fn without(&mut self, program: u32, slot: u32) -> u32 {
        match self.get(program) {
            Remaining::Performing(own) if own == slot => NIL,
            Remaining::Then(first, second) => {
                let first = self.without(first, slot);
                self.then(first, second)
            }
            Remaining::Both(first, second) => {
                let (first, second) = (self.without(first, slot), self.without(second, slot));
                self.both(first, second)
            }
            Remaining::Priority(first, second) => {
                let (first, second) = (self.without(first, slot), self.without(second, slot));
                self.priority(first, second)
            }
            _ => program,
        }
    }

    /// Marks the slots of suspended actions.
    /// They wait because a program of higher priority performs one.
    pub fn mark_suspended(&self, program: u32, is_suspended: bool, slots: &mut [bool]) {
        match self.get(program) {
            Remaining::Performing(slot) => slots[slot as usize] = is_suspended,
            Remaining::Then(first, _) => self.mark_suspended(first, is_suspended, slots),
            Remaining::Both(first, second) => {
                self.mark_suspended(first, is_suspended, slots);
                self.mark_suspended(second, is_suspended, slots);
            }
            Remaining::Priority(high, low) => {
                self.mark_suspended(high, is_suspended, slots);
                self.mark_suspended(low, is_suspended || self.is_performing(high), slots);
            }
            _ => {}
        }
    }

    /// Returns the numbers of programs and their parts, and of the plans' steps.
    /// Each program comes after its parts.
    pub fn reachable(&self, roots: &[u32]) -> (Vec<u32>, Vec<u32>) {
        let mut is_seen = vec![false; self.programs.len()];
        let mut is_planned = vec![false; self.plans.len()];
        let mut open = roots.to_vec();
        while let Some(program) = open.pop() {
            if std::mem::replace(&mut is_seen[program as usize], true) {
                continue;
            }
            match self.get(program) {
                Remaining::Then(first, second)
                | Remaining::Both(first, second)
                | Remaining::Priority(first, second) => open.extend([first, second]),
                Remaining::Search(inner) => open.push(inner),
                Remaining::Plan(first) => {
                    let mut step = Some(first);
                    while let Some(own) = step
                        && !std::mem::replace(&mut is_planned[own as usize], true)
                    {
                        open.push(self.plans[own as usize].program);
                        step = self.plans[own as usize].next;
                    }
                }
                Remaining::Nil | Remaining::Code(..) | Remaining::Performing(_) => {}
            }
        }
        let numbers = |marks: &[bool]| (0..marks.len() as u32).filter(|at| marks[*at as usize]).collect();
        (numbers(&is_seen), numbers(&is_planned))
    }

    /// Garbage-collects programs that the roots do not reach.
    /// It does so once there are many; the roots get new numbers.
    pub fn collect<'a>(&mut self, nodes: &[ProgramNode], roots: impl Iterator<Item = &'a mut u32>) {
        if self.len() < COLLECTION_THRESHOLD || self.len() < 2 * self.live {
            return;
        }
        let roots: Vec<&mut u32> = roots.collect();
        let old = std::mem::replace(self, Self::new());
        let numbers: Vec<u32> = roots.iter().map(|root| **root).collect();
        let (programs, plans) = old.reachable(&numbers);
        let mut moved = vec![NIL; old.len()];
        let mut moved_plans = vec![0; old.plans.len()];
        for (number, step) in plans.iter().enumerate() {
            moved_plans[*step as usize] = number as u32;
        }
        for program in programs {
            let at = |own: u32| moved[own as usize];
            moved[program as usize] = match old.get(program) {
                Remaining::Code(node, bindings) => self.code(nodes, node as usize, &old.bindings(bindings)),
                Remaining::Then(first, second) => self.add(Remaining::Then(at(first), at(second))),
                Remaining::Both(first, second) => self.add(Remaining::Both(at(first), at(second))),
                Remaining::Priority(high, low) => self.add(Remaining::Priority(at(high), at(low))),
                Remaining::Search(inner) => self.add(Remaining::Search(at(inner))),
                Remaining::Plan(step) => self.add(Remaining::Plan(moved_plans[step as usize])),
                own @ (Remaining::Nil | Remaining::Performing(_)) => self.add(own),
            };
        }
        for step in plans {
            let PlannedStep { program, next, .. } = old.plans[step as usize];
            let next = next.map(|next| moved_plans[next as usize]);
            self.plans.push(PlannedStep {
                program: moved[program as usize],
                next,
                ..old.plans[step as usize]
            });
        }
        for root in roots {
            *root = moved[*root as usize];
        }
        self.live = self.len();
    }
}
