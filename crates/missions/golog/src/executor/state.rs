//! Saved states of executions.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use slate_sorted::SortedMap;

use super::*;
use crate::error::GologStateError;
use crate::theory::VariableScope;
use crate::theory::formula::{Bindings, UNKNOWN};

/// Saved remaining program.
/// Parts are given by their indices in the list, which are smaller.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum SavedProgram {
    Nil,
    /// Key of the node, its line and text, and the values of variables.
    Code(u64, usize, String, Vec<(String, String)>),
    Then(u32, u32),
    Both(u32, u32),
    Priority(u32, u32),
    Search(u32),
    Plan(u32),
    Performing(u32),
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct SavedPlanStep {
    program: u32,
    expected: u64,
    action: Option<String>,
    next: Option<u32>,
}

/// State of an execution by names, for snapshots and changed theories.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct GologState {
    /// Values of fluents; `None` for one that is unknown.
    fluents: Vec<(String, Option<String>)>,
    programs: Vec<SavedProgram>,
    plans: Vec<SavedPlanStep>,
    /// Place of the program in the list.
    program: u32,
    /// Actions by their slots.
    performances: Vec<Option<(String, PerformancePhase)>>,
    /// Place of the program that is searched, and the transitions so far.
    search: Option<(u32, u64)>,
    hopeless: Vec<u32>,
    /// Exogenous actions whose conditions hold.
    occurred: Vec<String>,
    outcome: GologOutcome,
    is_blocked: bool,
    steps: u64,
    /// Newest actions, and the number of all.
    trace: Vec<(String, TracedEvent)>,
    traced: u64,
}

/// Order of programs in a state: each after its parts, the same for equal programs.
#[derive(Debug, Default)]
struct SavedOrder {
    programs: Vec<u32>,
    plans: Vec<u32>,
    /// Place of each program in the list.
    places: SortedMap<u32, u32>,
    plan_places: SortedMap<u32, u32>,
}

impl SavedOrder {
    fn add(&mut self, all: &RemainingPrograms, program: u32) {
        if self.places.contains_key(&program) {
            return;
        }
        match all.get(program) {
            Remaining::Then(first, second)
            | Remaining::Both(first, second)
            | Remaining::Priority(first, second) => {
                self.add(all, first);
                self.add(all, second);
            }
            Remaining::Search(inner) => self.add(all, inner),
            Remaining::Plan(first) => {
                let steps: Vec<u32> =
                    std::iter::successors(Some(first), |step| all.plans[*step as usize].next).collect();
                for step in steps.into_iter().rev() {
                    if self.plan_places.contains_key(&step) {
                        continue;
                    }
                    self.add(all, all.plans[step as usize].program);
                    // Plans are at most as long as a search.
                    self.plan_places.insert(step, self.plans.len() as u32);
                    self.plans.push(step);
                }
            }
            Remaining::Nil | Remaining::Code(..) | Remaining::Performing(_) => {}
        }
        self.places.insert(program, self.programs.len() as u32);
        self.programs.push(program);
    }
}

impl GologExecutor {
    /// Returns the state.
    pub fn state(&self) -> GologState {
        let mut roots = vec![self.program];
        roots.extend(self.search.iter().map(|search| search.program));
        roots.extend(&self.hopeless);
        let mut order = SavedOrder::default();
        roots.iter().for_each(|root| order.add(&self.programs, *root));
        let SavedOrder { programs, plans, places, plan_places } = order;
        let plan_step = |step: &u32| {
            let PlannedStep { program, expected, action, next } = self.programs.plans[*step as usize];
            let action = action.map(|action| action.text(&self.theory));
            SavedPlanStep {
                program: places[&program],
                expected,
                action,
                next: next.map(|next| plan_places[&next]),
            }
        };
        let performance = |own: &Option<Performance>| {
            own.as_ref().map(|Performance { action, phase }| (action.text(&self.theory), *phase))
        };
        let occurred = self.observed.actions.iter().filter(|action| action.holds);
        GologState {
            fluents: self.saved_fluents(),
            programs: programs.iter().map(|own| self.saved_program(*own, &places, &plan_places)).collect(),
            plans: plans.iter().map(plan_step).collect(),
            program: places[&self.program],
            performances: self.performances.iter().map(performance).collect(),
            search: self.search.as_ref().map(|own| (places[&own.program], own.search.transitions)),
            hopeless: self.hopeless.iter().map(|own| places[own]).collect(),
            occurred: occurred.map(|action| action.name.clone()).collect(),
            outcome: self.outcome,
            is_blocked: self.is_blocked,
            steps: self.steps,
            trace: self.trace().collect(),
            traced: self.trace.count,
        }
    }

