//! Actuators that let no command through.

use serde::Serialize;
use slate::control::{Client, ClientError};

/// Actuators of an agent that receive only safe commands.
#[derive(Debug, Default, Serialize)]
pub struct HeldActuators {
    /// Stopped actuators.
    pub stopped: Vec<String>,
    /// Disarmed actuators.
    pub disarmed: Vec<String>,
}

impl HeldActuators {
    /// Asks an agent.
    pub fn of(client: &mut Client) -> Result<Self, ClientError> {
        let mut held = Self::default();
        for gate in
            client.properties(Some("/**/gate"))?.into_iter().filter(|own| own.interface == "GateState")
        {
            let path = gate.path.trim_start_matches('/');
            let Some(state) = client.read(&format!("/{path}"))? else { continue };
            let name = path.trim_end_matches("/gate").to_owned();
            match state.value.get("mode").and_then(|mode| mode.as_str()) {
                Some("STOPPED") => held.stopped.push(name),
                Some("DISARMED") => held.disarmed.push(name),
                _ => {}
            }
        }
        Ok(held)
    }

    /// Describes them; `None` when no actuator is held.
    pub fn words(&self) -> Option<String> {
        let of = |what: &str, names: &[String]| {
            (!names.is_empty()).then(|| format!("{what}: {}", names.join(", ")))
        };
        let words: Vec<_> =
            [of("stopped", &self.stopped), of("not armed", &self.disarmed)].into_iter().flatten().collect();
        (!words.is_empty()).then(|| words.join("; "))
    }
}
