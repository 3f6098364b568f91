//! Hints on errors.

use miette::Diagnostic;
use slate::bag::Error as BagError;
use slate::blackboard::nearest_names;
use slate::control::ClientError;
use slate::logs::{Format, recognize};
use slate::runtime::configuration::ErrorCode;
use slate::runtime::printable;

use super::{Failure, usage};

const NO_AGENT_HELP: &str =
    "start one with `slate run`; commands find agents of the same user with the same XDG_RUNTIME_DIR";

impl Failure {
    /// Returns the help, if any.
    pub(super) fn help(&self) -> Option<String> {
        self.help_with_files()
            .or_else(|| self.help_with_agents())
            .or_else(|| self.help_with_driving())
            .or_else(|| self.help_with_values())
    }

    /// Returns help about arguments, configurations, recordings and folders.
    fn help_with_files(&self) -> Option<String> {
        Some(match self {
            Self::Words(error) => usage::help(error),
            Self::Leading { near, verb, .. } => leading(near.as_deref(), verb.as_deref()),
            Self::NotBuilt { feature, .. } => {
                format!("build it with the feature `{feature}`: cargo build --release --features {feature}")
            }
            Self::Configuration(report) if report.error_code() == Some(ErrorCode::Kind) => parts_not_built()?,
            Self::Example(error) => error.help()?,
            Self::NoModule { help, .. } => help.clone(),
            Self::Start(error) => error.help()?.to_string(),
            Self::Bag(error) => bag(error)?,
            Self::Snapshot(error) => error.help()?.to_string(),
            Self::Memory(error) => error.help()?.to_string(),
            #[cfg(feature = "console")]
            Self::Console(error) => error.help()?.to_string(),
            Self::Library(error) => error.help.clone(),
            Self::Run(error) => error.help()?,
            Self::BatchOnWallClock { name } => format!(
                "`slate run {name}` runs it once; for a batch, add a simulator to the configuration and make it the time \
                 source (`time.source`)"
            ),
            Self::BatchWithoutMission { name } => format!(
                "`slate run {name}` runs it once, until Ctrl-C; for a batch, name the property that ends a run in [mission], or \
                 choose a variant with one"
            ),
            Self::SeveralResumed { agents } => format!("name the agent, such as --agent {}", agents.first()?),
            Self::ProjectName { .. } => "choose another name, such as `wall-follower`".into(),
            Self::Taken { .. } => "choose another name, or another working folder".into(),
            Self::NoCheckout { .. } => {
                "name the folder that contains crates/plugin; without --slate, the project is built with the packages of this \
                 version"
                    .into()
            }
            Self::NoViewer { .. } => {
                "install one, such as Rerun with `pip install rerun-sdk`, or open what `slate bag export --ros` writes on \
                 another machine"
                    .into()
            }
            Self::NoDrawing { .. } => {
                "use a name that ends with .svg, .mmd, .dot or .json, or --format; programs such as rsvg-convert turn an SVG \
                 into a PNG"
                    .into()
            }
            _ => return None,
        })
    }