    fn saved_fluents(&self) -> Vec<(String, Option<String>)> {
        let theory = &*self.theory;
        let cells =
            theory.fluents.iter().flat_map(|fluent| (0..fluent.count).map(move |cell| (fluent, cell)));
        cells
            .map(|(fluent, cell)| {
                let value = self.situation.cells[fluent.base + cell];
                let text = (value != UNKNOWN).then(|| theory.domains[fluent.value].text(value));
                (theory.cell_name(fluent, cell), text)
            })
            .collect()
    }

    fn saved_program(
        &self,
        program: u32,
        places: &SortedMap<u32, u32>,
        plans: &SortedMap<u32, u32>,
    ) -> SavedProgram {
        match self.programs.get(program) {
            Remaining::Nil => SavedProgram::Nil,
            Remaining::Code(node, bindings) => {
                let bindings = self.programs.bindings(bindings);
                let node = &self.theory.nodes[node as usize];
                let variables = visible(&self.theory, node.scope).into_iter().map(|scope| {
                    let value = bindings[scope.slot];
                    (scope.name.clone(), self.theory.domains[scope.domain].text(value))
                });
                SavedProgram::Code(node.key, node.line, node.title.clone(), variables.collect())
            }
            Remaining::Then(first, second) => SavedProgram::Then(places[&first], places[&second]),
            Remaining::Both(first, second) => SavedProgram::Both(places[&first], places[&second]),
            Remaining::Priority(high, low) => SavedProgram::Priority(places[&high], places[&low]),
            Remaining::Search(inner) => SavedProgram::Search(places[&inner]),
            Remaining::Plan(step) => SavedProgram::Plan(plans[&step]),
            Remaining::Performing(slot) => SavedProgram::Performing(slot),
        }
    }

    /// Continues from a state.
    /// The theory may have changed in parts that the program has not reached yet.
    ///
    /// Fluents keep their values by name. The program continues where it is, if the steps before that place are as they
    /// were.
    ///
    /// # Errors
    /// If the theory lacks a place of the program, or an action that runs.
    pub fn restore(
        theory: Arc<ActionTheory>,
        limits: SearchLimits,
        state: &GologState,
    ) -> Result<Self, GologStateError> {
        let mut own = Self::new(theory, limits);
        if state.programs.is_empty() {
            return Ok(own);
        }
        let values: SortedMap<&str, Option<&str>> =
            state.fluents.iter().map(|(name, value)| (name.as_str(), value.as_deref())).collect();
        let theory = Arc::clone(&own.theory);
        for fluent in &theory.fluents {
            for cell in 0..fluent.count {
                let value = match values.get(theory.cell_name(fluent, cell).as_str()) {
                    Some(Some(text)) => theory.domains[fluent.value].parse(text),
                    Some(None) => Some(UNKNOWN),
                    None => None,
                };
                if let Some(value) = value {
                    own.situation.set(fluent.base + cell, value);
                }
            }
        }
        own.change();
        own.restore_performances(state)?;
        let programs = own.restore_programs(state)?;
        let place = |at: u32| programs.get(at as usize).copied().ok_or_else(damaged);
        own.program = place(state.program)?;
        own.check_slots()?;
        for program in &state.hopeless {
            own.hopeless.push(place(*program)?);
        }
        let occurred = |name: &str| state.occurred.iter().any(|own| own == name);
        own.observed.actions.iter_mut().for_each(|action| action.holds = occurred(&action.name));
        (own.outcome, own.steps) = (state.outcome, state.steps);
        own.restore_trace(state);
        if let Some((program, transitions)) = state.search {
            own.restore_search(place(program)?, transitions.min(limits.most_transitions));
        }
        own.is_blocked = state.is_blocked;
        Ok(own)
    }

