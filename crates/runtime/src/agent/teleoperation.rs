//! Teleoperation of an actuator by a person.

use std::sync::Arc;
use std::time::Duration;

use slate_blackboard::channel::Writer;
use slate_blackboard::interface::{AccessError, Descriptor, Value, edit};
use slate_module::Level;

use super::handle::{AgentHandle, WeakHandle};
use slate_engine::actuators::{Actuator, Holder};
use slate_engine::clock::monotonic;

/// Exclusive control of one actuator, until this is dropped.
///
/// The gate receives the command in each cycle of the main loop, with the precedence of teleoperation: above the plan
/// and below a reflex. The command ends [`COMMAND_DURATION`](Teleoperation::COMMAND_DURATION) after the last
/// [`command`](Teleoperation::command), by the agent's own clock, even if the person, the connection or the
/// commanding thread fails.
pub struct Teleoperation {
    agent: WeakHandle,
    actuator: Arc<Actuator>,
    /// Writer of the commands; `None` once this is dropped.
    writer: Option<Writer>,
    command: Vec<u8>,
}

impl std::fmt::Debug for Teleoperation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Teleoperation").field("actuator", &self.actuator()).finish_non_exhaustive()
    }
}

/// Error of taking an actuator's controls.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ControlsError {
    /// Unknown actuator.
    #[error("no actuator is called `{name}`; available: {}", known.join(", "))]
    Unknown {
        /// Requested name.
        name: String,
        /// Known names.
        known: Vec<String>,
    },
    /// The controls are taken.
    #[error("`{name}` is controlled by {by}; wait until that lease ends")]
    Taken {
        /// The actuator.
        name: String,
        /// Holder of the controls.
        by: String,
    },
}

/// Error of a command.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CommandError {
    /// Value of another interface.
    #[error(transparent)]
    Value(#[from] AccessError),
    /// Missing fields that must not be zero: a robot would turn with one wheel.
    #[error("it lacks {}", .0.join(", "))]
    Incomplete(Vec<&'static str>),
}

/// Actuator and the holder of its controls.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ControlsHolder {
    /// The actuator.
    pub actuator: String,
    /// Holder and time since which it holds them, ns; `None` if they are free.
    /// In the agent's time.
    pub holder: Option<(String, u64)>,
}

/// Keeper of the actuators' controls.
pub(super) struct ControlsRegistry<'c> {
    agent: &'c AgentHandle,
}

impl<'c> ControlsRegistry<'c> {
    pub fn new(agent: &'c AgentHandle) -> Self {
        Self { agent }
    }

    /// Takes the controls of an actuator.
    pub fn take_controls(&self, actuator: &str, who: &str) -> Result<Teleoperation, ControlsError> {
        let actuators = self.agent.shared.actuators();
        let Some(found) = actuators.iter().find(|known| known.name() == actuator) else {
            let known = actuators.iter().map(|known| known.name().to_owned()).collect();
            return Err(ControlsError::Unknown { name: actuator.into(), known });
        };
        let holder = Holder { who: who.into(), since: self.agent.now() };
        let writer = found.take_controls(holder);
        let writer = writer.map_err(|by| ControlsError::Taken { name: actuator.into(), by })?;
        self.agent.recorder.record_unrepeatable("teleoperation");
        self.agent.log(Level::Warn, &format!("a person takes the controls of {actuator}: {who}"));
        let command = vec![0; found.size()];
        let (agent, actuator) = (self.agent.downgrade(), Arc::clone(found));
        Ok(Teleoperation { agent, actuator, writer: Some(writer), command })
    }

    /// The actuators, each with the holder of its controls.
    pub fn controls(&self) -> Vec<ControlsHolder> {
        let of = |actuator: &Arc<Actuator>| ControlsHolder {
            actuator: actuator.name().into(),
            holder: actuator.holder().map(|holder| (holder.who, holder.since)),
        };
        self.agent.shared.actuators().iter().map(of).collect()
    }
}

impl Teleoperation {
    /// Time for which a command holds unless it is renewed.
    pub const COMMAND_DURATION: Duration = Duration::from_millis(150);

    /// Name of the actuator.
    pub fn actuator(&self) -> &str {
        self.actuator.name()
    }

    /// The interface of its commands.
    pub fn descriptor(&self) -> &'static Descriptor {
        self.actuator.descriptor()
    }

    /// Commands the actuator from the next cycle on.
    /// The command holds for [`COMMAND_DURATION`](Teleoperation::COMMAND_DURATION) or until the next command.
    ///
    /// # Errors
    /// When the value is not of the actuator's interface or lacks one of its fields; the command before holds on then.
    pub fn command(&mut self, value: &Value) -> Result<(), CommandError> {
        let mut command = self.command.clone();
        edit(self.descriptor(), &mut command, 0, "", value)?;
        let fields = self.descriptor().fields.iter().map(|field| field.name);
        let missing: Vec<_> =
            fields.filter(|name| *name != "reserved" && value.get(name).is_none()).collect();
        if !missing.is_empty() {
            return Err(CommandError::Incomplete(missing));
        }
        self.command = command;
        let hold = u64::try_from(Self::COMMAND_DURATION.as_nanos()).unwrap_or(u64::MAX);
        self.write(monotonic().saturating_add(hold));
        Ok(())
    }

    /// Releases the controls.
    /// From the next cycle on the actuator receives the plan's command, or its safe one.
    pub fn release(&mut self) {
        self.command.fill(0);
        self.write(0);
    }

    fn write(&mut self, until: u64) {
        if let Some(writer) = &mut self.writer {
            // No reader of it can make a writer wait.
            let _ = writer.write(&self.command, 0, until);
        }
    }
}

impl Drop for Teleoperation {
    fn drop(&mut self) {
        self.release();
        if let Some(writer) = self.writer.take() {
            self.actuator.release_controls(writer);
        }
        if let Some(agent) = self.agent.upgrade() {
            agent.say(&format!("control lease of {} released", self.actuator()));
        }
    }
}
