//! Defects of state machines that are found before they run.

use crate::host::BehaviorAction;
use crate::machine::{MachineState, SkillMachine};

/// Kind of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MachineFindingKind {
    /// Action that the robot does not have.
    UnknownAction,
    /// State that no transition leads to.
    UnreachableState,
    /// State that is never left and does not end the machine.
    DeadEnd,
    /// Machine that neither succeeds nor fails.
    NoEnd,
}

impl MachineFindingKind {
    /// Returns the name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::UnknownAction => "unknown action",
            Self::UnreachableState => "unreachable state",
            Self::DeadEnd => "dead end",
            Self::NoEnd => "no end",
        }
    }

    /// Returns true if the finding prevents the mission from running.
    pub fn is_error(self) -> bool {
        matches!(self, Self::UnknownAction | Self::DeadEnd)
    }
}

/// Defect or possible defect.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MachineFinding {
    /// Kind.
    pub kind: MachineFindingKind,
    /// Machine, state and defect.
    pub text: String,
}

/// Finds defects of machines and actions; with `known`, actions that are not in it.
pub fn check_machines(
    machines: &[SkillMachine],
    actions: &[BehaviorAction],
    known: Option<&[String]>,
) -> Vec<MachineFinding> {
    let mut findings = Vec::new();
    for action in actions.iter().filter(|action| known.is_some_and(|known| !known.contains(&action.kind))) {
        let text = format!("`{}` performs the action `{}`, which is unknown", action.owner, action.kind);
        findings.push(MachineFinding { kind: MachineFindingKind::UnknownAction, text });
    }
    machines.iter().for_each(|machine| check_machine(machine, &mut findings));
    findings
}

fn check_machine(machine: &SkillMachine, findings: &mut Vec<MachineFinding>) {
    let reached = reached_states(machine);
    let mut found = |kind, text| findings.push(MachineFinding { kind, text });
    let is_end = |state: &MachineState| state.name == machine.exit || state.name == machine.fail;
    for (state, is_reached) in machine.states.iter().zip(&reached).filter(|(state, _)| !is_end(state)) {
        let place = format!("{}/{}", machine.name, state.name);
        if !is_reached {
            found(MachineFindingKind::UnreachableState, format!("no transition leads to `{place}`"));
        } else if !state.transitions.iter().any(|transition| !transition.is_precondition) {
            found(MachineFindingKind::DeadEnd, format!("no transition leaves `{place}`"));
        }
    }
    let mut ends = machine.states.iter().zip(&reached).filter(|(state, _)| is_end(state));
    if !ends.any(|(_, is_reached)| *is_reached) {
        found(MachineFindingKind::NoEnd, format!("`{}` neither succeeds nor fails", machine.name));
    }
}

/// Returns for each state whether the start reaches it.
fn reached_states(machine: &SkillMachine) -> Vec<bool> {
    let index_of = |name: &str| machine.states.iter().position(|state| state.name == name);
    let mut reached = vec![false; machine.states.len()];
    let mut open: Vec<usize> = index_of(&machine.start).into_iter().collect();
    while let Some(index) = open.pop() {
        if !std::mem::replace(&mut reached[index], true) {
            let targets = machine.states[index].transitions.iter();
            open.extend(targets.filter_map(|transition| index_of(&transition.to)));
        }
    }
    reached
}
