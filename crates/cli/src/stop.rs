//! The software stop of a running agent.

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::output;

/// Stops all actuators.
pub fn stop(agent: &AgentOption, reason: &str) -> Result<bool, Failure> {
    agent.connect()?.stop(reason)?;
    output::line("all actuators are stopped, until `slate reset` and `slate arm`");
    Ok(true)
}

/// Ends a stop.
pub fn reset(agent: &AgentOption) -> Result<bool, Failure> {
    agent.connect()?.reset()?;
    output::line("the stop is over; `slate arm` lets commands through");
    Ok(true)
}

/// Lets commands through to the actuators.
pub fn arm(agent: &AgentOption) -> Result<bool, Failure> {
    agent.connect()?.arm()?;
    output::line("the actuators are armed");
    Ok(true)
}
