//! Web console of an agent that runs.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;
use slate::control::client::Request;
use slate::control::{BASE, Role};
#[cfg(feature = "console")]
use slate::runtime::printable;
use slate_run::open_browser;

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::output;
#[cfg(feature = "console")]
use crate::output::counted;
use crate::role;

#[derive(Debug, Args)]
pub struct ConsoleOptions {
    /// Open it in a browser
    #[arg(long)]
    open: bool,

    /// Rights of the link [default: the highest]
    #[arg(long, value_parser = role::parser())]
    role: Option<Role>,

    /// Write a page that plays a run without an agent into a folder:
    /// the last seconds of the agent, or a recording
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["open", "role"])]
    export: Option<PathBuf>,

    /// Recording to export, or the folder of a run
    #[arg(requires = "export")]
    recording: Option<PathBuf>,

    /// Maximum rate of the exported values, Hz
    #[arg(long, value_name = "HZ", default_value_t = 20.0, value_parser = parse_rate, requires = "export")]
    rate: f64,

    /// Print the result as JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    agent: AgentOption,
}

fn parse_rate(text: &str) -> Result<f64, String> {
    let rate = text.parse::<f64>().ok().filter(|rate| (0.1..=1000.0).contains(rate));
    rate.ok_or_else(|| "expected a rate from 0.1 to 1000 Hz".into())
}

/// Prints the link, which has a secret in it, or exports a run.
pub fn console(options: &ConsoleOptions) -> Result<bool, Failure> {
    if let Some(folder) = &options.export {
        return export(folder, options.recording.as_deref(), options.rate, options);
    }
    let access = options.agent.over_http(options.role)?;
    // The part behind # stays in the browser.
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

#[cfg(feature = "console")]
fn export(
    folder: &Path,
    recording: Option<&Path>,
    rate: f64,
    options: &ConsoleOptions,
) -> Result<bool, Failure> {
    let page = crate::export::export(folder, recording, rate, || options.agent.connect())?;
    let file = printable(&page.file);
    match options.json {
        true => output::json(&json!({
            "schema": "slate.console.export/1", "file": page.file, "bytes": page.size,
            "properties": page.properties, "values": page.values,
        })),
        false => output::line(format_args!(
            "{file} has {} of {}, {:.1} MB: open it in a browser",
            counted(page.values as u64, "value", "values"),
            counted(page.properties as u64, "property", "properties"),
            page.size as f64 * 1e-6
        )),
    }
    Ok(true)
}

#[cfg(not(feature = "console"))]
fn export(_: &Path, _: Option<&Path>, _: f64, _: &ConsoleOptions) -> Result<bool, Failure> {
    Err(Failure::NotBuilt { what: "the console".into(), feature: "console" })
}
