use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use slate_module::{Sequence, Text, interface};

/// The longest name of a kind of action, bytes.
pub const KIND_LENGTH: usize = 44;
/// The most arguments that an action takes.
pub const ARGUMENTS: usize = 8;

/// Request of an action: a registered kind and its arguments.
/// Execute owns the behavior.
#[interface]
#[derive(PartialEq)]
pub struct ActionRequest {
    /// The arguments, in the units that the kind documents.
    pub arguments: Sequence<f64, 8>,
    /// The kind, such as `TurnAngle`.
    pub kind: Text<44>,
}

/// Change of the plan by an action.
#[interface]
pub enum PlanStep {
    /// Queue the action behind the others.
    Append,
    /// Cancel the running planned action and those that wait, then queue this one.
    Replace,
    /// Cancel the running planned action and those that wait; without an action.
    Clear,
}

/// Message of a planned action to Execute.
#[interface]
pub struct Planned {
    /// Epoch at the Plan; Execute drops plans from before its newest reflex.
    pub epoch: u64,
    /// Number of the message, from 1; Execute reports its ending by this number.
    pub ticket: u64,
    /// The action.
    pub action: ActionRequest,
    /// Change of the plan.
    pub step: PlanStep,
}

/// Message of a reflex to Execute.
#[interface]
pub struct Reflex {
    /// The action.
    pub action: ActionRequest,
    /// Rank of the sending model; the highest first.
    pub rank: i32,
}

/// Rank of a ReactiveModel.
#[interface]
#[derive(PartialEq)]
pub struct Rank {
    /// Rank: a higher one inhibits and preempts a lower one.
    pub rank: i32,
}

/// Reason of a refused message, as answered to its sender.
#[interface]
#[repr(u16)]
pub enum RefusalReason {
    /// Not refused.
    None,
    /// Unknown kind of action.
    UnknownKind,
    /// Too many or too few arguments, or one is not a finite number.
    BadArguments,
    /// Planned before the latest reflex.
    OldEpoch,
    /// The pipeline is full.
    Full,
}

#[derive(Serialize)]
struct Written<'a> {
    kind: &'a str,
    arguments: &'a [f64],
}

#[derive(Deserialize)]
struct Read {
    kind: String,
    arguments: Vec<f64>,
}

impl Serialize for ActionRequest {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Written { kind: self.kind.as_str(), arguments: &self.arguments }.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for ActionRequest {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Read { kind, arguments } = Read::deserialize(deserializer)?;
        if kind.len() > KIND_LENGTH || arguments.len() > ARGUMENTS {
            return Err(D::Error::custom("an action's kind or arguments are too long"));
        }
        Ok(Self { kind: Text::new(&kind), arguments: Sequence::new(&arguments) })
    }
}
