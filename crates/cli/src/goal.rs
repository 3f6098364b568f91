//! Where a robot is to go.

use std::io::IsTerminal;
use std::time::Duration;

use clap::Args;
use serde_json::{Map, Value, json};
use slate::blackboard::is_within;
use slate::control::{Changed, Client, Watched};
use slate::sim::world::{Bounds, World};

use crate::changes::show_changes;
use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::output;
use crate::process::ProcessInfo;

#[derive(Debug, Args)]
pub struct GoalOptions {
    /// x in the map frame, metres
    #[arg(allow_negative_numbers = true, value_parser = finite)]
    x: f64,

    /// y in the map frame, metres
    #[arg(allow_negative_numbers = true, value_parser = finite)]
    y: f64,

    /// Heading, radians counter-clockwise from x, or degrees such as `90deg`
    #[arg(allow_negative_numbers = true, value_parser = angle)]
    heading: Option<f64>,

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

fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err("expected a number of metres, such as 1.5".into()),
    }
}

fn angle(text: &str) -> Result<f64, String> {
    let (digits, factor) = match text.strip_suffix("deg") {
        Some(degrees) => (degrees, std::f64::consts::PI / 180.0),
        None => (text.strip_suffix("rad").unwrap_or(text), 1.0),
    };
    match digits.trim().parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number * factor),
        _ => Err("expected radians, such as 1.57, or degrees, such as 90deg".into()),
    }
}

/// Names of inputs that take a goal.
const NAMES: [&str; 2] = ["goal", "target"];

/// Interfaces of such inputs.
const INTERFACES: [&str; 3] = ["Point2", "Pose2", "Position"];

/// A goal that can be set.
struct SettableGoal {
    /// The module.
    module: String,
    place: GoalSetting,
    /// Whether it has a heading, too.
    has_heading: bool,
}

enum GoalSetting {
    /// An input, by its URL.
    Input(String),
    /// Parameters `goal_x` and `goal_y`.
    Parameters,
}

/// Sets the goal of the one who has one.
pub fn goal(options: &GoalOptions) -> Result<bool, Failure> {
    if !options.yes && !std::io::stdin().is_terminal() {
        return Err(Failure::Unconfirmed);
    }
    let mut client = options.agent.connect()?;
    let target = target(&mut client, options.of.as_deref())?;
    if options.heading.is_some() && !target.has_heading {
        return Err(Failure::NoHeading { module: target.module });
    }
    if let Some(Bounds { minimum, maximum }) = bounds(&mut client)
        && [options.x, options.y]
            .iter()
            .enumerate()
            .any(|(axis, at)| !(minimum[axis]..=maximum[axis]).contains(at))
    {
        return Err(Failure::GoalOutside { minimum, maximum });
    }
    let changed = set(&mut client, &target, options)?;
    if options.json {
        let goal = json!({ "x": options.x, "y": options.y, "theta": options.heading });
        output::json(
            &json!({"schema": "slate.goal/1", "module": target.module, "goal": goal, "changed": changed}),
        );
    } else {
        show_changes(&changed);
    }
    Ok(true)
}

/// How far the world of a simulated robot goes. Nobody knows that of a real one.
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

fn set(client: &mut Client, target: &SettableGoal, options: &GoalOptions) -> Result<Vec<Changed>, Failure> {
    let GoalOptions { x, y, heading, .. } = options;
    let parameters = format!("/{}/params", target.module);
    let (url, names) = match &target.place {
        GoalSetting::Input(url) => (url, ["x", "y", "theta"]),
        GoalSetting::Parameters => (&parameters, ["goal_x", "goal_y", "goal_theta"]),
    };
    // The goal of an input is a whole; parameters that are not named stay.
    let usual = (target.has_heading && matches!(target.place, GoalSetting::Input(_))).then_some(&0.0);
    let values = names.into_iter().zip([Some(x), Some(y), heading.as_ref().or(usual)]);
    let value: Map<_, _> =
        values.filter_map(|(name, value)| Some((name.to_owned(), json!(value?)))).collect();
    Ok(client.set_property(url, &value.into())?)
}

/// The only thing that can be set to a goal, of one who is meant.
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
    // A goal that is told to others and that nobody wants leads nowhere.
    let is_unread = |module: &str| {
        let goal = format!("{module}/goal");
        let is_told = properties.iter().any(|property| property.path == goal);
        is_told && links.iter().all(|link| !is_within(link.from.trim_start_matches('/'), &goal))
    };
    let (mut targets, mut unread) = (Vec::new(), Vec::new());
    for property in properties.iter().filter(|property| property.access == "setting") {
        let Some((module, name)) = property.path.rsplit_once('/') else { continue };
        let is_goal = NAMES.contains(&name) && INTERFACES.contains(&property.interface.as_str());
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
