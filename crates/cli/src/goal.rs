//! Goal of a robot.

use std::io::IsTerminal;
use std::time::Duration;

use clap::Args;
use serde_json::{Map, Value, json};
use slate::blackboard::is_within;
use slate::control::{Client, SettingChange, Watched};
use slate::sim::world::{Bounds, World};

use crate::changes::show_changes;
use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::output;
use crate::process::ProcessInfo;

#[derive(Debug, Args)]
pub struct GoalOptions {
    /// x and y in the map frame, meters,
    /// and a heading, radians or degrees such as `90deg`; or the name of a place
    #[arg(value_name = "X Y [HEADING]|PLACE", num_args = 1..=3, allow_negative_numbers = true, required_unless_present = "change")]
    goal: Vec<String>,

    /// Append the goal to the robot's goals
    #[arg(long)]
    append: bool,

    /// Approach the goal slowly in a straight line, such as a charger
    #[arg(long)]
    dock: bool,

    #[command(flatten)]
    change: GoalChange,

    /// Robot or module, such as `r2` or `r2/knowledge`; required if several have a goal
    #[arg(long, value_name = "MODULE")]
    of: Option<String>,

    /// Move the robot even without a terminal
    #[arg(long)]
    yes: bool,

    /// Print the changes as JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    agent: AgentOption,
}

/// Changes of a robot's behavior, without a goal.
#[derive(Debug, Args)]
#[group(id = "change", multiple = false, conflicts_with_all = ["goal", "append", "dock"])]
struct GoalChange {
    /// Pause the robot until it is resumed
    #[arg(long)]
    pause: bool,

    /// Resume the robot after a pause
    #[arg(long)]
    resume: bool,

    /// Cancel its goals
    #[arg(long)]
    cancel: bool,
}

impl GoalChange {
    /// Returns the command of a navigation request, if any.
    fn command(&self) -> Option<&'static str> {
        [(self.pause, "PAUSE"), (self.resume, "RESUME"), (self.cancel, "CANCEL")]
            .into_iter()
            .find_map(|(is_given, command)| is_given.then_some(command))
    }
}

/// Goal of a robot.
enum WantedGoal {
    Pose { x: f64, y: f64, heading: Option<f64> },
    Place(String),
}

impl WantedGoal {
    /// Reads the words of the command; `None` without any.
    fn read(words: &[String]) -> Result<Option<Self>, Failure> {
        let wrong = |text: &str, expected: String| Failure::GoalWord { text: text.into(), expected };
        let number = |text: &String| match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(wrong(text, "a number of meters, such as 1.5".into())),
        };
        match words {
            [] => Ok(None),
            [place] if place.parse::<f64>().is_err() => Ok(Some(Self::Place(place.clone()))),
            [x] => Err(wrong(x, "two numbers of meters, or the name of a place".into())),
            [x, y, rest @ ..] => {
                let heading = rest.first().map(|text| angle(text).map_err(|expected| wrong(text, expected)));
                Ok(Some(Self::Pose { x: number(x)?, y: number(y)?, heading: heading.transpose()? }))
            }
        }
    }
}

fn angle(text: &str) -> Result<f64, String> {
    let (digits, factor) = match text.strip_suffix("deg") {
        Some(degrees) => (degrees, std::f64::consts::PI / 180.0),
        None => (text.strip_suffix("rad").unwrap_or(text), 1.0),
    };
    match digits.trim().parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number * factor),
        _ => Err("radians, such as 1.57, or degrees, such as 90deg".into()),
    }
}

/// Names of inputs that take a goal.
const GOAL_INPUTS: [&str; 2] = ["goal", "target"];

/// Interfaces of such inputs.
const GOAL_INTERFACES: [&str; 3] = ["Point2", "Pose2", "Position"];

/// Goal that can be set.
struct SettableGoal {
    /// Module.
    module: String,
    place: GoalSetting,
    /// Presence of a heading.
    has_heading: bool,
}

enum GoalSetting {
    /// Input, by its URL.
    Input(String),
    /// Parameters `goal_x` and `goal_y`.
    Parameters,
}

