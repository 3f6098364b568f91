//! Actuators that let no command through.

use serde::Serialize;
use slate::runtime::remote::{Client, ClientError};

/// The actuators of an agent that get safe commands alone.
#[derive(Debug, Default, Serialize)]
pub struct Held {
    /// Those that are stopped.
    pub stopped: Vec<String>,
    /// Those that are not armed.
    pub disarmed: Vec<String>,
}

impl Held {
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

    /// What there is to say of them; nothing when all let commands through.
    pub fn words(&self) -> Option<String> {
        let of = |what: &str, names: &[String]| {
            (!names.is_empty()).then(|| format!("{what}: {}", names.join(", ")))
        };
        let words: Vec<_> =
            [of("stopped", &self.stopped), of("not armed", &self.disarmed)].into_iter().flatten().collect();
        (!words.is_empty()).then(|| words.join("; "))
    }
}
