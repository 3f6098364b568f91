//! Properties, mailboxes and gates between two cycles, as they go into a snapshot.

use serde::{Deserialize, Serialize};
use slate_blackboard::bytes;
use slate_blackboard::channel::Frozen;
use slate_blackboard::message::FrozenMessage;
use slate_safety::FrozenGate;

/// Bytes that are written as such.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bytes(#[serde(with = "bytes")] pub Vec<u8>);

/// The values of a property.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FrozenProperty {
    /// The name of its interface.
    pub interface: String,
    /// The schema of its interface.
    pub schema: u64,
    /// Its values with their stamps, and the cursors of its readers.
    pub values: Frozen,
}

/// Messages that wait.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FrozenMailbox {
    /// How many messages were collected.
    pub sequence: u64,
    /// Oldest first.
    pub messages: Vec<FrozenMessage>,
}

/// A gate, and what it showed.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FrozenActuator {
    /// Who may command it.
    pub commanders: Vec<String>,
    /// Its place in the order of all outputs.
    pub index: u32,
    /// The gate.
    pub gate: FrozenGate,
    /// What its state says, as it was written last.
    pub shown: Option<Bytes>,
    /// Whether its command was fresh.
    pub fresh: bool,
}
