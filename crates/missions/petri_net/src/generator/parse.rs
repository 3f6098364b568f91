//! Text of linear plans and of execution rules.

use super::{ExecutionRule, LinearAction, PlanRecovery};
use crate::error::NetError;

/// Parses a linear plan.
/// Actions are separated by `;` or lines, a timeout in seconds follows `|`, comments follow `#`.
///
/// ```
/// let plan = slate_petri_net::parse_linear_plan("goto_printer|30; say_hello # and no more")?;
/// assert_eq!((plan[0].timeout, plan[1].action.as_str()), (Some(30.0), "say_hello"));
/// # Ok::<(), slate_petri_net::NetError>(())
/// ```
pub fn parse_linear_plan(text: &str) -> Result<Vec<LinearAction>, NetError> {
    let mut plan = Vec::new();
    for (line, content) in lines(text) {
        for item in content.split(';').map(str::trim).filter(|item| !item.is_empty()) {
            let (action, timeout) = match item.split_once('|') {
                Some((action, seconds)) => (action.trim(), Some(duration(seconds, line)?)),
                None => (item, None),
            };
            plan.push(LinearAction { action: name(action, line)?, timeout });
        }
    }
    if plan.is_empty() {
        return Err(NetError::new("expected at least one action, such as `goto_printer; say_hello`"));
    }
    Ok(plan)
}

/// Parses execution rules, a line each.
/// `*if* CONDITION *during* ACTION *do* ACTION; ...; RECOVERY`.
pub fn parse_rules(text: &str) -> Result<Vec<ExecutionRule>, NetError> {
    lines(text).map(|(line, content)| rule(content, line)).collect()
}

fn rule(content: &str, line: usize) -> Result<ExecutionRule, NetError> {
    let expected = || {
        let shape = "`*if* CONDITION *during* ACTION *do* RECOVERY`";
        NetError::at(line, format!("expected a rule such as {shape}, found `{content}`"))
    };
    let rest = content.strip_prefix("*if*").ok_or_else(expected)?;
    let (condition, rest) = rest.split_once("*during*").ok_or_else(expected)?;
    let (during, reaction) = rest.split_once("*do*").ok_or_else(expected)?;
    let mut actions: Vec<&str> =
        reaction.split(';').map(str::trim).filter(|action| !action.is_empty()).collect();
    let last = actions.pop().unwrap_or_default();
    let recovery = PlanRecovery::ALL.into_iter().find(|recovery| recovery.word() == last);
    let recovery = recovery.ok_or_else(|| {
        let words = PlanRecovery::ALL.map(PlanRecovery::word).join(", ");
        NetError::at(line, format!("expected one of {words} at the end of the rule, found `{last}`"))
    })?;
    // They would end the guard that the condition becomes.
    if condition.contains(['[', ']']) {
        return Err(NetError::at(
            line,
            format!("expected a condition without brackets, found `{}`", condition.trim()),
        ));
    }
    Ok(ExecutionRule {
        condition: condition.trim().into(),
        during: name(during.trim(), line)?,
        actions: actions.into_iter().map(|action| name(action, line)).collect::<Result<_, _>>()?,
        recovery,
    })
}

/// Lines with content, from 1, without comments.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let content = |line: &str| line.split('#').next().unwrap_or_default().len();
    let numbered = text.lines().enumerate();
    let numbered = numbered.map(move |(index, line)| (index + 1, line[..content(line)].trim()));
    numbered.filter(|(_, line)| !line.is_empty())
}

fn name(action: &str, line: usize) -> Result<String, NetError> {
    let is_plain = |sign: char| sign.is_alphanumeric() || "_-+.:/".contains(sign);
    if action.is_empty() || action.starts_with('_') || !action.chars().all(is_plain) {
        let reason = format!("expected an action with its arguments, such as `goto_6_2`, found `{action}`");
        return Err(NetError::at(line, reason));
    }
    Ok(action.into())
}

fn duration(text: &str, line: usize) -> Result<f64, NetError> {
    let seconds = text.trim().parse().ok().filter(|seconds: &f64| seconds.is_finite() && *seconds > 0.0);
    seconds.ok_or_else(|| {
        let reason = format!("expected a timeout in seconds, such as `goto_6_2|30`, found `{}`", text.trim());
        NetError::at(line, reason)
    })
}
