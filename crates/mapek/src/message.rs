use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use slate_module::{Sequence, Text, interface};

/// The longest name of a kind of action, bytes.
pub const KIND_LENGTH: usize = 44;
/// The most arguments that an action takes.
pub const ARGUMENTS: usize = 8;

/// An action as it travels: a registered kind and its arguments. Execute owns the behaviour.
#[interface]
#[derive(PartialEq)]
pub struct ActionRequest {
    /// The arguments, in the units that the kind documents.
    pub arguments: Sequence<f64, 8>,
    /// The kind, such as `TurnAngle`.
    pub kind: Text<44>,
}

/// What Plan tells Execute to do with its action.
#[interface]
pub enum PlanStep {
    /// Queue the action behind the others.
    Append,
    /// Cancel the running planned action and those that wait, then queue this one.
    Replace,
    /// Cancel the running planned action and those that wait; the action of this message is none.
    Clear,
}

/// A planned action on its way to Execute.
#[interface]
pub struct Planned {
    /// The epoch that the Plan saw; Execute drops what was planned before its latest reflex.
    pub epoch: u64,
    /// Counts the Plan's messages from 1; Execute reports how it ended by this number.
    pub ticket: u64,
    /// The action.
    pub action: ActionRequest,
    /// What to do with it.
    pub step: PlanStep,
    /// Not used.
    pub reserved: [u8; 7],
}

/// A reactive action on its way to Execute.
#[interface]
pub struct Reflex {
    /// The action.
    pub action: ActionRequest,
    /// The rank of the model that sends it; a higher one comes first.
    pub rank: i32,
    /// Not used.
    pub reserved: u32,
}

/// A ReactiveModel's place in the order of models.
#[interface]
#[derive(PartialEq)]
pub struct Rank {
    /// A higher one inhibits and preempts a lower one.
    pub rank: i32,
}

/// Why Execute refused a message; the answer that its sender sees.
#[interface]
#[repr(u16)]
pub enum RefusalReason {
    /// It was not refused.
    None,
    /// The robot has no action of that kind.
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
