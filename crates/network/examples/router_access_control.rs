//! Generator of a router's access control from the configurations of its agents.
//! It writes `access_control` of `zenohd`: `cargo run -p slate-network --features zenoh --example router_access_control
//! -- base.toml arm.toml`

use std::error::Error;
use std::process::ExitCode;

use slate_network::{NetworkSettings, TABLE, router_access_control};
use slate_runtime::configuration::{Configuration, Options, extra_tables};

fn main() -> ExitCode {
    let agents: Result<Vec<_>, _> = std::env::args().skip(1).map(|file| read(&file)).collect();
    match agents {
        Ok(agents) => {
            let named: Vec<_> = agents.iter().map(|(name, settings)| (name.as_str(), settings)).collect();
            println!("{:#}", router_access_control(&named));
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// Reads the name and the network of the agent in a file.
fn read(file: &str) -> Result<(String, NetworkSettings), Box<dyn Error>> {
    let text = std::fs::read_to_string(file).map_err(|error| format!("{file} can't be read: {error}"))?;
    let mut tables = extra_tables(&text);
    tables.push(TABLE.into());
    let options = Options { extra_tables: tables, ..Options::default() };
    let configuration = Configuration::load(file, &options)?;
    let settings = NetworkSettings::of(&configuration)?;
    let settings = settings.ok_or_else(|| format!("{file} has no table [network]"))?;
    Ok((configuration.agent_name().into(), settings))
}
