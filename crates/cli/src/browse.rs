//! Web console of an agent that runs.

use clap::Args;
use serde_json::json;
use slate::control::client::Request;
use slate::control::{BASE, Role};
use slate_run::open_browser;

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::output;
use crate::role;

#[derive(Debug, Args)]
pub struct ConsoleOptions {
    /// Open it in a browser
    #[arg(long)]
    open: bool,

    /// Rights of the link [default: the highest]
    #[arg(long, value_parser = role::parser())]
    role: Option<Role>,

    /// Print the link as JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    agent: AgentOption,
}

/// Prints the link, which has a secret in it.
pub fn console(options: &ConsoleOptions) -> Result<bool, Failure> {
    let access = options.agent.over_http(options.role)?;
    // What stands behind # stays in the browser.
    let link = format!("{}/#token={}", access.browser, access.token);
    match options.json {
        true => {
            let path = format!("{BASE}/agent");
            let agent = access.value(&Request { method: "GET", path: &path, ..Request::default() })?;
            output::json(&json!({
                "schema": "slate.console/1", "agent": agent["name"], "address": access.address.to_string(),
                "role": agent["role"], "link": link,
            }));
        }
        false => output::line(&link),
    }
    if options.open {
        open_browser(&link)?;
    }
    Ok(true)
}
