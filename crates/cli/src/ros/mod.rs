//! Contents of a ROS 2 domain: nodes, topics and messages.

#[cfg(feature = "ros2")]
mod domain;
#[cfg(feature = "ros2")]
mod yaml;

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Subcommand, ValueEnum};

use crate::duration;
use crate::failure::Failure;

#[derive(Debug, Subcommand)]
pub enum RosVerb {
    /// List the nodes, topics and services of a domain
    List(RosListOptions),
    /// Print the messages of a topic
    Echo(RosEchoOptions),
    /// Measure the rate of a topic
    /// (exit code 7 outside --min and --max)
    Hz(RosRateOptions),
    /// Show the publishers and subscriptions of a topic, with their quality of service
    Info(RosInfoOptions),
}

#[derive(Debug, Args)]
pub struct RosListOptions {
    /// Print the list as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    domain: RosDomain,
}

#[derive(Debug, Args)]
pub struct RosEchoOptions {
    /// Topic, such as `/odom`
    topic: String,
    /// End after this many messages
    #[arg(long, value_name = "N")]
    count: Option<u64>,
    /// Maximum time to wait for a message (exit code 6 if none was received)
    #[arg(long, value_name = "TIME", value_parser = duration::parse)]
    timeout: Option<Duration>,
    /// File that defines the message, of a type that is not built in
    #[arg(long, value_name = "FILE.msg")]
    definition: Option<PathBuf>,
    /// Print each message as a line of JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    domain: RosDomain,
}

#[derive(Debug, Args)]
pub struct RosRateOptions {
    /// Topic, such as `/odom`
    topic: String,
    /// Duration of the measurement
    #[arg(long = "for", value_name = "TIME", default_value = "2s", value_parser = duration::parse)]
    time: Duration,
    /// Minimum rate, Hz
    #[arg(long, value_name = "HZ", value_parser = crate::number::hertz)]
    min: Option<f64>,
    /// Maximum rate, Hz
    #[arg(long, value_name = "HZ", value_parser = crate::number::hertz)]
    max: Option<f64>,
    /// Print the measurement as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    domain: RosDomain,
}

#[derive(Debug, Args)]
pub struct RosInfoOptions {
    /// Topic, such as `/odom`
    topic: String,
    /// File that defines the message,
    /// whose type hash is shown, of a type that is not built in
    #[arg(long, value_name = "FILE.msg")]
    definition: Option<PathBuf>,
    /// Print as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    domain: RosDomain,
}

#[derive(Debug, Args)]
pub struct RosDomain {
    /// Domain, 0 to 232 [default: ROS_DOMAIN_ID, else 0]
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u16).range(0..=232))]
    domain: Option<u16>,
    /// Middleware of the nodes; zenoh is that of rmw_zenoh
    #[arg(long, value_enum, default_value_t)]
    wire: RosWire,
    /// Router of Zenoh [default: tcp/localhost:7447]
    #[arg(long, value_name = "ENDPOINT")]
    router: Option<String>,
    /// Discover nodes on all networks of this machine,
    /// unencrypted, not only on this machine
    #[arg(long)]
    trusted: bool,
    /// Duration of the discovery of nodes
    #[arg(long, value_name = "TIME", default_value = "2s", value_parser = duration::parse)]
    wait: Duration,
}

/// Middleware of nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum RosWire {
    #[default]
    Dds,
    Zenoh,
}

/// Looks at a domain; returns the exit code.
#[cfg(feature = "ros2")]
pub fn ros(verb: &RosVerb) -> Result<u8, Failure> {
    match verb {
        RosVerb::List(options) => domain::list(options),
        RosVerb::Echo(options) => domain::echo(options),
        RosVerb::Hz(options) => domain::rate(options),
        RosVerb::Info(options) => domain::info(options),
    }
}

/// Explains how to get the missing feature.
#[cfg(not(feature = "ros2"))]
pub fn ros(_: &RosVerb) -> Result<u8, Failure> {
    Err(Failure::Ros {
        problem: "this program is built without ROS 2".into(),
        help: "build it with the feature `ros2`: cargo build --release --features ros2".into(),
        code: 2,
    })
}
