//! Online execution of a program (De Giacomo et al., IndiGolog, 2009).

mod observation;
mod rows;
mod state;
mod step;
mod trace;

use std::sync::Arc;

use observation::{ObservedAction, ObservedNames};
pub use rows::RemainingRow;
use rows::RowWriter;
pub use state::GologState;
use trace::ActionTrace;
pub use trace::{MOST_TRACED, TracedEvent};

use crate::error::GologRunError;
use crate::interpreter::*;
use crate::theory::formula::{MOST_VARIABLES, SituationView, UNKNOWN};
use crate::theory::{ActionModel, ActionTheory, MOST_ARGUMENTS, RobotArgument};

/// Maximum number of actions of the robot at a time.
pub const MOST_ACTIONS: usize = 16;

/// Progress of an action of the robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GologProgress {
    /// It runs.
    Running,
    /// It has succeeded; its sensed fluent is true.
    Succeeded,
    /// It has failed; its sensed fluent is false.
    Failed,
}

/// Outcome of a program.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum GologOutcome {
    /// The program continues.
    #[default]
    Running,
    /// The program has ended.
    Succeeded,
    /// Failure: no transition is possible, and none can become possible.
    Failed,
}

/// Action of the robot that begins.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotAction<'a> {
    /// Name of the robot's action, such as `GoToOrigin`.
    pub name: &'a str,
    /// Arguments of the action.
    pub arguments: Vec<f64>,
    /// Action of the theory, such as `go_to(desk)`.
    pub text: String,
}

/// Performer of actions.
///
/// Each action that runs has a slot; the slot of an action that has ended is used again.
pub trait GologHost {
    /// Starts an action, or starts it again after it was stopped.
    ///
    /// # Errors
    /// Why it can't be performed: the mission ends.
    fn start(&mut self, slot: usize, action: &RobotAction<'_>) -> Result<(), String>;
    /// Returns how far an action has come.
    fn progress(&mut self, slot: usize) -> GologProgress;
    /// Stops an action, which may be started again.
    fn stop(&mut self, slot: usize);
}

/// Limits of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SearchLimits {
    /// Maximum number of transitions in a tick.
    /// The search continues with the next one.
    pub transitions_per_tick: u64,
    /// Maximum number of transitions of a search, after which the mission ends.
    pub most_transitions: u64,
}

impl Default for SearchLimits {
    fn default() -> Self {
        Self { transitions_per_tick: 500, most_transitions: 200_000 }
    }
}

/// Phase of an action that the program performs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
enum PerformancePhase {
    /// New action, which the host must start.
    New,
    Running,
    /// Suspended: a program of higher priority performs an action.
    Suspended,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Performance {
    action: GroundAction,
    phase: PerformancePhase,
}

/// Search in progress.
#[derive(Debug)]
struct RunningSearch {
    program: u32,
    search: DepthFirstSearch,
}

/// Execution of a theory's main program, tick by tick.
#[derive(Debug)]
pub struct GologExecutor {
    theory: Arc<ActionTheory>,
    limits: SearchLimits,
    programs: RemainingPrograms,
    program: u32,
    situation: SituationStore,
    /// Hash of the situation.
    hash: u64,
    performances: Vec<Option<Performance>>,
    search: Option<RunningSearch>,
    /// Programs whose search has found no plan in this situation.
    hopeless: Vec<u32>,
    observed: ObservedNames,
    outcome: GologOutcome,
    /// True if no transition is possible until a change.
    is_blocked: bool,
    steps: u64,
    /// Number of changes that a report shows.
    changes: u64,
    trace: ActionTrace,
    /// Transitions of the newest step, a buffer without allocations.
    found: Vec<ProgramTransition>,
    suspended: Vec<bool>,
}

impl GologExecutor {
    /// Returns an executor of the main program in the initial situation.
    pub fn new(theory: Arc<ActionTheory>, limits: SearchLimits) -> Self {
        let mut programs = RemainingPrograms::new();
        let body = theory.procedures[theory.main].body;
        let program = programs.code(&theory.nodes, body, &[0; MOST_VARIABLES]);
        let situation = SituationStore::new(theory.initial.clone());
        Self {
            observed: ObservedNames::new(&theory),
            theory,
            limits,
            programs,
            program,
            hash: situation.hash(),
            situation,
            performances: Vec::new(),
            search: None,
            hopeless: Vec::new(),
            outcome: GologOutcome::Running,
            is_blocked: false,
            steps: 0,
            changes: 0,
            trace: ActionTrace::default(),
            found: Vec::new(),
            suspended: Vec::new(),
        }
    }

