//! Skills in Lua: defects of their state machines.

use std::path::Path;

use serde_json::{Value, json};
use slate_behavior::{
    BehaviorEngine, BehaviorLimits, MachineFinding, MachineState, SkillFiles, SkillMachine, check_machines,
};

use super::findings::{CheckedMission, MissionFinding};
use super::skills_svg;
use crate::failure::Failure;

/// Draws the machines of a file.
pub fn draw(file: &Path) -> Result<String, Failure> {
    Ok(skills_svg::draw(&title(file), load(file)?.machines()))
}

/// Loads a file; it may be one that only loads skills.
fn load(file: &Path) -> Result<BehaviorEngine, Failure> {
    let files = SkillFiles::open(file)?;
    Ok(BehaviorEngine::load_outline(&files, BehaviorLimits::default())
        .map_err(|error| error.of_file(file))?)
}

/// Checks the machines of a file, and prints the findings; returns the exit code.
pub fn check(file: &Path, actions: &[String], json: bool) -> Result<u8, Failure> {
    let engine = load(file)?;
    let known = if actions.is_empty() { None } else { Some(actions) };
    let findings = check_machines(engine.machines(), engine.actions(), known);
    let finding = |MachineFinding { kind, text }| MissionFinding {
        kind: kind.name(),
        is_error: kind.is_error(),
        included: None,
        line: None,
        text,
    };
    let machine = |machine: &SkillMachine| {
        let states: Vec<&str> = machine.states.iter().map(|state| state.name.as_str()).collect();
        json!({ "name": machine.name, "start": machine.start, "states": states })
    };
    let checked = CheckedMission {
        file,
        title: title(file),
        counts: format!(
            "{} machines, {} states, {} transitions, {} actions",
            engine.machines().len(),
            states(&engine).count(),
            states(&engine).map(|state| state.transitions.len()).sum::<usize>(),
            kinds(&engine).len(),
        ),
        parts: json!({
            "machines": engine.machines().iter().map(machine).collect::<Vec<Value>>(),
            "actions": kinds(&engine),
        }),
        findings: findings.into_iter().map(finding).collect(),
    };
    Ok(checked.report(json))
}

fn title(file: &Path) -> String {
    file.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

fn states(engine: &BehaviorEngine) -> impl Iterator<Item = &MachineState> {
    engine.machines().iter().flat_map(|machine| &machine.states)
}

/// Kinds of actions, each once.
fn kinds(engine: &BehaviorEngine) -> Vec<&str> {
    let mut kinds: Vec<&str> = engine.actions().iter().map(|action| action.kind.as_str()).collect();
    kinds.sort_unstable();
    kinds.dedup();
    kinds
}
