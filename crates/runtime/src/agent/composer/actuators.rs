//! The gates of the actuators, in the hands of people and tools.

use slate_module::Level;

use super::Composer;

impl Composer {
    /// As [`Agent::stop_actuators`](crate::Agent::stop_actuators).
    pub fn stop_actuators(&self, reason: &str) {
        let now = self.now();
        self.tell_recording("a stop of the actuators");
        self.shared.actuators().iter().for_each(|actuator| actuator.stop(reason, now));
        self.log(Level::Warn, &format!("the actuators are stopped: {reason}"));
    }

    /// As [`Agent::reset`](crate::Agent::reset).
    pub fn reset(&self) {
        self.tell_recording("the end of a stop of the actuators");
        self.shared.actuators().iter().for_each(|actuator| actuator.reset());
        self.say("the stop of the actuators is ended");
    }

    /// As [`Agent::arm`](crate::Agent::arm).
    pub fn arm(&self) -> bool {
        self.tell_recording("arming");
        let armed = self.shared.actuators().iter().filter(|actuator| !actuator.arm()).count() == 0;
        if armed {
            self.say("the actuators are armed");
        }
        armed
    }

    /// Lets commands through to one actuator; false when it is still stopped, and nothing when there is none of that name.
    pub fn arm_one(&self, actuator: &str) -> Option<bool> {
        self.tell_recording("arming");
        let armed = self.shared.actuators().iter().find(|other| other.name() == actuator)?.arm();
        if armed {
            self.say(&format!("{actuator} is armed"));
        }
        Some(armed)
    }

    /// The actuators, each with why it is stopped, if it is.
    pub fn actuators(&self) -> Vec<(String, Option<String>)> {
        let actuators = self.shared.actuators();
        actuators.iter().map(|actuator| (actuator.name().into(), actuator.stop_reason())).collect()
    }
}
