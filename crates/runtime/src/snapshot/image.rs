//! Content of a snapshot, with the names that the file has.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use slate_engine::{Bytes, FrozenActuator, FrozenMailbox, FrozenProperty};

use slate_configuration::{InferredLink, Layered};
use slate_engine::main_loop::FrozenLoop;
use slate_engine::runner::FrozenRunner;

/// Agent without its code.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct SnapshotImage {
    /// Configuration as TOML, the sum of its layers.
    pub configuration: String,
    /// Layers; `None` in snapshots of earlier versions.
    #[serde(default)]
    pub layers: Option<Layered>,
    /// Inferred links.
    /// `None` in snapshots of earlier versions, whose configuration contains them.
    #[serde(default)]
    pub inferred: Option<Vec<InferredLink>>,
    pub clock: FrozenClock,
    pub main_loop: FrozenLoop,
    /// Number of outputs counted for the digest.
    pub outputs: u32,
    /// Log levels by module; the empty name is for all others.
    pub log_levels: BTreeMap<String, u32>,
    pub modules: BTreeMap<String, FrozenModule>,
    pub properties: BTreeMap<String, FrozenProperty>,
    /// Mailboxes without a receiver.
    pub mailboxes: BTreeMap<String, FrozenMailbox>,
    pub actuators: BTreeMap<String, FrozenActuator>,
    /// Time of the next cycle, as a module has set it.
    pub next_time: Option<u64>,
    /// Content of the application.
    pub keepsakes: BTreeMap<String, Bytes>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct FrozenClock {
    /// True if a time source drives it.
    pub driven: bool,
    pub now: u64,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct FrozenModule {
    pub kind: String,
    pub ports: Vec<FrozenPort>,
    /// Schema of the parameters.
    pub params: u64,
    /// State; `None` if the module had no instance.
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
