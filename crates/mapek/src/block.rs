//! Common parts of all blocks.

use serde::{Serialize, de::DeserializeOwned};
use slate_module::{Direction, PortDescription, Refusal, Trigger};

/// State of a block between steps; the host saves, restores and forks it.
pub trait BlockState: Default + Serialize + DeserializeOwned + Send + 'static {}

impl<T: Default + Serialize + DeserializeOwned + Send + 'static> BlockState for T {}

/// Maximum period of a block that sends commands, nanoseconds.
pub(crate) const RENEWAL: u64 = 20_000_000;

/// Returns the trigger: new data at a chosen port, and the expiry of its value.
/// Without chosen ports it is every cycle.
pub(crate) fn on(ports: &[PortDescription], chosen: &dyn Fn(&PortDescription) -> bool) -> Trigger {
    let chosen: Vec<_> = ports
        .iter()
        .filter(|port| matches!(port.direction, Direction::Input | Direction::Queue | Direction::Inbox))
        .filter(|port| chosen(port))
        .collect();
    if chosen.is_empty() {
        return Trigger::Stage;
    }
    let timeout = chosen.iter().filter_map(|port| port.stale_after).min();
    Trigger::On { ports: chosen.iter().map(|port| port.name.clone()).collect(), timeout }
}

/// Refuses a block with two ports of one name.
/// This includes a port with the name of one of the framework.
pub(crate) fn distinct(ports: &[PortDescription]) -> Result<(), Refusal> {
    for (i, port) in ports.iter().enumerate() {
        if ports[..i].iter().any(|other| other.name == port.name) {
            return Err(format!(
                "there are two ports `{}`, of which one is the framework's: rename yours",
                port.name
            )
            .into());
        }
    }
    Ok(())
}
