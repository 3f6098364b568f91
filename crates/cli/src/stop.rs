//! The software stop of a running agent.

use serde_json::json;

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::http::{BASE, Request};
use crate::output;

/// Stops all actuators.
pub fn stop(agent: &AgentOption, reason: &str) -> Result<bool, Failure> {
    match agent.elsewhere()? {
        // A request of its own, for which there is always a place.
        Some(access) => {
            let (path, body) = (format!("{BASE}/stop"), json!({ "reason": reason }).to_string());
            access.value(&Request {
                method: "POST",
                path: &path,
                body: Some(&body),
                ..Request::default()
            })?;
        }
        None => agent.connect()?.stop(reason)?,
    }
    output::line("all actuators are stopped, until `slate reset` and `slate arm`");
    Ok(true)
}

/// Ends a stop.
pub fn reset(agent: &AgentOption) -> Result<bool, Failure> {
    let was_stopped = agent.connect()?.reset()?;
    output::line(if was_stopped {
        "the stop is over; `slate arm` lets commands through"
    } else {
        "no actuator was stopped; which are armed stays as it is"
    });
    Ok(true)
}

/// Lets commands through to the actuators, or to one.
pub fn arm(agent: &AgentOption, actuator: Option<&str>) -> Result<bool, Failure> {
    agent.connect()?.arm(actuator)?;
    match actuator {
        Some(name) => output::line(format_args!("{name} is armed")),
        None => output::line("the actuators are armed"),
    }
    Ok(true)
}
