//! View of skills in Lua: state machines with their current states.

use slate_behavior::{BehaviorEngine, MachineState, SkillMachine};

use super::activity::{ActivityWriter, MissionItemStatus, MissionSight};
use super::drawing::{MissionDrawing, MissionElementKind, MissionMark};
use crate::activity_hash::ActivityHash;

/// Element of skills.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SkillElement {
    /// State: machine, state.
    State(usize, usize),
    /// Action, by its number.
    Action(usize),
    /// Machine, or a transition.
    Other,
}

/// Returns the number of the group of each machine; its states follow.
fn groups(engine: &BehaviorEngine) -> impl Iterator<Item = (&SkillMachine, usize)> {
    engine.machines().iter().scan(0, |next, machine| {
        let group = std::mem::replace(next, *next + 1 + machine.states.len());
        Some((machine, group))
    })
}

/// Returns the number of the first action.
fn first_action(engine: &BehaviorEngine) -> usize {
    groups(engine).last().map_or(0, |(machine, group)| group + 1 + machine.states.len())
}

/// Returns the element of a number.
pub fn element(engine: &BehaviorEngine, number: usize) -> SkillElement {
    let found = groups(engine)
        .enumerate()
        .find(|(_, (machine, group))| (group + 1..=group + machine.states.len()).contains(&number));
    let first = first_action(engine);
    match found {
        Some((machine, (_, group))) => SkillElement::State(machine, number - group - 1),
        None if (first..first + engine.actions().len()).contains(&number) => {
            SkillElement::Action(number - first)
        }
        None => SkillElement::Other,
    }
}

/// Draws the machines, the actions, and the transitions.
pub fn draw(engine: &BehaviorEngine) -> MissionDrawing {
    let mut drawing = MissionDrawing::new(engine.name());
    for (machine, group) in groups(engine) {
        drawing.node(MissionElementKind::GROUP, MissionMark::PLAIN, usize::MAX, &machine.name);
        for state in &machine.states {
            drawing.node(MissionElementKind::STATE, mark(machine, state), group, &label(state));
        }
    }
    for action in engine.actions() {
        let label = format!("{}: {}", action.owner, action.kind);
        drawing.node(MissionElementKind::ACTION, MissionMark::PLAIN, usize::MAX, &label);
    }
    for (machine, group) in groups(engine) {
        for (from, to, transition) in transitions(machine) {
            let mark = if transition.is_timeout { MissionMark::TIMEOUT } else { MissionMark::PLAIN };
            drawing.edge((group + 1 + from, group + 1 + to), mark, 0, &transition.description);
        }
    }
    drawing
}

/// Returns the transitions of a machine: states from and to, by their numbers.
fn transitions(
    machine: &SkillMachine,
) -> impl Iterator<Item = (usize, usize, &slate_behavior::MachineTransition)> {
    let index_of = |name: &str| machine.states.iter().position(|state| state.name == name);
    machine.states.iter().enumerate().flat_map(move |(from, state)| {
        state
            .transitions
            .iter()
            .filter_map(move |transition| Some((from, index_of(&transition.to)?, transition)))
    })
}

fn mark(machine: &SkillMachine, state: &MachineState) -> MissionMark {
    match &state.name {
        name if *name == machine.start => MissionMark::START,
        name if *name == machine.exit => MissionMark::GOAL,
        name if *name == machine.fail => MissionMark::FAILURE,
        _ => MissionMark::PLAIN,
    }
}

fn label(state: &MachineState) -> String {
    match state.skills.as_slice() {
        [] => state.name.clone(),
        skills => format!("{}: {}", state.name, skills.join(", ")),
    }
}

/// Hashes how often a state has changed.
pub fn hash(engine: &BehaviorEngine, hash: &mut ActivityHash) {
    hash.number(engine.changes());
}

/// Describes the current states, blocked transitions, and running actions.
/// For each transition it gives the reason why it does not follow.
pub fn describe(engine: &BehaviorEngine, seen: &MissionSight<'_>, activity: &mut ActivityWriter<'_>) {
    let current = engine.current_states();
    let first = first_action(engine);
    for action in (0..engine.actions().len()).filter(|action| seen.actions.runs(*action)) {
        let text = seen.actions.text(action);
        activity.element(first + action, MissionItemStatus::RUNNING, 0, format_args!("{text}"));
    }
    let mut edge = first + engine.actions().len();
    for ((machine, group), current) in groups(engine).zip(current) {
        let runs = |state: &MachineState| state.name != machine.exit && state.name != machine.fail;
        if let Some(state) = current {
            if runs(&machine.states[state]) {
                activity.element(group, MissionItemStatus::RUNNING, 0, format_args!(""));
            }
            activity.element(group + 1 + state, MissionItemStatus::CURRENT, 0, format_args!(""));
        }
        for (from, _, transition) in transitions(machine) {
            if current == Some(from) {
                let reason = match (transition.is_timeout, transition.is_precondition) {
                    (true, _) => "its time is not over",
                    (_, true) => "is tried only when the state is entered",
                    _ => "does not hold yet",
                };
                activity.element(edge, MissionItemStatus::WAITING, 0, format_args!("{reason}"));
            }
            edge += 1;
        }
    }
}
