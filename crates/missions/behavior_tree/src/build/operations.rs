//! Nodes of BehaviorTree.CPP by their names.

use super::attributes::Attributes;
use super::computable;
use super::loops::item_loop;
use crate::error::TreeError;
use crate::ports::PortBinding;
use crate::queue::ItemKind;
use crate::tree::{NodeOperation, NodeStatus};

/// Names of the nodes that are built in.
pub(super) const OPERATIONS: [&str; 44] = [
    "Sequence",
    "AsyncSequence",
    "SequenceWithMemory",
    "ReactiveSequence",
    "Fallback",
    "AsyncFallback",
    "ReactiveFallback",
    "Parallel",
    "ParallelAll",
    "IfThenElse",
    "WhileDoElse",
    "TryCatch",
    "Switch2",
    "Switch3",
    "Switch4",
    "Switch5",
    "Switch6",
    "Inverter",
    "ForceSuccess",
    "ForceFailure",
    "Repeat",
    "RetryUntilSuccessful",
    "KeepRunningUntilFailure",
    "Delay",
    "Timeout",
    "RunOnce",
    "Precondition",
    "LoopInt",
    "LoopDouble",
    "LoopString",
    "LoopBool",
    "SkipUnlessUpdated",
    "WaitValueUpdate",
    "SubTree",
    "AlwaysSuccess",
    "AlwaysFailure",
    "SetBlackboard",
    "UnsetBlackboard",
    "WasEntryUpdated",
    "Script",
    "ScriptCondition",
    "Sleep",
    "Action",
    "Condition",
];

/// Returns the operation of a node; `None` for one that is not built in.
pub(super) fn operation(
    tag: &str,
    attributes: &mut Attributes<'_, '_>,
) -> Result<Option<NodeOperation>, TreeError> {
    Ok(Some(match tag {
        "Sequence" => NodeOperation::Sequence { is_async: false },
        "AsyncSequence" => NodeOperation::Sequence { is_async: true },
        "SequenceWithMemory" => NodeOperation::SequenceWithMemory,
        "ReactiveSequence" => NodeOperation::ReactiveSequence,
        "Fallback" => NodeOperation::Fallback { is_async: false },
        "AsyncFallback" => NodeOperation::Fallback { is_async: true },
        "ReactiveFallback" => NodeOperation::ReactiveFallback,
        "Parallel" => NodeOperation::Parallel {
            successes: attributes.integer("success_count", Some(-1), i64::MIN)?,
            failures: attributes.integer("failure_count", Some(1), i64::MIN)?,
        },
        "ParallelAll" => {
            NodeOperation::ParallelAll { failures: attributes.integer("max_failures", Some(1), i64::MIN)? }
        }
        "IfThenElse" => NodeOperation::IfThenElse,
        "WhileDoElse" => NodeOperation::WhileDoElse,
        "Switch2" => switch(2, attributes)?,
        "Switch3" => switch(3, attributes)?,
        "Switch4" => switch(4, attributes)?,
        "Switch5" => switch(5, attributes)?,
        "Switch6" => switch(6, attributes)?,
        "Inverter" => NodeOperation::Inverter,
        "ForceSuccess" => NodeOperation::ForceSuccess,
        "ForceFailure" => NodeOperation::ForceFailure,
        "Repeat" => NodeOperation::Repeat { count: attributes.integer("num_cycles", None, -1)? },
        "RetryUntilSuccessful" => {
            NodeOperation::Retry { count: attributes.integer("num_attempts", None, -1)? }
        }
        "KeepRunningUntilFailure" => NodeOperation::KeepRunningUntilFailure,
        "Delay" => NodeOperation::Delay { milliseconds: attributes.integer("delay_msec", None, 0)? },
        "Timeout" => NodeOperation::Timeout { milliseconds: attributes.integer("msec", None, 0)? },
        "RunOnce" => NodeOperation::RunOnce { then_skip: truth_port(attributes, "then_skip", "true")? },
        "TryCatch" => NodeOperation::TryCatch { on_halt: truth_port(attributes, "catch_on_halt", "false")? },
        "LoopInt" => item_loop(ItemKind::Integer, attributes)?,
        "LoopDouble" => item_loop(ItemKind::Number, attributes)?,
        "LoopString" => item_loop(ItemKind::Text, attributes)?,
        "LoopBool" => item_loop(ItemKind::Truth, attributes)?,
        "SkipUnlessUpdated" => on_update(NodeStatus::Skipped, attributes)?,
        "WaitValueUpdate" => on_update(NodeStatus::Running, attributes)?,
        "WasEntryUpdated" => NodeOperation::WasUpdated { entry: watched_entry(attributes)? },
        "Precondition" => precondition(attributes)?,
        "AlwaysSuccess" => NodeOperation::AlwaysSuccess,
        "AlwaysFailure" => NodeOperation::AlwaysFailure,
        "SetBlackboard" => {
            let entry = attributes.entry("output_key")?;
            let text = attributes.required("value")?;
            NodeOperation::SetBlackboard { value: computable(attributes.bind("value", text)), entry }
        }
        "UnsetBlackboard" => NodeOperation::UnsetBlackboard { entry: attributes.entry("key")? },
        "Script" => NodeOperation::Script(attributes.script_port("code")?),
        "ScriptCondition" => NodeOperation::ScriptCondition(attributes.script_port("code")?),
        "Sleep" => NodeOperation::Sleep { milliseconds: attributes.integer("msec", None, 0)? },
        _ => return Ok(None),
    }))
}

fn switch(count: usize, attributes: &mut Attributes<'_, '_>) -> Result<NodeOperation, TreeError> {
    let text = attributes.required("variable")?;
    let variable = attributes.bind("variable", text);
    let mut cases = Vec::with_capacity(count);
    for number in 1..=count {
        let name = format!("case_{number}");
        let text = attributes.required(&name)?;
        cases.push(attributes.bind(&name, text));
    }
    Ok(NodeOperation::Switch { variable, cases })
}

fn precondition(attributes: &mut Attributes<'_, '_>) -> Result<NodeOperation, TreeError> {
    let condition = attributes.script_port("if")?;
    let otherwise = attributes.status("else", NodeStatus::Failed)?;
    Ok(NodeOperation::Precondition { condition, otherwise })
}

fn truth_port(
    attributes: &mut Attributes<'_, '_>,
    name: &str,
    default: &str,
) -> Result<PortBinding, TreeError> {
    let text = attributes.take(name).unwrap_or(default);
    match attributes.bind(name, text) {
        PortBinding::Literal(value) if value.truth().is_none() => Err(attributes.error(format!(
            "expected true, false or an entry such as `{{n}}` in the port `{name}`, found `{text}`"
        ))),
        port => Ok(port),
    }
}

fn on_update(otherwise: NodeStatus, attributes: &mut Attributes<'_, '_>) -> Result<NodeOperation, TreeError> {
    Ok(NodeOperation::OnUpdate { entry: watched_entry(attributes)?, otherwise })
}

/// Returns the entry in the port `entry`, with or without braces.
fn watched_entry(attributes: &mut Attributes<'_, '_>) -> Result<usize, TreeError> {
    let text = attributes.required("entry")?;
    match attributes.bind("entry", text) {
        PortBinding::Entry(entry) => Ok(entry),
        PortBinding::Literal(_) if text.is_empty() => {
            Err(attributes.error("expected an entry such as `{n}` in the port `entry`, found none"))
        }
        PortBinding::Literal(_) => Ok(attributes.entry_named(text)),
    }
}
