//! Net of a linear plan.

use super::{ExecutionRule, LinearAction, PlanRecovery};
use crate::builder::NetBuilder;
use crate::error::NetError;
use crate::label::action_name;
use crate::net::PetriNet;

/// Generates the net of a linear plan with execution rules.
///
/// The actions follow each other. A rule interrupts the actions that it names; the first rule whose condition holds
/// wins. An action that fails makes the plan fail. A timeout of 30 s is the condition `elapsed_30`, which the host
/// answers: whether the newest action was started at least 30 s ago.
pub fn generate_net(
    name: &str,
    plan: &[LinearAction],
    rules: &[ExecutionRule],
) -> Result<PetriNet, NetError> {
    if let Some(rule) = rules.iter().find(|rule| !plan.iter().any(|step| is_during(rule, &step.action))) {
        let actions: Vec<&str> = plan.iter().map(|step| step.action.as_str()).collect();
        return Err(NetError::new(format!(
            "a rule names the action `{}`, expected one of the plan: {}",
            rule.during,
            actions.join(", ")
        )));
    }
    let mut net = NetBuilder::new(name);
    let first = net.place("start", 1);
    // Place before each action, and behind the last.
    let mut before = vec![first];
    for step in 1..plan.len() {
        before.push(net.place(&format!("P{step}"), 0));
    }
    before.push(net.place("goal", 0));
    let failure = net.place("fail", 0);
    for (step, LinearAction { action, timeout }) in plan.iter().enumerate() {
        let running = net.place(&format!("{action}.exec"), 0);
        net.transition(&format!("{action}.start"), &[(before[step], 1)], &[(running, 1)]);
        net.transition(&format!("{action}.end"), &[(running, 1)], &[(before[step + 1], 1)]);
        net.transition(&format!("{action}.fail"), &[(running, 1)], &[(failure, 1)]);
        for rule in rules.iter().filter(|rule| is_during(rule, action)) {
            let target = match rule.recovery {
                PlanRecovery::SkipAction => before[step + 1],
                PlanRecovery::RestartAction => before[step],
                PlanRecovery::RestartPlan => first,
                PlanRecovery::FailPlan => failure,
            };
            let interrupt = format!("{action}.interrupt [{}]", rule.condition);
            react(&mut net, &interrupt, running, &rule.actions, target, failure);
        }
        if let Some(seconds) = timeout {
            let label = format!("{action}.interrupt [elapsed_{seconds}]");
            net.transition(&label, &[(running, 1)], &[(before[step + 1], 1)]);
        }
    }
    net.finish()
}

fn is_during(rule: &ExecutionRule, action: &str) -> bool {
    rule.during == action || rule.during == action_name(action)
}

/// Leads from an interruption through actions to a place.
fn react(
    net: &mut NetBuilder,
    interrupt: &str,
    running: usize,
    actions: &[String],
    target: usize,
    failure: usize,
) {
    let mut from = running;
    let mut label = interrupt.to_owned();
    for action in actions {
        let next = net.place(&format!("{action}.exec"), 0);
        // A guard stands last in a label.
        let (events, guard) = label.split_once(" [").unwrap_or((&label, ""));
        let guard = if guard.is_empty() { String::new() } else { format!(" [{guard}") };
        net.transition(&format!("{events} {action}.start{guard}"), &[(from, 1)], &[(next, 1)]);
        net.transition(&format!("{action}.fail"), &[(next, 1)], &[(failure, 1)]);
        from = next;
        label = format!("{action}.end");
    }
    net.transition(&label, &[(from, 1)], &[(target, 1)]);
}