    /// Returns help about reaching agents, and about modules, plugins and links.
    fn help_with_agents(&self) -> Option<String> {
        Some(match self {
            Self::Unreachable(error) => error.help()?.to_string(),
            Self::NoAgent => NO_AGENT_HELP.into(),
            Self::SeveralAgents { running } => format!("choose one, such as --agent {}", running.first()?),
            Self::Unmet { .. } => {
                "`slate peers --agent NAME` lists the agents that an agent knows, and why one is not connected".into()
            }
            Self::Agent(error) => client(error),
            Self::NotStopped { .. } => "use the robot's own emergency stop".into(),
            Self::NotLoaded { .. } => {
                "`slate plugin list` lists the loaded plugins; name the plugins of a list one by one".into()
            }
            Self::UnknownModule { name, known } => unknown_module(name, known),
            Self::NotLinked { linked, .. } if linked.is_empty() => "the agent has no links".into(),
            Self::NotLinked { to, linked } => {
                match nearest_names(to, linked.iter().map(String::as_str)).join(" or ") {
                    near if near.is_empty() => "`slate link` lists all links".into(),
                    near => format!("did you mean {near}?"),
                }
            }
            #[cfg(feature = "console")]
            Self::NothingToExport { .. } => {
                "switch on `[record.flight]`, or name a recording: slate console RECORDING --export FOLDER".into()
            }
            Self::NoConsole { agent } => format!(
                "its web console is off: start it without --headless, or with --set console.port=0 (any free port); of \
                 several agents in one file, only the one with the mission has a console, or the first, unless \
                 [agents.{agent}.console] enables one"
            ),
            Self::Network(trouble) => trouble.help(),
            Self::Http { help, .. } | Self::Mcp { help, .. } | Self::Ros { help, .. } => help.clone(),
            Self::TraceWithoutEnd { left: None, .. } => {
                "the incomplete file is removed; start the agent and record again".into()
            }
            Self::TraceWithoutEnd { left: Some(part), .. } => {
                format!("the file is incomplete: remove {}", printable(part))
            }
            _ => return None,
        })
    }

    /// Returns help about goals, actuators and teleoperation.
    fn help_with_driving(&self) -> Option<String> {
        Some(match self {
            Self::GoalOutside { .. } => {
                "choose a goal inside it, in meters; `slate set` accepts any, see `slate tree '/**/params' --values`".into()
            }
            Self::NoGoal { others, .. } if !others.is_empty() => {
                format!("robots with a settable goal: {}", others.join(", "))
            }
            Self::NoGoal { found, unread, .. } if found.is_empty() && !unread.is_empty() => format!(
                "the goals of {} have no reader, so setting them has no effect: these robots choose their goals themselves; \
                 `slate tree '/**/params' --values` lists what can be set",
                unread.join(", ")
            ),
            Self::NoGoal { found, .. } if found.is_empty() => {
                "a goal is an unlinked input named `goal` or `target`, or the parameters `goal_x` and `goal_y`; \
                 `slate tree '/**/params' --values` lists what can be set"
                    .into()
            }
            Self::NoGoal { found, .. } => format!("choose one, such as --of {}", found.first()?),
            Self::NoActuator { known } if known.is_empty() => "`slate check` lists the actuators of a configuration".into(),
            Self::NoActuator { known } => format!("choose one, such as `slate teleop {}`", known.first()?),
            Self::NoKeys { .. } => "drive it by a program: see Driving, page 28 of the book".into(),
            Self::NoChassis { .. } => {
                "provide a property of the interface `Chassis` with the robot's name in its path".into()
            }
            Self::NoHeading { .. } => "omit the heading".into(),
            Self::NoNavigation => "a robot with the Knowledge `navigation_knowledge` has them: see Navigation, page 40 of the book".into(),
            Self::GoalWord { .. } => "such as `slate goal 1.5 -0.5`, `slate goal 1.5 -0.5 90deg` or `slate goal kitchen`".into(),
            Self::Unconfirmed => "add --yes to move it nevertheless".into(),
            Self::NoTerminal => "run it in a terminal; programs drive over HTTP, see page 28 of the book".into(),
            _ => return None,
        })
    }

    /// Returns help about values, messages and codes.
    fn help_with_values(&self) -> Option<String> {
        Some(match self {
            Self::Body { .. } => "give JSON such as '{\"enabled\": false}', @FILE, or - for stdin".into(),
            Self::Message { url, .. } => {
                format!("give all fields of the message, such as `slate send {url} '{{ x = 1.0, y = 0.0 }}'`")
            }
            Self::NoCode { .. } => "`slate explain` lists all codes".into(),
            Self::NothingBelow { pattern, above, missing, names } => {
                nothing_below(pattern, above, missing, names)
            }
            Self::NothingLike { .. } => "`slate tree` lists all properties".into(),
            Self::SeveralInTable { .. } => {
                "name one property, or use --json, which prints a line per value".into()
            }
            Self::Condition { url, .. } => format!("`slate get {url}` prints its fields"),
            _ => return None,
        })
    }
}