/// Sets the goal, or changes the navigation, of the only robot or the named one.
pub fn goal(options: &GoalOptions) -> Result<bool, Failure> {
    let wanted = WantedGoal::read(&options.goal)?;
    let moves = wanted.is_some() || options.change.resume;
    if moves && !options.yes && !std::io::stdin().is_terminal() {
        return Err(Failure::Unconfirmed);
    }
    let mut client = options.agent.connect()?;
    if let Some(WantedGoal::Pose { x, y, .. }) = wanted
        && let Some(Bounds { minimum, maximum }) = bounds(&mut client)
        && [x, y].iter().enumerate().any(|(axis, at)| !(minimum[axis]..=maximum[axis]).contains(at))
    {
        return Err(Failure::GoalOutside { minimum, maximum });
    }
    if let Some(inbox) = navigation_inbox(&mut client, options.of.as_deref())? {
        return navigate(&mut client, &inbox, wanted.as_ref(), options);
    }
    let Some(WantedGoal::Pose { x, y, heading }) = wanted.filter(|_| !options.append && !options.dock) else {
        return Err(Failure::NoNavigation);
    };
    let target = target(&mut client, options.of.as_deref())?;
    if heading.is_some() && !target.has_heading {
        return Err(Failure::NoHeading { module: target.module });
    }
    let changed = set(&mut client, &target, (x, y, heading))?;
    if options.json {
        let goal = json!({ "x": x, "y": y, "theta": heading });
        output::json(
            &json!({"schema": "slate.goal/1", "module": target.module, "goal": goal, "changed": changed}),
        );
    } else {
        show_changes(&changed);
    }
    Ok(true)
}

/// Interface of the messages of a Knowledge that has missions.
const NAVIGATION_REQUEST: &str = "NavigationRequest";

/// Returns the only mailbox for missions, of a named robot if one is given.
/// `None` if no mailbox exists.
fn navigation_inbox(client: &mut Client, of: Option<&str>) -> Result<Option<String>, Failure> {
    let properties = client.properties(None)?;
    let inboxes: Vec<&str> = properties
        .iter()
        .filter(|property| property.access == "messages" && property.interface == NAVIGATION_REQUEST)
        .map(|property| property.path.as_str())
        .filter(|path| of.is_none_or(|of| is_within(path, of.trim_matches('/'))))
        .collect();
    match inboxes[..] {
        [] => Ok(None),
        [inbox] => Ok(Some(inbox.to_owned())),
        _ => {
            let module = |path: &str| path.rsplit_once('/').map_or(path, |(module, _)| module).to_owned();
            let found = inboxes.into_iter().map(module).collect();
            Err(Failure::NoGoal { found, of: of.map(str::to_owned), others: Vec::new(), unread: Vec::new() })
        }
    }
}

/// Sends a request to a Knowledge that has missions.
fn navigate(
    client: &mut Client,
    inbox: &str,
    wanted: Option<&WantedGoal>,
    options: &GoalOptions,
) -> Result<bool, Failure> {
    let command = options.change.command().unwrap_or(if options.append { "APPEND" } else { "GO_TO" });
    let (x, y, heading, place) = match wanted {
        Some(WantedGoal::Pose { x, y, heading }) => (*x, *y, *heading, ""),
        Some(WantedGoal::Place(place)) => (0.0, 0.0, None, place.as_str()),
        None => (0.0, 0.0, None, ""),
    };
    let goal = json!({
        "x": x, "y": y, "theta": heading.unwrap_or(0.0), "has_heading": heading.is_some(), "dock": options.dock,
        "place": place,
    });
    let url = format!("/{inbox}");
    let message = json!({ "command": command, "goal": goal });
    let status = client.send(&url, message, false);
    let status = status.map_err(|error| crate::value_input::refused(client, "goal", &url, error))?;
    if options.json {
        output::json(&json!({
            "schema": "slate.goal/1", "module": inbox.rsplit_once('/').map_or(inbox, |(module, _)| module),
            "command": command, "goal": goal, "status": status,
        }));
    } else {
        output::line(match status.as_str() {
            "done" => "done",
            _ => "sent; no reply within a second",
        });
    }
    Ok(true)
}

