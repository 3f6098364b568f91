//! Properties, mailboxes and gates between two cycles, as they go into a snapshot.

use serde::{Deserialize, Serialize};
use slate_blackboard::bytes;
use slate_blackboard::channel::ChannelSnapshot;
use slate_blackboard::message::WaitingMessage;
use slate_safety::GateSnapshot;

/// Bytes, serialized as bytes and not as a list of numbers.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bytes(#[serde(with = "bytes")] pub Vec<u8>);

/// Values of a property.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PropertySnapshot {
    /// Name of its interface.
    pub interface: String,
    /// Schema of its interface.
    pub schema: u64,
    /// Values with their stamps, and the cursors of the readers.
    pub values: ChannelSnapshot,
}

/// Messages that wait.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct MailboxSnapshot {
    /// Number of messages collected.
    pub sequence: u64,
    /// Oldest first.
    pub messages: Vec<WaitingMessage>,
}

/// State of a gate, and its last published state.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ActuatorSnapshot {
    /// Possible commanders, as paths.
    pub commanders: Vec<String>,
    /// Index in the order of all outputs.
    pub index: u32,
    /// Gate.
    pub gate: GateSnapshot,
    /// Last published state of the gate.
    pub shown: Option<Bytes>,
    /// True if a command has passed since the last publication.
    pub fresh: bool,
}
