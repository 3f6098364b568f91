//! An agent for language models, over the Model Context Protocol.

#[cfg(feature = "mcp")]
mod agent;
#[cfg(feature = "mcp")]
mod serve;
#[cfg(feature = "mcp")]
mod tools;

use crate::connection::AgentOption;
use crate::endpoint::Role;
use crate::failure::Failure;

/// Serves an agent to a model that may do so much, until stdin ends.
#[cfg(feature = "mcp")]
pub fn mcp(role: Role, agent: &AgentOption) -> Result<bool, Failure> {
    serve::serve(agent::Reach::new(agent, role)?)
}

/// Says how to get it.
#[cfg(not(feature = "mcp"))]
pub fn mcp(_: Role, _: &AgentOption) -> Result<bool, Failure> {
    let help = "build it with the feature `mcp`: cargo build --release --features mcp".into();
    Err(Failure::Mcp { reason: "this program is built without it".into(), help })
}
