//! Defects of a plan.

use std::path::Path;

use serde_json::{Value, json};
use slate_petri_net::{
    CheckLimits, FiringPath, JointNet, NetError, NetReport, PetriNet, PetriPlan, check_joint, check_net,
    read_pnml,
};

use crate::failure::{ASSERTION_FALSE, Failure};
use crate::output;

/// Checks a plan and its sub-plans, and prints the findings; returns the exit code.
pub fn check(file: &Path, actions: &[String], states: usize, json: bool) -> Result<u8, Failure> {
    let net = read_pnml(file)?;
    let joint = JointNet::new(&net).map_err(|error| error.of_file(file))?;
    let plans = match &joint {
        None => vec![PetriPlan::with_folder(net, file)?],
        Some(joint) => parts(joint, file)?,
    };
    let is_sub_plan = |text: &str| plans.iter().any(|plan| plan.is_sub_plan(text));
    let is_known = |text: &str| actions.iter().any(|action| action == text) || is_sub_plan(text);
    let is_known: Option<&dyn Fn(&str) -> bool> = if actions.is_empty() { None } else { Some(&is_known) };
    let limits = CheckLimits { most_states: states, is_known_action: is_known };
    let mut reports: Vec<(&PetriNet, NetReport)> = Vec::new();
    reports.extend(joint.as_ref().map(|joint| (joint.net(), check_joint(joint, &limits))));
    for net in plans.iter().flat_map(|plan| &plan.nets()[usize::from(joint.is_some())..]) {
        if !reports.iter().any(|(other, _)| other.name() == net.name()) {
            reports.push((net, check_net(net, &limits)));
        }
    }
    let is_sound = reports.iter().all(|(_, report)| report.is_sound());
    if json {
        let plans: Vec<Value> = reports.iter().map(|(net, report)| document(net, report)).collect();
        output::json(&json!({ "schema": "slate.mission.check/1", "sound": is_sound, "plans": plans }));
    } else {
        reports.iter().for_each(|(net, report)| print(net, report));
    }
    Ok(if is_sound { 0 } else { ASSERTION_FALSE })
}

/// Returns the part of each robot, with its sub-plans.
fn parts(joint: &JointNet, file: &Path) -> Result<Vec<PetriPlan>, NetError> {
    let parts = joint.robots().iter().filter_map(|robot| joint.robot(robot));
    parts.map(|part| PetriPlan::with_folder(part.net, file)).collect()
}

fn print(net: &PetriNet, report: &NetReport) {
    for finding in &report.findings {
        let level = if finding.kind.is_error() { "error" } else { "warning" };
        output::line(format!("{level}: {}: {}: {}", net.name(), finding.kind.name(), finding.text));
        if let Some(path) = &finding.path {
            output::line(format!("  after {}", sequence(net, path)));
        }
    }
    let verdict = match (report.is_sound(), report.is_complete) {
        (true, _) => "sound",
        (false, true) => "not sound",
        (false, false) => "not sound as far as it was explored",
    };
    output::line(format!(
        "{}: {verdict}; {} places, {} transitions, {} markings, {} actions, {} conditions",
        net.name(),
        net.places().len(),
        net.transitions().len(),
        report.states,
        net.actions().len(),
        net.conditions().len()
    ));
}

/// Returns the firings of a path, with the part that can be repeated in brackets.
fn sequence(net: &PetriNet, path: &FiringPath) -> String {
    if path.transitions.is_empty() {
        return "no firing: in the initial marking".into();
    }
    let title = |transition: &usize| net.transitions()[*transition].title();
    let titles: Vec<String> = path.transitions.iter().map(title).collect();
    let (first, repeated) = titles.split_at(path.repeated.unwrap_or(titles.len()));
    let mut parts = first.to_vec();
    if !repeated.is_empty() {
        parts.push(format!("({}), again and again", repeated.join(", ")));
    }
    parts.join(", ")
}

fn document(net: &PetriNet, report: &NetReport) -> Value {
    let ids = |path: &FiringPath| -> Vec<&str> {
        path.transitions.iter().map(|transition| net.transitions()[*transition].id.as_str()).collect()
    };
    let findings: Vec<Value> = report
        .findings
        .iter()
        .map(|finding| {
            json!({
                "kind": finding.kind.name(),
                "error": finding.kind.is_error(),
                "text": finding.text,
                "path": finding.path.as_ref().map(ids),
                "repeated_from": finding.path.as_ref().and_then(|path| path.repeated),
                "marking": finding.path.as_ref().map(|path| net.marking_text(&path.marking)),
            })
        })
        .collect();
    json!({
        "plan": net.name(),
        "sound": report.is_sound(),
        "complete": report.is_complete,
        "markings": report.states,
        "places": net.places().len(),
        "transitions": net.transitions().len(),
        "actions": net.actions(),
        "conditions": net.conditions(),
        "findings": findings,
    })
}
