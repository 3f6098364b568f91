//! Content of a snapshot, with the names that the file has.

use serde::{Deserialize, Serialize};
use slate_engine::{ActuatorSnapshot, Bytes, MailboxSnapshot, PropertySnapshot};
use slate_sorted::SortedMap;

use slate_configuration::{InferredLink, Layered};
use slate_engine::main_loop::LoopSnapshot;
use slate_engine::runner::RunnerSnapshot;

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
    pub clock: ClockSnapshot,
    pub main_loop: LoopSnapshot,
    /// Number of outputs counted for the digest.
    pub outputs: u32,
    /// Log levels by module; the empty name is for all others.
    pub log_levels: SortedMap<String, u32>,
    pub modules: SortedMap<String, ModuleSnapshot>,
    pub properties: SortedMap<String, PropertySnapshot>,
    /// Mailboxes without a receiver.
    pub mailboxes: SortedMap<String, MailboxSnapshot>,
    pub actuators: SortedMap<String, ActuatorSnapshot>,
    /// Time of the next cycle, as a module has set it.
    pub next_time: Option<u64>,
    /// Content of the application.
    #[serde(rename = "keepsakes")]
    pub application_states: SortedMap<String, Bytes>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct ClockSnapshot {
    /// True if a time source drives it.
    pub driven: bool,
    pub now: u64,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct ModuleSnapshot {
    pub kind: String,
    pub ports: Vec<PortSnapshot>,
    /// Schema of the parameters.
    pub params: u64,
    /// State; `None` if the module had no instance.
    pub state: Option<Bytes>,
    pub runner: RunnerSnapshot,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct PortSnapshot {
    pub name: String,
    pub direction: u32,
    pub interface: String,
    pub schema: u64,
}
