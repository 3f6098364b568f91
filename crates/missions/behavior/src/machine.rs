//! Outline of state machines, for drawings and checks.

use mlua::{Table, Value};

/// State machine of a skill or an agent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SkillMachine {
    /// Name, mostly that of the skill.
    pub name: String,
    /// Name of the first state.
    pub start: String,
    /// Name of the state of success; empty for none.
    pub exit: String,
    /// Name of the state of failure; empty for none.
    pub fail: String,
    /// States in the order of their definition.
    pub states: Vec<MachineState>,
}

/// State of a machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MachineState {
    /// Name, unique in its machine.
    pub name: String,
    /// Transitions in the order in which they are tried.
    pub transitions: Vec<MachineTransition>,
    /// Names of the skills and actions that it runs.
    pub skills: Vec<String>,
}

/// Transition out of a state.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MachineTransition {
    /// Name of the state that it leads to.
    pub to: String,
    /// Condition, or its description.
    pub description: String,
    /// True if the transition is tried before the state is entered.
    pub is_precondition: bool,
    /// True if the transition follows a timeout.
    pub is_timeout: bool,
}

/// Reads the outline made by the prelude.
pub fn read(outline: &Table) -> mlua::Result<Vec<SkillMachine>> {
    let machines = outline.sequence_values::<Table>();
    machines.map(|machine| read_machine(&machine?)).collect()
}

fn read_machine(machine: &Table) -> mlua::Result<SkillMachine> {
    let states = machine.get::<Table>(5)?;
    Ok(SkillMachine {
        name: machine.get(1)?,
        start: machine.get(2)?,
        exit: machine.get(3)?,
        fail: machine.get(4)?,
        states: states
            .sequence_values::<Table>()
            .map(|state| read_state(&state?))
            .collect::<mlua::Result<_>>()?,
    })
}

fn read_state(state: &Table) -> mlua::Result<MachineState> {
    let transitions = state.get::<Table>(2)?;
    let transition = |transition: mlua::Result<Table>| {
        let transition = transition?;
        Ok(MachineTransition {
            to: transition.get(1)?,
            description: transition.get(2)?,
            is_precondition: transition.get(3)?,
            is_timeout: transition.get(4)?,
        })
    };
    let skills = state.get::<Table>(3)?;
    Ok(MachineState {
        name: state.get(1)?,
        transitions: transitions.sequence_values::<Table>().map(transition).collect::<mlua::Result<_>>()?,
        skills: skills
            .sequence_values::<Value>()
            .map(|name| name?.to_string())
            .collect::<mlua::Result<_>>()?,
    })
}
