//! Sending a message.

use clap::Args;
use clap_complete::ArgValueCompleter;
use serde_json::json;

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::{complete, output, value_input};

#[derive(Debug, Args)]
pub struct SendOptions {
    /// URL of an inbox, such as `/mapper/strokes`; `slate tree` marks them
    #[arg(add = ArgValueCompleter::new(complete::of_properties))]
    url: String,

    /// Message with all fields, as TOML such as `{ x = 1.5, y = 0.0 }`, or as JSON
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

/// Sends it, and prints its outcome within a second.
pub fn send(options: &SendOptions) -> Result<bool, Failure> {
    let message = value_input::parse(&options.message)
        .ok_or_else(|| Failure::Message { text: options.message.clone(), url: options.url.clone() })?;
    let mut client = options.agent.connect_to(&options.url)?;
    let status = client.send(&options.url, message, options.dry_run);
    let status = status.map_err(|error| value_input::refused(&mut client, "send", &options.url, error))?;
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