    /// Returns the theory.
    pub fn theory(&self) -> &Arc<ActionTheory> {
        &self.theory
    }

    /// Returns the outcome.
    pub fn outcome(&self) -> GologOutcome {
        self.outcome
    }

    /// Returns the number of transitions so far.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Returns true if a search continues with the next tick.
    pub fn is_searching(&self) -> bool {
        self.search.is_some()
    }

    /// Returns the value of a fluent such as `at` or `visited(desk)`.
    /// `None` if it is unknown or does not exist.
    pub fn fluent(&self, name: &str) -> Option<String> {
        let theory = &*self.theory;
        theory.fluents.iter().find_map(|fluent| {
            let arguments = theory.parse_call(name, &fluent.name, &fluent.domains)?;
            let value = self.situation.cells[theory.cell_of(fluent, &arguments)?];
            (value != UNKNOWN).then(|| theory.domains[fluent.value].text(value))
        })
    }

    /// Returns the running actions by slot, and whether each is suspended.
    /// A suspended one waits for an action of higher priority.
    pub fn running(&self) -> impl Iterator<Item = (usize, String, bool)> {
        let performances = self.performances.iter().enumerate();
        performances.filter_map(|(slot, own)| {
            let Performance { action, phase } = own.as_ref()?;
            Some((slot, action.text(&self.theory), *phase == PerformancePhase::Suspended))
        })
    }

    /// Returns the newest actions with their events, oldest first.
    pub fn trace(&self) -> impl Iterator<Item = (String, TracedEvent)> {
        self.trace.entries().map(|(action, event)| (action.text(&self.theory), event))
    }

    /// Returns the number of events of actions so far.
    /// [`trace`](Self::trace) has the newest of them.
    pub fn traced(&self) -> u64 {
        self.trace.count
    }

    /// Returns the program that remains, row by row.
    pub fn remaining(&self) -> Vec<RemainingRow> {
        let mut writer = RowWriter { executor: self, rows: Vec::new() };
        writer.write(self.program, 0);
        writer.rows
    }

    /// Iterates over the slots' phases.
    /// 0: free; 1: its action runs; 2: its action waits.
    pub fn phases(&self) -> impl Iterator<Item = u64> {
        self.performances.iter().map(|own| match own {
            None => 0,
            Some(Performance { phase: PerformancePhase::Suspended, .. }) => 2,
            Some(_) => 1,
        })
    }

    /// Returns a hash of the fluents' values.
    pub fn situation_hash(&self) -> u64 {
        self.hash
    }

    /// Returns a change counter of actions, fluents and waiting.
    /// It differs once other actions run, fluents have changed, or the program waits.
    pub fn changes(&self) -> u64 {
        self.changes
    }

    /// Returns true if it waits for a condition's change or an action's end.
    pub fn is_blocked(&self) -> bool {
        self.is_blocked
    }