/// Returns the features with modules that are not built in.
fn parts_not_built() -> Option<String> {
    let missing = slate_robotics_cli::FEATURES.iter().filter(|(name, is_built)| {
        !is_built && ["drivers", "lua", "missions", "navigation", "vision"].contains(name)
    });
    let missing: Vec<_> = missing.map(|(name, _)| *name).collect();
    let all = missing.join(",");
    (!missing.is_empty())
        .then(|| format!("more kinds are features of the command: cargo build --release --features {all}"))
}

fn leading(near: Option<&str>, verb: Option<&str>) -> String {
    let near = near.map(|near| format!("did you mean `{near}`? ")).unwrap_or_default();
    let own = verb
        .map(|verb| format!("; put the options of `{verb}` behind it, see `slate {verb} --help`"))
        .unwrap_or_default();
    format!(
        "{near}Before the command, only --agent NAME, --color WHEN, --help and --version are allowed{own}"
    )
}

/// Maximum number of names in help.
const MAX_NAMES: usize = 24;

fn nothing_below(pattern: &str, above: &str, missing: &str, names: &[String]) -> String {
    if names.is_empty() {
        return format!("{above} is a property: `slate get {pattern}` prints its fields");
    }
    let near = nearest_names(missing, names.iter().map(String::as_str));
    let near = near.first().map(|near| format!("did you mean `{near}`? ")).unwrap_or_default();
    let shown = names.iter().take(MAX_NAMES).map(String::as_str).collect::<Vec<_>>().join(", ");
    let more = if names.len() > MAX_NAMES { ", ..." } else { "" };
    format!("{near}{above} contains: {shown}{more}")
}

fn unknown_module(name: &str, known: &[String]) -> String {
    let inside = known.iter().filter(|own| own.rsplit('/').next() == Some(name)).cloned();
    let mut near: Vec<_> = inside.collect();
    if near.is_empty() {
        near = nearest_names(name, known.iter().map(String::as_str));
    }
    let near = near.first().map(|near| format!("did you mean {near}? ")).unwrap_or_default();
    let shown = known.iter().take(MAX_NAMES).map(String::as_str).collect::<Vec<_>>().join(", ");
    let more = if known.len() > MAX_NAMES { ", ..." } else { "" };
    format!("{near}modules: {shown}{more}")
}

fn client(error: &ClientError) -> String {
    match error {
        ClientError::Refused(refusal) => refusal.help.clone(),
        ClientError::NoAgent { name, running } if !running.is_empty() => {
            let near = nearest_names(name, running.iter().map(String::as_str));
            let others = running.iter().filter(|name| !near.contains(name));
            let all: Vec<_> = near.iter().chain(others).map(String::as_str).collect();
            format!("running agents: {}", all.join(", "))
        }
        ClientError::NoAgent { .. } => NO_AGENT_HELP.into(),
        ClientError::Version { .. } => "use the `slate` that runs the agent".into(),
        _ => "see the agent's log".into(),
    }
}

fn bag(error: &BagError) -> Option<String> {
    let lenient = |path: &std::path::Path| {
        let path = printable(path);
        format!("`slate bag import {path} --lenient --out FILE.mcap` skips and counts invalid parts")
    };
    Some(match error {
        BagError::NoBag { .. } => {
            let names: Vec<_> = Format::ALL.iter().map(|format| format.name()).collect();
            format!("`slate bag import` converts logs of other systems: {}", names.join(", "))
        }
        // Logs of other systems are not repaired.
        BagError::Damaged { path, .. }
            if !matches!(recognize(path), Ok(None | Some(Format::Mcap)) | Err(_)) =>
        {
            lenient(path)
        }
        BagError::Line { path, .. } => lenient(path),
        BagError::Damaged { path, .. } => format!(
            "`slate bag repair {}` recovers what is left; --out FILE keeps the damaged file",
            printable(path)
        ),
        _ => return None,
    })
}
