//! Control of a running replay.

use clap::Subcommand;
use slate::runtime::playback::{LoopSection, Order, PlaybackStatus};

use super::{ReplayRate, parse_factor};
use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::output;
use crate::recording::parse_offset;

#[derive(Debug, Subcommand)]
pub enum OrderVerb {
    /// Show the state of a replay
    Status {
        /// Print as JSON
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Pause a replay
    Pause(AgentOption),
    /// Resume a replay
    Resume(AgentOption),
    /// Step one or more cycles, then pause
    Step {
        /// Number of cycles
        #[arg(default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
        cycles: u64,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Seek to a time; each property takes its last value before it
    Seek {
        /// Seconds after the first value
        #[arg(value_parser = parse_offset)]
        time: u64,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Change the rate
    Rate {
        /// `realtime`, a factor, or `max`
        #[arg(value_parser = parse_factor, allow_hyphen_values = true)]
        rate: ReplayRate,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Repeat the section between two times; without times, stop repeating
    Loop {
        /// Start, seconds after the first value
        #[arg(value_parser = parse_offset, requires = "to")]
        from: Option<u64>,
        /// End, seconds after the first value
        #[arg(value_parser = parse_offset)]
        to: Option<u64>,
        #[command(flatten)]
        agent: AgentOption,
    },
}

/// Sends an order to the playback, and prints its status.
pub fn order(verb: &OrderVerb) -> Result<(), Failure> {
    let mut is_json = false;
    let (order, agent) = match verb {
        OrderVerb::Status { json, agent } => {
            is_json = *json;
            (Order::Status, agent)
        }
        OrderVerb::Pause(agent) => (Order::Pause, agent),
        OrderVerb::Resume(agent) => (Order::Resume, agent),
        OrderVerb::Step { cycles, agent } => (Order::Step(*cycles), agent),
        OrderVerb::Seek { time, agent } => (Order::Seek(*time), agent),
        OrderVerb::Rate { rate, agent } => (Order::Rate(rate.0), agent),
        OrderVerb::Loop { from, to, agent } => {
            let section = from.zip(*to).map(|(from, to)| LoopSection { from, to });
            (Order::Loop(section), agent)
        }
    };
    let status = agent.connect()?.replay(order)?;
    match is_json {
        true => output::document("slate.replay.status/1", &status),
        false => output::line(text(&status)),
    }
    Ok(())
}

/// Returns a line with the status of a playback.
fn text(status: &PlaybackStatus) -> String {
    let seconds = |time: u64| format!("{:.3} s", time as f64 * 1e-9);
    let mut text = format!("{}: {}", slate::runtime::printable(&status.file), seconds(status.time));
    text += &format!(" (of {} to {})", seconds(status.from), seconds(status.to));
    text += &match status.rate {
        None => ", as fast as it goes".into(),
        Some(1.0) => ", in real time".into(),
        Some(rate) => format!(", {rate} times real time"),
    };
    if let Some(LoopSection { from, to }) = status.section {
        text += &format!(", again and again from {} to {}", seconds(from), seconds(to));
    }
    if !status.modules.is_empty() {
        text += &format!(", with {}", status.modules.join(", "));
    }
    if status.is_paused {
        text += ", paused";
    }
    text
}
