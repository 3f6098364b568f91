use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use clap::error::{ContextKind, ContextValue};
use serde_json::{Value, json};
use slate::blackboard::nearest_names;
use slate::control::{ClientError, OpenError, Refusal};
use slate::record::replay::PlayError;
use slate::runtime::configuration::Report;
use slate::runtime::memory::MemoryError;
use slate::runtime::plugin::LibraryError;
use slate::runtime::snapshot::SnapshotError;
use slate::runtime::{Mistake, StartError};

use crate::arguments::MAXIMUM_SEED;
use crate::check::finding;
use crate::condition::Unfit;
use crate::output;
use slate::control::client::{Denied, RequestError, Trouble};

/// The agent is not there, or does not answer.
pub const UNREACHED: u8 = 3;

/// There is nothing of that name.
const UNKNOWN: u8 = 4;

/// The agent does not do it.
const REFUSED: u8 = 5;

/// What was waited for did not come.
pub const TIMED_OUT: u8 = 6;

/// There is no value yet, as when what was waited for did not come.
pub const NO_DATA: u8 = TIMED_OUT;

/// What was to be so is not so.
pub const ASSERTION_FALSE: u8 = 7;

/// Why a command can't do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    #[error("{}", said(.0).0)]
    Words(clap::Error),
    #[error("there is no option `{option}` before a verb")]
    Leading { option: String, near: Option<String>, verb: Option<String> },
    #[error("no example and no file is called `{name}`")]
    Unknown { name: String, help: String },
    #[error("`{}` is a folder, and no configuration", .path.display())]
    Folder { path: PathBuf, inside: Option<PathBuf> },
    #[error("`{}` is a pipe or a device, and a configuration is read more than once", .path.display())]
    Unseekable { path: PathBuf },
    #[error("the last seed of the batch is greater than {MAXIMUM_SEED}")]
    Seeds,
    #[error("{0}")]
    Configuration(#[from] Report),
    #[error("{0}")]
    Start(StartError),
    #[error("{0}")]
    Report(#[from] slate::record::Error),
    #[error("{0}")]
    Record(#[from] slate::record::RecordError),
    #[error("{0}")]
    Bag(#[from] slate::record::bag::Error),
    #[cfg(feature = "console")]
    #[error("{0}")]
    Console(#[from] slate::console::StartError),
    #[error("{0}")]
    Play(PlayError),
    #[error("{0}")]
    World(String),
    #[error("without a simulator the agent runs on the wall clock, which goes by itself")]
    WallClock,
    #[error("a batch is of runs in a simulator, and `{name}` runs on the wall clock: it has no time source")]
    BatchOnWallClock { name: String },
    #[error("a snapshot is that of one agent, and the file describes several: {}", .agents.join(", "))]
    SeveralResumed { agents: Vec<String> },
    #[error("the agent `{agent}` can't be started: {source}")]
    Process { agent: String, source: std::io::Error },
    #[error("no agent runs here")]
    NoAgent,
    #[error("several agents run here: {}", .running.join(", "))]
    SeveralAgents { running: Vec<String> },
    #[error("no agent `{name}` runs here, and none of those that do knows it: {}", .running.join(", "))]
    Unmet { name: String, running: Vec<String> },
    #[error(
        "`--set {set}` has no effect: a snapshot has the settings of its variant, and this chooses no other one"
    )]
    OtherVariant { set: String },
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
    #[error("no recorded module and no type of modules is called `{module}`")]
    NoModule { module: String, help: String },
    #[error("`{agent}` has not confirmed that its actuators are stopped: {trouble}")]
    NotStopped { agent: String, trouble: String },
    #[error("no plugin `{name}` is loaded")]
    NotLoaded { name: String },
    #[error("no property is like {pattern}")]
    NothingLike { pattern: String },
    #[error("a table with commas is of one property, and these are several: {}", .urls.join(", "))]
    SeveralInTable { urls: Vec<String> },
    #[error("agent `{agent}` is not reached over HTTP")]
    NoConsole { agent: String },
    #[error("{0}")]
    Network(#[from] Trouble),
    #[error("{detail}")]
    Http { status: u16, detail: String, help: String, code: Option<String> },
    #[error("{}", no_goal(.found, .of.as_deref()))]
    NoGoal { found: Vec<String>, of: Option<String>, others: Vec<String>, unread: Vec<String> },
    #[error("the goal is outside of the world, which goes from {minimum:?} to {maximum:?} m")]
    GoalOutside { minimum: [f64; 2], maximum: [f64; 2] },
    #[error("{}", no_actuator(.known))]
    NoActuator { known: Vec<String> },
    #[error("`{actuator}` takes {interface}, and keys are known for {}", .known.join(", "))]
    NoKeys { actuator: String, interface: String, known: Vec<&'static str> },
    #[error("nothing tells how large the wheels are that `{actuator}` drives")]
    NoChassis { actuator: String },
    #[error("the goal of `{module}` has no heading")]
    NoHeading { module: String },
    #[error("the robot would move, and nobody is at a terminal")]
    Unconfirmed,
    #[error("keys are read from a terminal, and there is none")]
    NoTerminal,
    #[error("the Model Context Protocol can't be spoken: {reason}")]
    Mcp { reason: String, help: String },
    #[error("`{text}` is no body")]
    Body { text: String },
    #[error("no drawing is written into {}", slate::runtime::printable(.path))]
    NoDrawing { path: PathBuf },
    #[error("`{text}` is no message: {error}")]
    Message { text: String, error: serde_json::Error },
    #[error("no kind of mistake has the code `{code}`")]
    NoCode { code: String },
    #[error("{place}: {problem}")]
    Interface { place: String, problem: String },
    #[error("{url}: {problem}")]
    Condition { url: String, problem: Unfit },
    #[error("{0}")]
    NoValue(String),
    #[error("`{to}` has no link")]
    NotLinked { to: String, linked: Vec<String> },
    #[error("another run writes its report into {}", slate::runtime::printable(.path))]
    FolderInUse { path: PathBuf },
    #[error("`{path}` can't be used: it is there already")]
    Taken { path: PathBuf },
    #[error("{}", no_checkout(.said.as_deref()))]
    NoCheckout { said: Option<PathBuf> },
    #[error("agent `{agent}` has ended without finishing the trace")]
    TraceWithoutEnd { agent: String, left: Option<PathBuf> },
    #[error("`{path}` can't be used: {source}")]
    File { path: PathBuf, source: std::io::Error },
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

/// What is wrong with the words of a command, and how it is meant.
fn said(error: &clap::Error) -> (String, String) {
    let text = error.render().to_string();
    let text = text.strip_prefix("error: ").unwrap_or(&text);
    let (message, help) = text.split_once("\n\n").unwrap_or((text, ""));
    (message.trim().to_owned(), instead(error).map_or_else(|| help.trim().to_owned(), str::to_owned))
}

/// Which verb does what is looked for under the name of another one.
fn instead(error: &clap::Error) -> Option<&'static str> {
    let Some(ContextValue::String(verb)) = error.get(ContextKind::InvalidSubcommand) else { return None };
    Some(match verb.as_str() {
        "plot" => {
            "`slate bag plot FILE FIELD` draws values of a recording, `slate console` live ones, and `slate watch URL --csv` is \
             a table of them"
        }
        "param" | "params" | "parameter" | "parameters" => {
            "`slate tree '/**/params' --values` shows parameters, `slate set /MODULE/params/NAME VALUE` sets one, and \
             `slate config diff` and `save` show and keep what was changed"
        }
        "show" | "info" => "`slate get URL` shows a value, `slate tree` what there is, `slate ps` who runs",
        "start" | "launch" => "`slate run NAME` starts an agent",
        "topic" | "topics" => "`slate list` shows the properties, `slate watch URL` their values",
        _ => return None,
    })
}

fn no_goal(found: &[String], of: Option<&str>) -> String {
    match (found.is_empty(), of) {
        (true, Some(of)) => format!("`{of}` has no goal that can be set"),
        (true, None) => "no module has a goal that can be set".into(),
        (false, _) => format!("several goals can be set: {}", found.join(", ")),
    }
}

fn no_actuator(known: &[String]) -> String {
    match known.is_empty() {
        true => "the agent has no actuators".into(),
        false => format!("it has to be said which actuator: {}", known.join(", ")),
    }
}

fn no_checkout(said: Option<&Path>) -> String {
    match said {
        Some(said) => format!("{} is no folder of Slate's sources", slate::runtime::printable(said)),
        None => "Slate's sources were not found".into(),
    }
}

impl Failure {
    /// What the process ends with: 3 when the agent is not reached, 4 when there is nothing of that name, 5 when the agent
    /// refuses, 6 when it answers too late, else 2.
    pub fn code(&self) -> u8 {
        match self {
            Self::Agent(ClientError::Refused(_)) => match self.mistake() {
                Some(Mistake::Name | Mistake::Parameter | Mistake::Kind) => UNKNOWN,
                _ => REFUSED,
            },
            Self::Agent(_) | Self::NoAgent | Self::Unmet { .. } | Self::NotStopped { .. } => UNREACHED,
            Self::Network(Trouble::NoToken { .. }) => REFUSED,
            Self::Network(trouble) if trouble.is_callers() => 2,
            Self::NoConsole { .. } | Self::Network(_) => UNREACHED,
            Self::NotLinked { .. }
            | Self::NotLoaded { .. }
            | Self::NothingLike { .. }
            | Self::NoCode { .. } => UNKNOWN,
            Self::NoGoal { found: known, .. } | Self::NoActuator { known } if known.is_empty() => UNKNOWN,
            Self::GoalOutside { .. } => REFUSED,
            Self::Condition { problem: Unfit::NoField(_), .. } => UNKNOWN,
            Self::NoValue(_) => NO_DATA,
            Self::Http { status: 404, .. } => UNKNOWN,
            Self::Http { .. } if self.mistake() == Some(Mistake::Name) => UNKNOWN,
            Self::Http { status: 408 | 504, .. } => TIMED_OUT,
            Self::Http { .. } => REFUSED,
            _ => 2,
        }
    }

    /// Of which kind it is, if it has one.
    fn mistake(&self) -> Option<Mistake> {
        match self {
            Self::Configuration(report) => report.mistake(),
            Self::Agent(ClientError::Refused(refusal)) => Mistake::from_code(refusal.code.as_deref()?),
            Self::Agent(ClientError::NoAgent { .. }) | Self::NoAgent | Self::Unmet { .. } => {
                Some(Mistake::NoAgent)
            }
            Self::Agent(ClientError::Lost { .. } | ClientError::Nonsense { .. }) => Some(Mistake::Silent),
            Self::NotStopped { .. } => Some(Mistake::Silent),
            Self::Agent(ClientError::Version { .. }) => Some(Mistake::Version),
            Self::SeveralAgents { .. } => Some(Mistake::WhichAgent),
            Self::NotLinked { .. } | Self::NothingLike { .. } | Self::NotLoaded { .. } => Some(Mistake::Name),
            Self::NoGoal { .. } | Self::NoActuator { .. } => Some(Mistake::Name),
            Self::Library(_) => Some(Mistake::Library),
            Self::Condition { problem: Unfit::NoField(_), .. } => Some(Mistake::Name),
            Self::Condition { .. } | Self::GoalOutside { .. } => Some(Mistake::Value),
            Self::Http { code, .. } => Mistake::from_code(code.as_deref()?),
            _ => None,
        }
    }

    /// Says on stderr what is wrong, where, and what to do.
    pub fn print(&self) {
        if output::is_json() {
            return eprintln!("{}", self.document());
        }
        let colour = output::has_colour(&std::io::stderr());
        match self {
            Self::Words(error) => {
                // Nothing is left to tell it to when stderr is gone.
                let _ = error.print();
                if let Some(help) = instead(error) {
                    eprintln!("  help: {help}");
                }
            }
            Self::Configuration(report) => eprint!("{}", report.render(colour)),
            Self::Agent(ClientError::Refused(Refusal { report: Some(report), .. })) => eprint!("{report}"),
            other => {
                eprintln!("error: {}", output::harmless(other));
                if let Some(help) = other.help().filter(|help| !help.is_empty()) {
                    eprintln!("  help: {}", output::harmless(help));
                }
                if let Some(mistake) = other.mistake().filter(|_| std::io::stderr().is_terminal()) {
                    eprintln!("  more: slate explain {}", mistake.code());
                }
            }
        }
    }

    /// The same for programs, in a line.
    fn document(&self) -> Value {
        let (mut help, mut findings) = (self.help(), Vec::new());
        if let Self::Configuration(report) = self {
            findings.extend(report.diagnostics().iter().map(|one| finding("error", one)));
            help = findings.iter().find_map(|one| one.help.clone());
        }
        json!({
            "schema": "slate.error/1", "code": self.mistake().map(Mistake::code), "message": self.to_string(),
            "help": help.filter(|help| !help.is_empty()), "exit": self.code(), "findings": findings,
        })
    }

    fn help(&self) -> Option<String> {
        Some(match self {
            Self::Words(error) => said(error).1,
            Self::Leading { near, verb, .. } => {
                let meant = near.as_ref().map(|near| format!("did you mean `{near}`? ")).unwrap_or_default();
                let own = verb.as_ref().map(|verb| {
                    format!("; the options of `{verb}` stand behind it, and `slate {verb} --help` lists them")
                });
                format!(
                    "{meant}Before a verb there are --agent NAME, --color WHEN, --help and --version{}",
                    own.unwrap_or_default()
                )
            }
            Self::NotStopped { .. } => "stop the robot by its own switch".into(),
            Self::Unknown { help, .. } => help.clone(),
            Self::Folder { inside: Some(file), .. } => format!("name a file in it, such as `{}`", file.display()),
            Self::Folder { inside: None, .. } => "name a file, such as `robot.toml`".into(),
            Self::Unseekable { .. } => "write it into a file".into(),
            Self::Start(error) => miette::Diagnostic::help(error)?.to_string(),
            Self::Bag(slate::record::bag::Error::NoBag { .. }) => {
                let names: Vec<_> =
                    slate::record::logs::Format::ALL.iter().map(|format| format.name()).collect();
                format!(
                    "`slate bag import` makes one of a log of another system; known are {}",
                    names.join(", ")
                )
            }
            // Logs of other systems are not repaired.
            Self::Bag(slate::record::bag::Error::Damaged { path, .. })
                if !matches!(
                    slate::record::logs::recognise(path),
                    Ok(None | Some(slate::record::logs::Format::Mcap)) | Err(_)
                ) =>
            {
                format!(
                    "`slate bag import {} --lenient --out FILE.mcap` leaves out what is wrong, and counts it",
                    slate::runtime::printable(path)
                )
            }
            Self::Bag(slate::record::bag::Error::Line { path, .. }) => format!(
                "`slate bag import {} --lenient --out FILE.mcap` leaves out what is wrong, and counts it",
                slate::runtime::printable(path)
            ),
            Self::Bag(slate::record::bag::Error::Damaged { path, .. }) => format!(
                "`slate bag repair {}` makes a whole file of what is left of it; --out FILE keeps the damaged one",
                slate::runtime::printable(path)
            ),
            Self::WallClock => {
                "leave `--rate` out, or give the configuration a time source (`time.source`)".into()
            }
            Self::BatchOnWallClock { name } => format!(
                "`slate run {name}` runs it once; for a batch, give the configuration a simulator and make it the \
                 time source (`time.source`)"
            ),
            Self::Unreachable(error) => miette::Diagnostic::help(error)?.to_string(),
            Self::Snapshot(error) => miette::Diagnostic::help(error)?.to_string(),
            Self::Memory(error) => miette::Diagnostic::help(error)?.to_string(),
            #[cfg(feature = "console")]
            Self::Console(error) => miette::Diagnostic::help(error)?.to_string(),
            Self::NoAgent => "start one with `slate run`; it must be of the same user, and have the same \
                              XDG_RUNTIME_DIR"
                .into(),
            Self::SeveralAgents { running } => format!("choose one, such as --agent {}", running.first()?),
            Self::OtherVariant { .. } => "leave it out, or run the example without --resume".into(),
            Self::Unmet { .. } => {
                "`slate peers --agent NAME` shows whom an agent knows, and why they are not there".into()
            }
            Self::SeveralResumed { agents } => format!("name it, such as --agent {}", agents.first()?),
            Self::Agent(ClientError::Refused(refusal)) => refusal.help.clone(),
            Self::Agent(ClientError::NoAgent { name, running }) if !running.is_empty() => {
                let near = nearest_names(name, running.iter().map(String::as_str));
                let others = running.iter().filter(|name| !near.contains(name));
                let all: Vec<_> = near.iter().chain(others).map(String::as_str).collect();
                format!("there are: {}", all.join(", "))
            }
            Self::Agent(ClientError::NoAgent { .. }) => return Self::NoAgent.help(),
            Self::Agent(ClientError::Version { .. }) => "use the `slate` that runs the agent".into(),
            Self::Agent(_) => "look at the agent's log".into(),
            Self::Library(error) => error.help.clone(),
            Self::NoModule { help, .. } => help.clone(),
            Self::ProjectName { .. } => "choose another one, such as `wall-follower`".into(),
            Self::NotLoaded { .. } => {
                "`slate plugin list` shows those that are; of a list of plugins, name them one by one".into()
            }
            Self::NotLinked { linked, .. } if linked.is_empty() => "the agent has no links".into(),
            Self::NotLinked { to, linked } => {
                match nearest_names(to, linked.iter().map(String::as_str)).join(" or ") {
                    near if near.is_empty() => "`slate link` lists all links".into(),
                    near => format!("did you mean {near}?"),
                }
            }
            Self::NoConsole { agent } => format!(
                "it has no web console: start it without --headless, or with --set console.port=0 (a free port); of several \
                 agents of one file, the one with the mission has a console, or the first, unless [agents.{agent}.console] says so"
            ),
            Self::Network(trouble) => trouble.help(),
            Self::Http { help, .. } | Self::Mcp { help, .. } => help.clone(),
            Self::GoalOutside { .. } => {
                "choose a place in it, in metres; `slate set` sets any, as `slate tree '/**/params' --values` shows them".into()
            }
            Self::NoGoal { others, .. } if !others.is_empty() => {
                format!("such a goal have: {}", others.join(", "))
            }
            Self::NoGoal { found, unread, .. } if found.is_empty() && !unread.is_empty() => format!(
                "nobody reads the goals of {}, so to set them does nothing: these robots decide themselves where they go; \
                 `slate tree '/**/params' --values` shows what can be set",
                unread.join(", ")
            ),
            Self::NoGoal { found, .. } if found.is_empty() => {
                "a goal is an input without a link called `goal` or `target`, or parameters `goal_x` and `goal_y`; \
                 `slate tree '/**/params' --values` shows what can be set"
                    .into()
            }
            Self::NoGoal { found, .. } => format!("choose one, such as --of {}", found.first()?),
            Self::NoActuator { known } if known.is_empty() => "`slate check` tells what a configuration has".into(),
            Self::NoActuator { known } => format!("choose one, such as `slate teleop {}`", known.first()?),
            Self::NoKeys { .. } => "drive it by a program: book page 28, Driving".into(),
            Self::NoChassis { .. } => {
                "a property of the interface `Chassis` does, with the name of the robot in its path".into()
            }
            Self::NoHeading { .. } => "leave the heading out".into(),
            Self::Unconfirmed => "say --yes, if it may move all the same".into(),
            Self::NoTerminal => "call it in a terminal; programs drive over HTTP, see book page 28".into(),
            Self::Body { .. } => "give JSON such as '{\"enabled\": false}', @FILE, or - for stdin".into(),
            Self::NoDrawing { .. } => {
                "end its name with .svg, .mmd, .dot or .json, or say the --format; programs such as rsvg-convert make a PNG of \
                 an SVG"
                    .into()
            }
            Self::Message { .. } => "give JSON with all fields of the message, such as '{\"x\": 1.0}'".into(),
            Self::NoCode { .. } => "`slate explain` lists all codes".into(),
            Self::NothingLike { .. } => "`slate tree` shows the properties that there are".into(),
            Self::SeveralInTable { .. } => "name one of them, or take --json, a line for each value".into(),
            Self::Condition { url, .. } => format!("`slate get {url}` shows what it has"),
            Self::FolderInUse { .. } => "give this one another folder with --out, or wait for the end of that one".into(),
            Self::Taken { .. } => "choose another name, or call this in another folder".into(),
            Self::NoCheckout { .. } => {
                "a project is built with the sources that belong to this program: it finds them when it was built there, or \
                 is called there; else name their folder, the one that has crates/plugin: --slate PATH"
                    .into()
            }
            Self::TraceWithoutEnd { left: None, .. } => {
                "what it had recorded was no whole file and is removed; start the agent and record again"
                    .into()
            }
            Self::TraceWithoutEnd { left: Some(part), .. } => {
                let part = slate::runtime::printable(part);
                format!("what it had recorded is no whole file: remove {part}")
            }
            _ => return None,
        })
    }
}

impl From<Denied> for Failure {
    fn from(Denied { status, detail, help, code, .. }: Denied) -> Self {
        Self::Http { status, detail, help, code }
    }
}

impl From<RequestError> for Failure {
    fn from(error: RequestError) -> Self {
        match error {
            RequestError::Trouble(trouble) => trouble.into(),
            RequestError::Denied(denied) => denied.into(),
        }
    }
}