    /// Returns the robot's action of an action of the theory, which performs one.
    fn robot_action(&self, action: &GroundAction) -> Result<RobotAction<'_>, GologRunError> {
        let theory = &*self.theory;
        let model: &ActionModel = &theory.actions[action.action as usize];
        let Some((name, arguments)) = &model.performs else {
            return Ok(RobotAction { name: &model.name, arguments: Vec::new(), text: action.text(theory) });
        };
        let view = SituationView { theory, cells: &self.situation.cells };
        let mut bindings = [0; MOST_VARIABLES];
        bindings[..action.arguments.len()].copy_from_slice(&action.arguments);
        let refused = |reason| GologRunError { line: model.line, reason };
        let mut numbers = Vec::with_capacity(arguments.len());
        for argument in arguments {
            numbers.push(match argument {
                RobotArgument::Number(number) => *number,
                RobotArgument::Table(table, keys) => {
                    let table = &theory.tables[*table];
                    let own = view.arguments(&table.domains, &table.name, keys, &mut bindings.clone());
                    let own = own.map_err(refused)?;
                    own.and_then(|keys| theory.entry(table, &keys))
                        .ok_or_else(|| refused(format!("expected known arguments of `{}`", table.name)))?
                }
                RobotArgument::Formula(formula) => {
                    let value = view.evaluate(formula, &mut bindings.clone()).map_err(refused)?;
                    if value == UNKNOWN {
                        return Err(refused(format!(
                            "expected known arguments of the robot's action `{name}`"
                        )));
                    }
                    f64::from(value)
                }
            });
        }
        Ok(RobotAction { name, arguments: numbers, text: action.text(theory) })
    }

    /// Reads the conditions of the robot.
    /// `condition` returns whether one holds, `None` while it is unknown.
    ///
    /// An exogenous action occurs each time the condition of its name, such as `button` or `closes(door)`, begins to
    /// hold.
    ///
    /// # Errors
    /// If the effects of an exogenous action can't be computed.
    pub fn observe(&mut self, mut condition: impl FnMut(&str) -> Option<bool>) -> Result<(), GologRunError> {
        let mut has_changed = false;
        for (name, cell) in &self.observed.conditions {
            if let Some(holds) = condition(name) {
                has_changed |= self.situation.set(*cell, i32::from(holds));
            }
        }
        if has_changed {
            self.change();
        }
        for number in 0..self.observed.actions.len() {
            let ObservedAction { name, holds, .. } = &mut self.observed.actions[number];
            let before = *holds;
            *holds = condition(name).unwrap_or(before);
            if *holds && !before {
                self.occur_number(number)?;
            }
        }
        Ok(())
    }

    /// Reports an exogenous action such as `closes(door)`.
    /// Returns true if the action is possible.
    ///
    /// # Errors
    /// If its effects can't be computed.
    pub fn occur(&mut self, name: &str) -> Result<bool, GologRunError> {
        match self.observed.actions.iter().position(|own| own.name == name) {
            Some(number) => self.occur_number(number),
            None => Ok(false),
        }
    }

    fn occur_number(&mut self, number: usize) -> Result<bool, GologRunError> {
        let action = self.observed.actions[number].action;
        let model = &self.theory.actions[action.action as usize];
        let mut bindings = [0; MOST_VARIABLES];
        bindings[..MOST_ARGUMENTS].copy_from_slice(&action.arguments);
        let view = SituationView { theory: &self.theory, cells: &self.situation.cells };
        let is_possible = match &model.possible {
            Some(possible) => view
                .holds(possible, &bindings)
                .map_err(|reason| GologRunError { line: model.line, reason })?,
            None => true,
        };
        if is_possible {
            self.situation.apply(&self.theory, &action, EffectKind::Ended(None))?;
            self.trace.add(action, TracedEvent::Occurred);
            self.change();
        }
        Ok(is_possible)
    }

    /// Returns the names of conditions that are unknown.
    pub fn unknown_conditions(&self) -> impl Iterator<Item = &str> {
        let conditions = self.observed.conditions.iter();
        let unknown = conditions.filter(|(_, cell)| self.situation.cells[*cell] == UNKNOWN);
        unknown.map(|(name, _)| name.as_str())
    }

    /// Notes that the situation is another one.
    fn change(&mut self) {
        self.changes += 1;
        self.situation.commit();
        self.hash = self.situation.hash();
        self.is_blocked = false;
        self.search = None;
        self.hopeless.clear();
    }
}
