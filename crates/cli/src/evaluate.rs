//! Algorithms on public datasets.

#[cfg(feature = "evaluate")]
mod figures;

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

#[cfg(feature = "evaluate")]
pub use figures::evaluate;

#[cfg(not(feature = "evaluate"))]
use crate::failure::Failure;

#[derive(Debug, Subcommand)]
pub enum EvaluateVerb {
    /// A*, Theta* and D* Lite on the MovingAI benchmarks
    Planning(EvaluateOptions),

    /// Monte Carlo localization in a hospital and an office,
    /// and a Kalman filter on MRCLAM
    Localization(LocalizationOptions),

    /// SLAM on the log of the Intel Research Lab
    Slam(SlamOptions),

    /// Local planners in the worlds of the BARN challenge
    #[command(name = "local_planning")]
    LocalPlanning(LocalPlanningOptions),

    /// Exploration of Explore-Bench's buildings and a hospital
    Exploration(ExplorationOptions),
}

#[derive(Debug, Args)]
pub struct EvaluateOptions {
    /// Folder with the public datasets
    #[arg(long, value_name = "FOLDER")]
    // Without the feature the command says that first, and not that the folder is missing.
    #[cfg_attr(not(feature = "evaluate"), arg(default_value = "", hide_default_value = true))]
    data: PathBuf,

    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
pub struct LocalizationOptions {
    /// Folder with maps/hospital_section.png of Stage and mrclam;
    /// without it, in the office alone
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,

    /// Evaluate one method alone
    #[arg(long, value_enum)]
    method: Option<LocalizationMethod>,

    /// Number of starts from which an unknown pose is searched
    #[arg(long, value_name = "NUMBER", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    starts: u32,

    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
pub enum LocalizationMethod {
    /// Monte Carlo localization in buildings
    MonteCarlo,
    /// Extended Kalman filter on MRCLAM
    KalmanFilter,
}

#[derive(Debug, Args)]
pub struct SlamOptions {
    #[command(flatten)]
    common: EvaluateOptions,

    /// Method of SLAM
    #[arg(long, value_enum, default_value = "graph")]
    method: MethodArgument,

    /// Write the map, as ROS's map.yaml with an image beside it
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
#[value(rename_all = "snake_case")]
pub enum MethodArgument {
    /// Pose graph with loop closure
    Graph,
    /// Rao-Blackwellized particle filter
    ParticleFilter,
}

#[derive(Debug, Args)]
pub struct LocalPlanningOptions {
    #[command(flatten)]
    common: EvaluateOptions,

    /// Local planner
    #[arg(long, value_enum, default_value = "mppi")]
    planner: PlannerArgument,

    /// Seed of the laser's noise and of the planner
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum PlannerArgument {
    /// Model predictive path integral control
    Mppi,
    /// Dynamic window approach with the parameters published with the challenge
    Dwa,
}

#[derive(Debug, Args)]
pub struct ExplorationOptions {
    #[command(flatten)]
    common: EvaluateOptions,

    /// Number of starts in each building
    #[arg(long, value_name = "NUMBER", default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    starts: u32,
}

/// Reports that the feature is not built in.
#[cfg(not(feature = "evaluate"))]
pub fn evaluate(_verb: &EvaluateVerb) -> Result<u8, Failure> {
    Err(Failure::NotBuilt { what: "`slate evaluate`".into(), feature: "evaluate" })
}
