//! Messages about ends of a link that do not fit.

use slate_blackboard::interface::{Descriptor, difference};
use slate_configuration::{ErrorCode, Message};
use slate_module::role;

use crate::survey::block::Block;

/// Advice: the rule of links.
pub(super) const LINK_RULE: &str = "both ends of a link carry the same interface, or one that converts exactly: to wider numbers, whole \
                    numbers to a smaller unit, and interfaces with such fields of the same names";

/// Returns the error and the help for a command that did not pass a gate.
pub fn ungated_command(path: &str) -> (Message, &'static str) {
    let message = ErrorCode::PastGate.of(format!("`/{path}` is a command that has not passed its gate"));
    (message, "link to the command that passed its gate: `<actuator>/command`")
}

/// Returns the message about ends with different interfaces.
pub(super) fn different(to: &str, from: &str, own: &Descriptor, other: &Descriptor) -> String {
    if own.name == other.name {
        let places = (format!("in `{to}`"), format!("in `/{from}`"));
        let first = difference(own, other, (&places.0, &places.1)).unwrap_or_default();
        format!(
            "`{to}` and `/{from}` are different versions of {}: {:016x} and {:016x}; {first}",
            own.name, own.hash, other.hash
        )
    } else {
        format!("`{to}` is {} but `/{from}` is {}", own.name, other.name)
    }
}

/// Returns the message about two ports whose roles can't be attached.
/// It is in terms of blocks, and `from` is inserted verbatim. The other port has a role and a block.
pub(super) fn roles(to: &str, own: &str, from: &str, (other, block): (&str, Option<Block>)) -> String {
    let what = match other {
        "" if let Some(block) = block => format!("an output of {}", block.name()),
        role::MEASUREMENT => "a measurement of a Sensor".to_owned(),
        role::PERCEPT => "a Monitor's output".to_owned(),
        role::CHANGE => "an Analyze's output".to_owned(),
        role::PLAN => "an Execute's inbox of plans".to_owned(),
        role::REFLEX => "an Execute's inbox of reflexes".to_owned(),
        "" => "a plain value, such as a simulator's or a driver's".to_owned(),
        other => format!("a {other}"),
    };
    match own {
        role::PERCEPT => format!("an Analyze reads Monitors: `{to}` can't read {from}, which is {what}"),
        role::CHANGE => format!("the Plan reads Analyzes: `{to}` can't read {from}, which is {what}"),
        role::PLAN => {
            format!("the Plan sends to an Execute's plan: `{to}` can't send to {from}, which is {what}")
        }
        role::REFLEX => {
            format!(
                "a ReactiveModel sends to an Execute's reflexes: `{to}` can't send to {from}, which is {what}"
            )
        }
        "" if other == role::PERCEPT => format!("only an Analyze reads Monitors: `{to}` can't read {from}"),
        "" if other == role::CHANGE => format!("only the Plan reads Analyzes: `{to}` can't read {from}"),
        own => format!(
            "`{to}` is {} but {from} is {what}",
            if own.is_empty() { "plain".into() } else { format!("a {own}") }
        ),
    }
}
