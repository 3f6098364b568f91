//! Other agents that a running agent knows.

use std::time::Duration;

use clap::Args;
use slate::control::{PeerEntry, PeerList};

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::output;

#[derive(Debug, Args)]
pub struct PeersOptions {
    /// Print the list as JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    agent: AgentOption,
}

/// Lists the peers, with the properties read in both directions.
pub fn peers(options: &PeersOptions) -> Result<bool, Failure> {
    let mut agent = options.agent.connect()?;
    let all = agent.peers()?;
    if options.json {
        output::document("slate.peers/1", &all);
        return Ok(true);
    }
    let PeerList { peers, rejected } = all;
    let head = ["agent", "endpoint", "connected", "round trip", "offset"].map(String::from);
    output::columns([head].into_iter().chain(peers.iter().map(row)));
    for peer in &peers {
        if peer.connected.is_none() && !peer.reason.is_empty() {
            output::line(format_args!("{}: {}", peer.agent, peer.reason));
        }
        for read in &peer.reads {
            let state = if read.served { "" } else { ", waits" };
            let reason = if read.reason.is_empty() { String::new() } else { format!(": {}", read.reason) };
            output::line(format_args!(
                "reads slate://{}/{}: {} came, {} lost{state}{reason}",
                peer.agent, read.path, read.received, read.lost
            ));
        }
        for served in &peer.serves {
            output::line(format_args!(
                "{} reads /{}: {} sent, {} waiting",
                peer.agent, served.path, served.sent, served.lag
            ));
        }
    }
    for one in &rejected {
        let times = if one.count == 1 { "once".into() } else { format!("{} times", one.count) };
        output::line(format_args!("rejected {times}: {}: {}", one.from, one.reason));
    }
    Ok(true)
}

fn row(peer: &PeerEntry) -> [String; 5] {
    let micros = |nanoseconds: i64| format!("{:.1} us", nanoseconds as f64 / 1e3);
    let connected = peer.connected.map(|time| format!("{:.1} s", Duration::from_nanos(time).as_secs_f64()));
    let is_there = peer.connected.is_some();
    [
        peer.agent.clone(),
        peer.endpoint.clone().unwrap_or_else(|| "it dials".into()),
        connected.unwrap_or_else(|| "no".into()),
        if is_there { micros(peer.round_trip.cast_signed()) } else { String::new() },
        if is_there { micros(peer.offset) } else { String::new() },
    ]
}
