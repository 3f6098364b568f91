//! What is in a snapshot, by the names that the file has.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use slate_engine::{Bytes, FrozenActuator, FrozenMailbox, FrozenProperty};

use slate_configuration::{InferredLink, Layered};
use slate_engine::main_loop::FrozenLoop;
use slate_engine::runner::FrozenRunner;

/// An agent but for its code.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct SnapshotImage {
    /// The configuration as TOML: the sum of its layers.
    pub configuration: String,
    /// Its layers; nothing in snapshots of before.
    #[serde(default)]
    pub layers: Option<Layered>,
    /// The inferred links; nothing in snapshots of before, whose configuration has them.
    #[serde(default)]
    pub inferred: Option<Vec<InferredLink>>,
    pub clock: FrozenClock,
    pub main_loop: FrozenLoop,
    /// How many outputs were counted for the digest.
    pub outputs: u32,
    /// Log levels by module; the empty name is for all others.
    pub log_levels: BTreeMap<String, u32>,
    pub modules: BTreeMap<String, FrozenModule>,
    pub properties: BTreeMap<String, FrozenProperty>,
    /// Those whose receiver is not there.
    pub mailboxes: BTreeMap<String, FrozenMailbox>,
    pub actuators: BTreeMap<String, FrozenActuator>,
    /// The time of the next cycle, as a module has said.
    pub next_time: Option<u64>,
    /// What the application keeps beside the agent.
    pub keepsakes: BTreeMap<String, Bytes>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct FrozenClock {
    /// Whether a time source drives it.
    pub driven: bool,
    pub now: u64,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct FrozenModule {
    pub kind: String,
    pub ports: Vec<FrozenPort>,
    /// The schema of its parameters.
    pub params: u64,
    /// Nothing when there was no instance.
    pub state: Option<Bytes>,
    pub runner: FrozenRunner,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct FrozenPort {
    pub name: String,
    pub direction: u32,
    pub interface: String,
    pub schema: u64,
}