    /// Rechecks the transitions, after a change of the theory.
    pub fn wake(&mut self) {
        self.change();
    }

    /// Repeats the search up to its saved extent.
    /// A search depends on the program and the situation alone.
    fn restore_search(&mut self, program: u32, transitions: u64) {
        let mut search = DepthFirstSearch::of_plan(&self.situation.cells);
        let is_running = search.begin(&self.theory, &mut self.programs, program) == Ok(false)
            && search.run(&self.theory, &mut self.programs, transitions) == Ok(SearchProgress::Interrupted);
        // In a changed theory it may end earlier: it is searched again then.
        self.search = is_running.then_some(RunningSearch { program, search });
    }

    /// Remembers the actions that the theory still has.
    fn restore_trace(&mut self, state: &GologState) {
        for (text, event) in &state.trace {
            if let Ok(action) = self.any_action(text, *event == TracedEvent::Occurred) {
                self.trace.add(action, *event);
            }
        }
        self.trace.count = state.traced;
    }

    fn restore_performances(&mut self, state: &GologState) -> Result<(), GologStateError> {
        for own in &state.performances {
            let Some((text, phase)) = own else {
                self.performances.push(None);
                continue;
            };
            let action = self.ground_action(text)?;
            if self.theory.actions[action.action as usize].performs.is_none() {
                return Err(GologStateError(format!("the action `{text}` runs, and performs nothing now")));
            }
            self.performances.push(Some(Performance { action, phase: *phase }));
        }
        match self.performances.len() > MOST_ACTIONS {
            true => Err(damaged()),
            false => Ok(()),
        }
    }

    fn ground_action(&self, text: &str) -> Result<GroundAction, GologStateError> {
        self.any_action(text, false)
    }

    fn any_action(&self, text: &str, is_exogenous: bool) -> Result<GroundAction, GologStateError> {
        let theory = &*self.theory;
        let name = text.split('(').next().unwrap_or(text);
        let found =
            theory.actions.iter().position(|model| model.name == name && model.is_exogenous == is_exogenous);
        let found = found.and_then(|action| {
            let values = theory.parse_call(text, name, &theory.actions[action].domains)?;
            let mut arguments = [0; crate::theory::MOST_ARGUMENTS];
            arguments[..values.len()].copy_from_slice(&values);
            Some(GroundAction { action: action as u32, arguments })
        });
        found.ok_or_else(|| GologStateError(format!("the action `{text}` does not exist")))
    }

