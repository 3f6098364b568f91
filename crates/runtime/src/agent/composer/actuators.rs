//! The gates of the actuators, in the hands of people and tools.

use std::convert::Infallible;
use std::time::Duration;

use slate_module::Level;

use super::Composer;
use crate::recording::Change;

/// A stop waits no longer than this for the end of a cycle, and in lockstep alone: there it takes effect as soon as the world
/// goes on, and can be made again.
const PATIENCE: Duration = Duration::from_millis(100);

impl Composer {
    /// As [`Agent::stop_actuators`](crate::Agent::stop_actuators).
    pub fn stop_actuators(&self, reason: &str) {
        self.with_actuators(Change::Stop { reason: reason.into() }, || {
            let now = self.now();
            self.shared.actuators().iter().for_each(|actuator| actuator.stop(reason, now));
        });
        self.log(Level::Warn, &format!("the actuators are stopped: {reason}"));
    }

    /// As [`Agent::reset`](crate::Agent::reset).
    pub fn reset(&self) {
        self.with_actuators(Change::Reset, || {
            self.shared.actuators().iter().for_each(|actuator| actuator.reset());
        });
        self.say("the stop of the actuators is ended");
    }

    /// As [`Agent::arm`](crate::Agent::arm).
    pub fn arm(&self) -> bool {
        let armed = self.with_actuators(Change::Arm { actuator: None }, || {
            self.shared.actuators().iter().filter(|actuator| !actuator.arm()).count() == 0
        });
        if armed {
            self.say("the actuators are armed");
        }
        armed
    }

    /// Lets commands through to one actuator; false when it is still stopped, and nothing when there is none of that name.
    pub fn arm_one(&self, actuator: &str) -> Option<bool> {
        let actuators = self.shared.actuators();
        let meant = actuators.iter().find(|other| other.name() == actuator)?;
        let armed = self.with_actuators(Change::Arm { actuator: Some(actuator.into()) }, || meant.arm());
        if armed {
            self.say(&format!("{actuator} is armed"));
        }
        Some(armed)
    }

    fn with_actuators<R>(&self, change: Change, make: impl FnOnce() -> R) -> R {
        let Ok(done) = self.make_recorded_within(PATIENCE, vec![change], || Ok::<_, Infallible>(make()));
        done
    }

    /// The actuators, each with why it is stopped, if it is.
    pub fn actuators(&self) -> Vec<(String, Option<String>)> {
        let actuators = self.shared.actuators();
        actuators.iter().map(|actuator| (actuator.name().into(), actuator.stop_reason())).collect()
    }
}
