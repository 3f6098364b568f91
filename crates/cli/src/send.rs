//! Sending a message.

use clap::Args;
use clap_complete::ArgValueCompleter;
use serde_json::json;

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::{complete, output};

#[derive(Debug, Args)]
pub struct SendOptions {
    /// URL of a mailbox, such as `/mapper/strokes`; `slate tree` marks them
    #[arg(add = ArgValueCompleter::new(complete::of_properties))]
    url: String,

    /// Message as JSON with all fields
    message: String,

    /// Check only, send nothing
    #[arg(long)]
    dry_run: bool,

    /// Print the result as JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    agent: AgentOption,
}

/// Sends it, and tells what becomes of it within a second.
pub fn send(options: &SendOptions) -> Result<bool, Failure> {
    let message = serde_json::from_str(&options.message);
    let message = message.map_err(|error| Failure::Message { text: options.message.clone(), error })?;
    let status = options.agent.connect_to(&options.url)?.send(&options.url, message, options.dry_run)?;
    if options.json {
        output::json(&json!({"schema": "slate.send/1", "url": options.url, "status": status}));
        return Ok(true);
    }
    output::line(match status.as_str() {
        "done" => "done",
        "fits" => "the message is valid",
        _ => "sent; no reply within a second",
    });
    Ok(true)
}
