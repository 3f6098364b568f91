//! Agent for language models, over the Model Context Protocol.

#[cfg(feature = "mcp")]
mod agent;
#[cfg(feature = "mcp")]
mod http;
#[cfg(feature = "mcp")]
mod serve;
#[cfg(feature = "mcp")]
mod tools;

use std::net::SocketAddr;

use clap::Args;
use slate::control::Role;

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::role;

#[derive(Debug, Args)]
pub struct McpOptions {
    /// Highest role of the model, whatever its token allows; a stop is always allowed
    #[arg(long, value_parser = role::parser(), default_value_t = Role::Viewer)]
    role: Role,

    /// Serve over HTTP instead of stdio; requests need a token of the agent
    /// [default address: 127.0.0.1:7879]
    #[arg(long, value_name = "IP:PORT", num_args = 0..=1, default_missing_value = "127.0.0.1:7879")]
    http: Option<SocketAddr>,

    #[command(flatten)]
    agent: AgentOption,
}

/// Serves an agent to a model, until stdin ends.
/// Over HTTP, until the program is interrupted.
#[cfg(feature = "mcp")]
pub fn mcp(options: &McpOptions) -> Result<bool, Failure> {
    match options.http {
        Some(address) => http::serve(&options.agent, options.role, address),
        None => serve::serve(agent::AgentAccess::new(&options.agent, options.role)?),
    }
}

/// Reports that the feature is not built in.
#[cfg(not(feature = "mcp"))]
pub fn mcp(McpOptions { role: _, http: _, agent: _ }: &McpOptions) -> Result<bool, Failure> {
    let help = "build it with the feature `mcp`: cargo build --release --features mcp".into();
    Err(Failure::Mcp { reason: "this program is built without it".into(), help })
}