    /// Restores programs; returns their numbers.
    fn restore_programs(&mut self, state: &GologState) -> Result<Vec<u32>, GologStateError> {
        let theory = Arc::clone(&self.theory);
        let keys: SortedMap<u64, usize> =
            theory.nodes.iter().enumerate().map(|(node, own)| (own.key, node)).collect();
        let mut programs: Vec<u32> = Vec::new();
        for own in &state.programs {
            let at = |place: u32| programs.get(place as usize).copied().ok_or_else(damaged);
            let program = match own {
                SavedProgram::Nil => NIL,
                SavedProgram::Code(key, line, title, variables) => {
                    let node = keys.get(key).copied();
                    let bindings =
                        node.and_then(|node| bindings_of(&theory, theory.nodes[node].scope, variables));
                    let (Some(node), Some(bindings)) = (node, bindings) else {
                        let reason =
                            format!("the program is at line {line}, `{title}`, which does not exist");
                        return Err(GologStateError(reason));
                    };
                    self.programs.code(&theory.nodes, node, &bindings)
                }
                SavedProgram::Then(first, second) => {
                    let (first, second) = (at(*first)?, at(*second)?);
                    self.programs.then(first, second)
                }
                SavedProgram::Both(first, second) => {
                    let (first, second) = (at(*first)?, at(*second)?);
                    self.programs.both(first, second)
                }
                SavedProgram::Priority(high, low) => {
                    let (high, low) = (at(*high)?, at(*low)?);
                    self.programs.priority(high, low)
                }
                SavedProgram::Search(inner) => {
                    let inner = at(*inner)?;
                    self.programs.add(Remaining::Search(inner))
                }
                SavedProgram::Plan(step) if (*step as usize) < state.plans.len() => {
                    self.programs.add(Remaining::Plan(*step))
                }
                SavedProgram::Plan(_) => return Err(damaged()),
                SavedProgram::Performing(slot) => self.programs.add(Remaining::Performing(*slot)),
            };
            if self.programs.depth(program) > step::MOST_DEPTH {
                return Err(damaged());
            }
            programs.push(program);
        }
        for (number, step) in state.plans.iter().enumerate() {
            let program = programs.get(step.program as usize).copied().ok_or_else(damaged)?;
            let action = step.action.as_ref().map(|text| self.ground_action(text)).transpose()?;
            // Each step follows those after it.
            if step.next.is_some_and(|next| next as usize >= number) {
                return Err(damaged());
            }
            self.programs.plans.push(PlannedStep {
                program,
                expected: step.expected,
                action,
                next: step.next,
            });
        }
        self.check_plans()?;
        Ok(programs)
    }

    /// Refuses plans whose steps contain plans: a search has none inside.
    fn check_plans(&self) -> Result<(), GologStateError> {
        for step in &self.programs.plans {
            let (inside, _) = self.programs.reachable(&[step.program]);
            let is_running =
                |own: &u32| matches!(self.programs.get(*own), Remaining::Plan(_) | Remaining::Performing(_));
            if inside.iter().any(is_running) {
                return Err(damaged());
            }
        }
        Ok(())
    }

    /// Refuses a program whose actions are not those that run.
    fn check_slots(&mut self) -> Result<(), GologStateError> {
        let (inside, _) = self.programs.reachable(&[self.program]);
        let mut slots: Vec<u32> = inside
            .iter()
            .filter_map(|own| match self.programs.get(*own) {
                Remaining::Performing(slot) => Some(slot),
                _ => None,
            })
            .collect();
        slots.sort_unstable();
        let running = self.performances.iter().enumerate().filter(|(_, own)| own.is_some());
        match slots.iter().copied().eq(running.map(|(slot, _)| slot as u32)) {
            true => Ok(()),
            false => Err(damaged()),
        }
    }
}

/// Variables that are visible in a scope, the innermost first.
pub(super) fn visible(theory: &ActionTheory, scope: Option<usize>) -> Vec<&VariableScope> {
    std::iter::successors(scope.map(|scope| &theory.scopes[scope]), |own| {
        own.outer.map(|outer| &theory.scopes[outer])
    })
    .collect()
}

/// Values of all variables of a scope; `None` if one has none.
fn bindings_of(theory: &ActionTheory, scope: Option<usize>, values: &[(String, String)]) -> Option<Bindings> {
    let mut bindings = [0; MOST_VARIABLES];
    for scope in visible(theory, scope) {
        let (_, text) = values.iter().find(|(name, _)| *name == scope.name)?;
        bindings[scope.slot] = theory.domains[scope.domain].parse(text)?;
    }
    Some(bindings)
}

fn damaged() -> GologStateError {
    GologStateError("it is damaged".into())
}
