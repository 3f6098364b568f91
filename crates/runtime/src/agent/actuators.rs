//! The gates of the actuators, in the hands of people and tools.

use std::convert::Infallible;
use std::time::Duration;

use slate_module::Level;

use super::handle::AgentHandle;
use crate::recording::Change;

/// A stop waits no longer than this for the end of a cycle, and in lockstep alone: there it takes effect as soon as the world
/// goes on, and can be made again.
const TIMEOUT: Duration = Duration::from_millis(100);

/// Stops, resets and arms the gates.
pub(super) struct GateOperator<'c> {
    agent: &'c AgentHandle,
}

impl<'c> GateOperator<'c> {
    pub fn new(agent: &'c AgentHandle) -> Self {
        Self { agent }
    }

    /// Stops all actuators, until they are reset and armed.
    pub fn stop_actuators(&self, reason: &str) {
        self.with_actuators(Change::Stop { reason: reason.into() }, || {
            let now = self.agent.now();
            self.agent.shared.actuators().iter().for_each(|actuator| actuator.stop(reason, now));
        });
        self.agent.log(Level::Warn, &format!("the actuators are stopped: {reason}"));
    }

    /// Ends a stop.
    pub fn reset(&self) {
        self.with_actuators(Change::Reset, || {
            self.agent.shared.actuators().iter().for_each(|actuator| actuator.reset());
        });
        self.agent.say("the stop of the actuators is ended");
    }

    /// Lets commands through to the actuators; false when one is still stopped.
    pub fn arm(&self) -> bool {
        let armed = self.with_actuators(Change::Arm { actuator: None }, || {
            self.agent.shared.actuators().iter().filter(|actuator| !actuator.arm()).count() == 0
        });
        if armed {
            self.agent.say("the actuators are armed");
        }
        armed
    }

    /// Lets commands through to one actuator.
    pub fn arm_one(&self, actuator: &str) -> Option<bool> {
        let actuators = self.agent.shared.actuators();
        let meant = actuators.iter().find(|other| other.name() == actuator)?;
        let armed = self.with_actuators(Change::Arm { actuator: Some(actuator.into()) }, || meant.arm());
        if armed {
            self.agent.say(&format!("{actuator} is armed"));
        }
        Some(armed)
    }

    fn with_actuators<R>(&self, change: Change, make: impl FnOnce() -> R) -> R {
        let Ok(done) = self.agent.recorder.make_within(TIMEOUT, vec![change], || Ok::<_, Infallible>(make()));
        done
    }

    /// The actuators, each with why it is stopped, if it is.
    pub fn actuators(&self) -> Vec<(String, Option<String>)> {
        let actuators = self.agent.shared.actuators();
        actuators.iter().map(|actuator| (actuator.name().into(), actuator.stop_reason())).collect()
    }
}
