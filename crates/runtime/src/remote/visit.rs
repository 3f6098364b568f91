//! What a connection of a tool has of its own.

use serde_json::Value as Json;
use slate_blackboard::interface::Value;

use super::desk::{Desk, Done, refusal, result};
use super::protocol::{ControlsEntry, HolderEntry, Refusal};
use super::trace::ToolTrace;
use crate::agent::{ControlsError, ControlsHolder, Teleoperation};
use slate_configuration::Mistake;

/// What a connection of a tool has of its own: the trace that it records, and the controls that it has. They end with the
/// connection, whatever became of the tool.
#[derive(Default)]
pub struct Visit {
    pub(super) trace: ToolTrace,
    pub(super) controls: Option<Teleoperation>,
}

impl std::fmt::Debug for Visit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Visit").field("has_controls", &self.has_controls()).finish_non_exhaustive()
    }
}

impl Visit {
    /// Whether the tool has the controls of an actuator.
    pub fn has_controls(&self) -> bool {
        self.controls.is_some()
    }

    /// Ends it: the controls are given back, and a trace is thrown away, unless it is the agent that ends.
    pub fn leave(self, agent_ends: bool) {
        let Self { trace, controls } = self;
        drop(controls);
        trace.leave(agent_ends);
    }
}

impl Desk {
    /// Gives a tool the controls of an actuator, in the place of those that it has.
    pub(super) fn take_controls(&self, visit: &mut Visit, actuator: &str, who: &str) -> Done {
        visit.controls = None;
        let who = if who.is_empty() { "a tool" } else { who };
        let taken = self.composer.take_controls(actuator, who).map_err(Refusal::from)?;
        let entry = ControlsEntry {
            actuator: taken.actuator().into(),
            interface: taken.descriptor().name.to_string(),
            hold: u64::try_from(Teleoperation::HOLD.as_millis()).unwrap_or(u64::MAX),
        };
        visit.controls = Some(taken);
        result(entry)
    }

    /// Commands what the tool has the controls of; how its gate stands.
    pub(super) fn command(&self, visit: &mut Visit, command: &Json) -> Done {
        let controls = visit.controls.as_mut().ok_or_else(no_controls)?;
        let value = serde_json::from_value::<Value>(command.clone()).map_err(|error| {
            refusal(format!("the command is no value: {error}"), "give an object, such as {\"left\": 1}")
        })?;
        controls.command(&value).map_err(|error| {
            let help = format!("a command is a {}", controls.descriptor().name);
            refusal(Mistake::Value.of(error.to_string()), &help)
        })?;
        self.gate(controls.actuator())
    }

    /// Lets go, and keeps the controls; how the gate stands.
    pub(super) fn release(&self, visit: &mut Visit) -> Done {
        let controls = visit.controls.as_mut().ok_or_else(no_controls)?;
        controls.release();
        self.gate(controls.actuator())
    }

    /// Who has the controls of what.
    pub(super) fn holders(&self) -> Done {
        let entry = |ControlsHolder { actuator, holder }: ControlsHolder| {
            let (holder, since) = holder.unzip();
            HolderEntry { actuator, holder, since }
        };
        result(self.composer.controls().into_iter().map(entry).collect::<Vec<_>>())
    }

    fn gate(&self, actuator: &str) -> Done {
        let newest = self.composer.board().read(&format!("{actuator}/gate")).ok().flatten();
        result(newest.map(|(value, _)| value))
    }
}

fn no_controls() -> Refusal {
    refusal("this connection has no controls", "begin with `controls/take`")
}

impl From<ControlsError> for Refusal {
    fn from(error: ControlsError) -> Self {
        let (mistake, help) = match &error {
            ControlsError::Unknown { .. } => (Mistake::Name, "name one of them"),
            ControlsError::Taken { .. } => {
                (Mistake::Held, "wait until they are given back; `slate api GET /leases` shows who has which")
            }
        };
        refusal(mistake.of(error.to_string()), help)
    }
}
