//! What is said to a playback from another shell.

use clap::Subcommand;
use slate::runtime::playback::{LoopSection, Order, PlaybackStatus};

use super::{Factor, parse_factor};
use crate::bag::nanoseconds;
use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::output;

#[derive(Debug, Subcommand)]
pub enum OrderVerb {
    /// Says how a playback stands.
    Status {
        /// Prints it as JSON.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Lets a playback stand still.
    Pause(AgentOption),
    /// Lets it go on.
    Resume(AgentOption),
    /// Makes one cycle, or so many, and stands still.
    Step {
        /// How many cycles.
        #[arg(default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
        cycles: u64,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Goes on from another time: each property has the last value that it had then.
    Seek {
        /// Seconds after the first value.
        #[arg(value_parser = nanoseconds)]
        time: u64,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Goes at another rate.
    Rate {
        /// `realtime`, a factor, or `max`.
        #[arg(value_parser = parse_factor, allow_hyphen_values = true)]
        rate: Factor,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Plays what is between two times again and again; without times, no more.
    Loop {
        /// Where it begins, seconds after the first value.
        #[arg(value_parser = nanoseconds, requires = "to")]
        from: Option<u64>,
        /// Where it ends.
        #[arg(value_parser = nanoseconds)]
        to: Option<u64>,
        #[command(flatten)]
        agent: AgentOption,
    },
}

/// Has the playback do it, and says how it stands then.
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

/// A line that says how a playback stands.
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
