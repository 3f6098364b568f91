//! Control of the actuators' gates by people and tools.

use std::convert::Infallible;
use std::time::Duration;

use slate_module::Level;

use super::handle::AgentHandle;
use crate::recording::Change;

/// Longest wait of a stop for the end of a cycle, in lockstep only.
/// There the stop takes effect at the next cycle, so a rerun reproduces it.
const TIMEOUT: Duration = Duration::from_millis(100);

/// Control of the gates: stop, reset and arm.
pub(super) struct GateOperator<'c> {
    agent: &'c AgentHandle,
}

impl<'c> GateOperator<'c> {
    pub fn new(agent: &'c AgentHandle) -> Self {
        Self { agent }
    }

    /// Stops all actuators, until they are reset and armed.
    pub fn stop_actuators(&self, reason: &str) {
        let change = Change::Stop { reason: reason.into() };
        let Ok(()) = self.agent.recorder.make_within(TIMEOUT, vec![change], || {
            let now = self.agent.now();
            self.agent.shared.actuators().iter().for_each(|actuator| actuator.stop(reason, now));
            Ok::<_, Infallible>(())
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

    /// Arms all actuators; false if one is still stopped.
    pub fn arm(&self) -> bool {
        let armed = self.with_actuators(Change::Arm { actuator: None }, || {
            self.agent.shared.actuators().iter().filter(|actuator| !actuator.arm()).count() == 0
        });
        if armed {
            self.agent.say("the actuators are armed");
        }
        armed
    }

    /// Arms one actuator.
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
        let Ok(done) = self.agent.recorder.make(vec![change], || Ok::<_, Infallible>(make()));
        done
    }

    /// Returns the actuators, each with the reason of its stop, if stopped.
    pub fn actuators(&self) -> Vec<(String, Option<String>)> {
        let actuators = self.agent.shared.actuators();
        actuators.iter().map(|actuator| (actuator.name().into(), actuator.stop_reason())).collect()
    }
}
