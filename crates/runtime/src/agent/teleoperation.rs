//! A person at the controls of an actuator.

use std::sync::Arc;
use std::time::Duration;

use slate_blackboard::channel::Writer;
use slate_blackboard::interface::{AccessError, Descriptor, Value, edit};
use slate_module::Level;

use super::handle::{AgentHandle, WeakHandle};
use slate_engine::actuators::{Actuator, Holder};
use slate_engine::clock::monotonic;

/// The controls of one actuator. Nobody else has them as long as this lives.
///
/// What is commanded is offered to the gate in each cycle of the main loop, with the precedence of teleoperation: above the
/// plan and below a reflex. It ends [`HOLD`](Teleoperation::HOLD) after the last [`command`](Teleoperation::command), by the
/// agent's own clock, whatever became of the person, of the connection or of the thread that commands.
pub struct Teleoperation {
    agent: WeakHandle,
    actuator: Arc<Actuator>,
    /// There until this is dropped.
    writer: Option<Writer>,
    command: Vec<u8>,
}

impl std::fmt::Debug for Teleoperation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Teleoperation").field("actuator", &self.actuator()).finish_non_exhaustive()
    }
}

/// Why nobody gets the controls.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ControlsError {
    /// There is no such actuator.
    #[error("no actuator is called `{name}`; there are: {}", known.join(", "))]
    Unknown {
        /// What was asked for.
        name: String,
        /// What there is.
        known: Vec<String>,
    },
    /// Somebody has them.
    #[error("`{name}` is controlled by {by}; wait until that lease ends")]
    Taken {
        /// The actuator.
        name: String,
        /// Their holder.
        by: String,
    },
}

/// Why a command is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CommandError {
    /// The value is not of the actuator's interface.
    #[error(transparent)]
    Value(#[from] AccessError),
    /// A field that is missing must not be zero: a robot would turn with one wheel.
    #[error("it lacks {}", .0.join(", "))]
    Incomplete(Vec<&'static str>),
}

/// An actuator, and the holder of its controls.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ControlsHolder {
    /// The actuator.
    pub actuator: String,
    /// Their holder, and since when in nanoseconds of the agent's time; none when they are free.
    pub holder: Option<(String, u64)>,
}

/// Gives out the controls of actuators.
pub(super) struct ControlsKeeper<'c> {
    agent: &'c AgentHandle,
}

impl<'c> ControlsKeeper<'c> {
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
        self.agent.recorder.tell("teleoperation");
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
    /// For how long a command holds that is not renewed.
    pub const HOLD: Duration = Duration::from_millis(150);

    /// Name of the actuator.
    pub fn actuator(&self) -> &str {
        self.actuator.name()
    }

    /// The interface of its commands.
    pub fn descriptor(&self) -> &'static Descriptor {
        self.actuator.descriptor()
    }

    /// Commands it from the next cycle on, for [`HOLD`](Teleoperation::HOLD) or until the next command.
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
        let hold = u64::try_from(Self::HOLD.as_nanos()).unwrap_or(u64::MAX);
        self.write(monotonic().saturating_add(hold));
        Ok(())
    }

    /// Lets go: the actuator gets the plan's command, or its safe one, from the next cycle on.
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
            self.actuator.give_controls_back(writer);
        }
        if let Some(agent) = self.agent.upgrade() {
            agent.say(&format!("control lease of {} released", self.actuator()));
        }
    }
}