/// Returns the extent of a simulated robot's world.
/// That of a real one is unknown.
fn bounds(client: &mut Client) -> Option<Bounds> {
    let settings = client.settings("world.arena").ok()?;
    let arena = settings.iter().find_map(|setting| setting.value.as_str())?;
    if let Some(world) = World::named(arena) {
        return Some(world.ok()?.bounds);
    }
    // A file is named from where the agent was started.
    let folder = std::fs::read_link(format!("/proc/{}/cwd", ProcessInfo::of(client.name())?.id)).ok()?;
    Some(World::load(folder.join(arena).to_str()?).ok()?.bounds)
}

fn set(
    client: &mut Client,
    target: &SettableGoal,
    (x, y, heading): (f64, f64, Option<f64>),
) -> Result<Vec<SettingChange>, Failure> {
    let parameters = format!("/{}/params", target.module);
    let (url, names) = match &target.place {
        GoalSetting::Input(url) => (url, ["x", "y", "theta"]),
        GoalSetting::Parameters => (&parameters, ["goal_x", "goal_y", "goal_theta"]),
    };
    // The goal of an input is a whole; parameters that are not named stay.
    let usual = (target.has_heading && matches!(target.place, GoalSetting::Input(_))).then_some(0.0);
    let values = names.into_iter().zip([Some(x), Some(y), heading.or(usual)]);
    let value: Map<_, _> =
        values.filter_map(|(name, value)| Some((name.to_owned(), json!(value?)))).collect();
    Ok(client.set_property(url, &value.into())?)
}

/// Returns the only settable goal, or that of the named robot.
fn target(client: &mut Client, of: Option<&str>) -> Result<SettableGoal, Failure> {
    let is_meant = |target: &SettableGoal| {
        of.is_none_or(|of| {
            let of = of.trim_matches('/');
            target.module.strip_prefix(of).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
        })
    };
    let (targets, unread) = targets(client)?;
    let (targets, others): (Vec<_>, Vec<_>) = targets.into_iter().partition(is_meant);
    match <[SettableGoal; 1]>::try_from(targets) {
        Ok([target]) => Ok(target),
        Err(several) => {
            let names =
                |targets: Vec<SettableGoal>| targets.into_iter().map(|target| target.module).collect();
            let of = of.map(str::to_owned);
            Err(Failure::NoGoal { found: names(several), of, others: names(others), unread })
        }
    }
}

/// Returns the settable goals, and the modules whose goals have no reader.
fn targets(client: &mut Client) -> Result<(Vec<SettableGoal>, Vec<String>), Failure> {
    let properties = client.properties(None)?;
    let links = client.links()?;
    let is_linked = |path: &str| links.iter().any(|link| link.to == path);
    // A goal property without a reader has no effect.
    let is_unread = |module: &str| {
        let goal = format!("{module}/goal");
        let is_told = properties.iter().any(|property| property.path == goal);
        is_told && links.iter().all(|link| !is_within(link.from.trim_start_matches('/'), &goal))
    };
    let (mut targets, mut unread) = (Vec::new(), Vec::new());
    for property in properties.iter().filter(|property| property.access == "setting") {
        let Some((module, name)) = property.path.rsplit_once('/') else { continue };
        let is_goal = GOAL_INPUTS.contains(&name) && GOAL_INTERFACES.contains(&property.interface.as_str());
        if is_goal && !is_linked(&property.path) {
            let place = GoalSetting::Input(format!("/{}", property.path));
            targets.push(SettableGoal {
                module: module.into(),
                place,
                has_heading: property.interface == "Pose2",
            });
        }
    }
    let params = properties.iter().filter_map(|property| property.path.strip_suffix("/params"));
    let params: Vec<&str> = params.collect();
    let watched = |module: &&str| Watched { url: format!("/{module}/params"), after: None };
    let of: Vec<_> = params.iter().map(watched).collect();
    for news in client.watch(&of, Duration::ZERO)? {
        let (Some(module), Some(reading)) = (params.get(news.of), news.readings.last()) else { continue };
        let has = |name: &str| reading.value.get(name).is_some_and(Value::is_number);
        if has("goal_x") && has("goal_y") {
            let (module, has_heading) = ((*module).to_owned(), has("goal_theta"));
            if is_unread(&module) {
                unread.push(module);
                continue;
            }
            targets.push(SettableGoal { module, place: GoalSetting::Parameters, has_heading });
        }
    }
    Ok((targets, unread))
}
