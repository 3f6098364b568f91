//! Failures of commands: message, exit code and hint.

mod help;
mod print;
mod usage;

use std::path::PathBuf;

use slate::control::client::{AccessFailure, HttpRefusal, RequestError};
use slate::control::{ClientError, OpenError};
use slate::replay::PlayError;
use slate::runtime::configuration::Report;
use slate::runtime::memory::MemoryError;
use slate::runtime::plugin::LibraryError;
use slate::runtime::snapshot::SnapshotError;
use slate::runtime::{ErrorCode, StartError};
use slate_robotics_cli::examples::ExampleError;
use slate_run::RunError;

use crate::condition::ConditionError;

/// Exit code: the agent can't be reached, or does not answer.
pub const UNREACHED: u8 = 3;

/// Exit code: unknown name.
pub const UNKNOWN: u8 = 4;

/// Exit code: the agent refuses the request.
const REFUSED: u8 = 5;

/// Exit code: no value or event in time.
pub const TIMED_OUT: u8 = 6;

/// Exit code: the property has no value yet.
pub const NO_DATA: u8 = TIMED_OUT;

/// Exit code: a check failed.
pub const ASSERTION_FALSE: u8 = 7;

/// Error of a command.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    #[error("{}", usage::message(.0))]
    Words(clap::Error),
    #[error("unexpected option `{option}` before the command")]
    Leading { option: String, near: Option<String>, verb: Option<String> },
    /// Error of finding an application that no other verb has.
    #[error("{0}")]
    Example(ExampleError),
    #[error("the last seed of the batch is greater than {}", i64::MAX)]
    Seeds,
    #[error("{0}")]
    Configuration(#[from] Report),
    #[error("{0}")]
    Start(StartError),
    #[error("{0}")]
    Report(slate::report::Error),
    #[cfg(feature = "evaluate")]
    #[error("{0}")]
    Data(#[from] slate_evaluation::DataError),
    #[error("{what} is not built in")]
    NotBuilt { what: String, feature: &'static str },
    #[error("{0}")]
    Map(#[from] slate_map_file::MapFileError),
    #[cfg(feature = "lua")]
    #[error("{0}")]
    Skills(#[from] slate_behavior::BehaviorError),
    #[cfg(feature = "missions")]
    #[error("{0}")]
    Net(#[from] slate_petri_net::NetError),
    #[cfg(feature = "missions")]
    #[error("{0}")]
    Golog(#[from] slate_golog::GologError),
    #[cfg(feature = "missions")]
    #[error("{0}")]
    Tree(#[from] slate_behavior_tree::TreeError),
    #[error("{0}")]
    Record(#[from] slate::record::RecordError),
    #[error("{0}")]
    Bag(#[from] slate::bag::Error),
    #[cfg(feature = "console")]
    #[error("{0}")]
    Console(#[from] slate::console::StartError),
    #[error("{0}")]
    Play(PlayError),
    /// Error of a run that no other verb has.
    #[error("{0}")]
    Run(RunError),
    #[error("a batch needs a simulator: `{name}` has no time source and runs on the wall clock")]
    BatchOnWallClock { name: String },
    #[error("a batch needs a mission, which ends its runs: `{name}` has none")]
    BatchWithoutMission { name: String },
    #[error("a snapshot belongs to one agent, and the file describes several: {}", .agents.join(", "))]
    SeveralResumed { agents: Vec<String> },
    #[error("the agent `{agent}` can't be started: {source}")]
    Process { agent: String, source: std::io::Error },
    #[error("no agent is running")]
    NoAgent,
    #[error("several agents are running: {}", .running.join(", "))]
    SeveralAgents { running: Vec<String> },
    #[error("agent `{name}` is not running here, and is unknown to the running agents: {}", .running.join(", "))]
    Unmet { name: String, running: Vec<String> },
    #[error("{0}")]
    Agent(#[from] ClientError),
    #[error("{0}")]
    Unreachable(OpenError),
    #[error("{0}")]
    Library(#[from] LibraryError),
    #[error("{0}")]
    Snapshot(SnapshotError),
    #[error("{0}")]
    Memory(#[from] MemoryError),
    #[error("`{name}` can't be the name of a {what}: {reason}")]
    ProjectName { name: String, what: &'static str, reason: &'static str },
    #[error("`{module}` is neither a recorded module nor a kind of module")]
    NoModule { module: String, help: String },
    #[error("`{agent}` has not confirmed that its actuators are stopped: {reason}")]
    NotStopped { agent: String, reason: String },
    #[error("no plugin `{name}` is loaded")]
    NotLoaded { name: String },
    #[error("no module is called `{name}`")]
    UnknownModule { name: String, known: Vec<String> },
    #[error("no property matches `{pattern}`")]
    NothingLike { pattern: String },
    #[error("no property is at, below or like `{pattern}`")]
    NothingBelow { pattern: String, above: String, missing: String, names: Vec<String> },
    #[error("`--csv` takes one property, not several: {}", .urls.join(", "))]
    SeveralInTable { urls: Vec<String> },
    #[cfg(feature = "console")]
    #[error("agent `{agent}` keeps no values to export: its flight recorder is off")]
    NothingToExport { agent: String },
    #[error("agent `{agent}` has no HTTP address")]
    NoConsole { agent: String },
    #[error("{0}")]
    Network(#[from] AccessFailure),
    #[error("{detail}")]
    Http { status: u16, detail: String, help: String, code: Option<String> },
    #[error("{}", no_goal(.found, .of.as_deref()))]
    NoGoal { found: Vec<String>, of: Option<String>, others: Vec<String>, unread: Vec<String> },
    #[error("the goal is outside the world, which extends from {minimum:?} to {maximum:?} m")]
    GoalOutside { minimum: [f64; 2], maximum: [f64; 2] },
    #[error("{}", no_actuator(.known))]
    NoActuator { known: Vec<String> },
    #[error("`{actuator}` takes {interface}; the keyboard can command {}", .known.join(", "))]
    NoKeys { actuator: String, interface: String, known: Vec<&'static str> },
    #[error("the wheel radius and track of `{actuator}` are unknown")]
    NoChassis { actuator: String },
    #[error("`{text}` is not a goal: expected {expected}")]
    GoalWord { text: String, expected: String },
    #[error("no robot here has places and missions: it takes a goal of two numbers alone")]
    NoNavigation,
    #[error("the goal of `{module}` takes no heading")]
    NoHeading { module: String },
    #[error("the robot would move without a person at the terminal")]
    Unconfirmed,
    #[error("stdin is not a terminal, and teleoperation reads keys")]
    NoTerminal,
    #[error("cannot serve the Model Context Protocol: {reason}")]
    Mcp { reason: String, help: String },
    #[error("{problem}")]
    Ros { problem: String, help: String, code: u8 },
    #[error("`{text}` is not JSON")]
    Body { text: String },
    #[error("unknown graph format: {}", slate::runtime::printable(.path))]
    NoDrawing { path: PathBuf },
    #[error("`{text}` is not a message: expected TOML or JSON")]
    Message { text: String, url: String },
    #[error("unknown code `{code}`")]
    NoCode { code: String },
    #[error("{place}: {problem}")]
    Interface { place: String, problem: String },
    #[error("{url}: {problem}")]
    Condition { url: String, problem: ConditionError },
    #[error("{0}")]
    NoValue(String),
    #[error("`{to}` has no link")]
    NotLinked { to: String, linked: Vec<String> },
    #[error("`{path}` exists already")]
    Taken { path: PathBuf },
    #[error("`{}` is not a checkout of Slate", slate::runtime::printable(.given))]
    NoCheckout { given: PathBuf },
    #[error("no viewer is installed: PATH has no {}", .programs.join(", "))]
    NoViewer { programs: Vec<&'static str> },
    #[error("agent `{agent}` ended before the trace was complete")]
    TraceWithoutEnd { agent: String, left: Option<PathBuf> },
    #[error("`{path}` can't be used: {source}")]
    File { path: PathBuf, source: std::io::Error },
}

impl From<slate::report::Error> for Failure {
    fn from(error: slate::report::Error) -> Self {
        match error {
            slate::report::Error::Recording(error) => Self::Bag(error),
            error => Self::Report(error),
        }
    }
}

impl From<RunError> for Failure {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Configuration(report) => Self::Configuration(report),
            RunError::Start(error) => Self::Start(error),
            RunError::Report(error) => error.into(),
            RunError::Record(error) => Self::Record(error),
            #[cfg(feature = "console")]
            RunError::Console(error) => Self::Console(error),
            RunError::Unreachable(error) => Self::Unreachable(error),
            RunError::Snapshot(error) => Self::Snapshot(error),
            RunError::Memory(error) => Self::Memory(error),
            RunError::File { path, source } => Self::File { path, source },
            other => Self::Run(other),
        }
    }
}

impl From<ExampleError> for Failure {
    fn from(error: ExampleError) -> Self {
        match error {
            ExampleError::Configuration(report) => Self::Configuration(report),
            ExampleError::Library(error) => Self::Library(error),
            ExampleError::Snapshot(error) => error.into(),
            ExampleError::File { path, source } => Self::File { path, source },
            ExampleError::NotBuilt { what, feature } => Self::NotBuilt { what, feature },
            other => Self::Example(other),
        }
    }
}

impl From<StartError> for Failure {
    fn from(error: StartError) -> Self {
        match error {
            StartError::Configuration(report) => Self::Configuration(report),
            other => Self::Start(other),
        }
    }
}

impl From<PlayError> for Failure {
    fn from(error: PlayError) -> Self {
        match error {
            PlayError::Bag(error) => Self::Bag(error),
            PlayError::Configuration(report) => Self::Configuration(report),
            other => Self::Play(other),
        }
    }
}

impl From<SnapshotError> for Failure {
    fn from(error: SnapshotError) -> Self {
        match error {
            SnapshotError::Configuration(report) => Self::Configuration(report),
            other => Self::Snapshot(other),
        }
    }
}

fn no_goal(found: &[String], of: Option<&str>) -> String {
    match (found.is_empty(), of) {
        (true, Some(of)) => format!("`{of}` has no settable goal"),
        (true, None) => "no module has a settable goal".into(),
        (false, _) => format!("several modules have a settable goal: {}", found.join(", ")),
    }
}

fn no_actuator(known: &[String]) -> String {
    match known.is_empty() {
        true => "the agent has no actuators".into(),
        false => format!("several actuators: {}", known.join(", ")),
    }
}

impl Failure {
    /// Returns the exit code.
    /// 3 for an unreachable agent, 4 for an unknown name, 5 for a refusal, 6 for a timeout, else 2.
    pub fn code(&self) -> u8 {
        match self {
            Self::Agent(ClientError::Refused(_)) => match self.error_code() {
                Some(ErrorCode::Name | ErrorCode::Parameter | ErrorCode::Kind) => UNKNOWN,
                _ => REFUSED,
            },
            Self::Agent(_) | Self::NoAgent | Self::Unmet { .. } | Self::NotStopped { .. } => UNREACHED,
            Self::Network(AccessFailure::NoToken { .. }) => REFUSED,
            Self::Network(reason) if reason.is_callers() => 2,
            Self::NoConsole { .. } | Self::Network(_) => UNREACHED,
            Self::NotLinked { .. }
            | Self::NotLoaded { .. }
            | Self::UnknownModule { .. }
            | Self::NothingLike { .. }
            | Self::NothingBelow { .. }
            | Self::NoCode { .. } => UNKNOWN,
            Self::NoGoal { found: known, .. } | Self::NoActuator { known } if known.is_empty() => UNKNOWN,
            Self::GoalOutside { .. } => REFUSED,
            Self::Condition { problem: ConditionError::NoField(_), .. } => UNKNOWN,
            Self::NoValue(_) => NO_DATA,
            Self::Ros { code, .. } => *code,
            Self::Http { status: 404, .. } => UNKNOWN,
            Self::Http { .. } if self.error_code() == Some(ErrorCode::Name) => UNKNOWN,
            Self::Http { status: 408 | 504, .. } => TIMED_OUT,
            Self::Http { .. } => REFUSED,
            _ => 2,
        }
    }

    /// Returns the error code that `slate explain` describes, if it has one.
    fn error_code(&self) -> Option<ErrorCode> {
        match self {
            Self::Configuration(report) => report.error_code(),
            Self::Agent(ClientError::Refused(refusal)) => ErrorCode::from_code(refusal.code.as_deref()?),
            Self::Agent(ClientError::NoAgent { .. }) | Self::NoAgent | Self::Unmet { .. } => {
                Some(ErrorCode::NoAgent)
            }
            Self::Agent(ClientError::Lost { .. } | ClientError::InvalidAnswer { .. }) => {
                Some(ErrorCode::Silent)
            }
            Self::NotStopped { .. } => Some(ErrorCode::Silent),
            Self::Agent(ClientError::Version { .. }) => Some(ErrorCode::Version),
            Self::SeveralAgents { .. } => Some(ErrorCode::WhichAgent),
            Self::NotLinked { .. } | Self::NotLoaded { .. } | Self::UnknownModule { .. } => {
                Some(ErrorCode::Name)
            }
            Self::NothingLike { .. } | Self::NothingBelow { .. } => Some(ErrorCode::Name),
            Self::NoGoal { .. } | Self::NoActuator { .. } => Some(ErrorCode::Name),
            Self::Library(_) => Some(ErrorCode::Library),
            Self::Condition { problem: ConditionError::NoField(_), .. } => Some(ErrorCode::Name),
            Self::Condition { .. } | Self::GoalOutside { .. } => Some(ErrorCode::Value),
            Self::Http { code, .. } => ErrorCode::from_code(code.as_deref()?),
            _ => None,
        }
    }
}

impl From<HttpRefusal> for Failure {
    fn from(HttpRefusal { status, detail, help, code, .. }: HttpRefusal) -> Self {
        Self::Http { status, detail, help, code }
    }
}

impl From<RequestError> for Failure {
    fn from(error: RequestError) -> Self {
        match error {
            RequestError::AccessFailure(failure) => failure.into(),
            RequestError::HttpRefusal(denied) => denied.into(),
        }
    }
}
