//! Observed data of a run: robots, routes, actions, clearance.
//! They are read from the blackboard at the URLs that the configuration's `[report]` names.

use std::sync::Arc;

use slate_blackboard::interface::{Field, Value, View};
use slate_blackboard::{Property, is_within};
use slate_report::{Outcome, Route, Sample};
use slate_runtime::configuration::{Configuration, Diagnostic, Spanned, Table, Value as Setting};
use slate_runtime::{ErrorCode, Message, PropertyFacts, PropertyIndex};
use slate_sorted::SortedMap;

use crate::RunError;

/// Robot that the report follows.
pub struct ObservedRobot<P = Arc<Property>> {
    /// Name in `[report.robots]`.
    pub name: String,
    pose: P,
    /// Field of the property that has the pose; empty for the whole.
    pose_field: String,
    status: Option<P>,
    clearance: Option<P>,
    /// Properties that may have its goal, the most likely first.
    goals: Vec<P>,
    waiting: Option<P>,
}

/// Data that the report follows.
pub struct Observation<P = Arc<Property>> {
    /// Robots of the report.
    pub robots: Vec<ObservedRobot<P>>,
    judged: Vec<Judged<P>>,
    verdict: Option<P>,
    speed: Option<(P, &'static Field)>,
}

/// Robot of which a judge measures something.
struct Judged<P> {
    metrics: P,
    /// Parameter of the judge with its robot's name.
    robot: Option<P>,
    /// Name of the judge.
    judge: String,
}

/// Figures that a judge has measured.
#[derive(Default)]
pub struct JudgeMetrics {
    /// Name of the robot, or that of the judge if it names no robot.
    pub robot: String,
    /// Figures by the names of the judge's interface.
    pub figures: SortedMap<String, f64>,
    /// Units of the figures.
    pub units: SortedMap<String, String>,
}

/// Judge's verdict.
pub struct JudgeVerdict {
    /// `RUNNING`, `SUCCEEDED` or `FAILED`.
    pub state: String,
    /// Outcome, such as `GOAL_REACHED`; empty or `OTHER` if the judge names none.
    outcome: String,
    /// Reason, such as `goal reached`.
    pub reason: String,
}

impl JudgeVerdict {
    /// Returns the outcome of a mission that has ended.
    pub fn outcome(&self) -> Outcome {
        match self.outcome.as_str() {
            "GOAL_REACHED" => Outcome::GoalReached,
            "GAP_KEPT" => Outcome::GoalReached,
            "COLLIDED" => Outcome::Collided,
            // The time is up, and the task is not done.
            "TIMED_OUT" | "GAP_LEFT" | "GOAL_LEFT" => Outcome::TimedOut,
            _ if self.state == "SUCCEEDED" => Outcome::GoalReached,
            _ => Outcome::Failed,
        }
    }

    /// Returns the judge's own word for the outcome, if that is another one.
    pub fn own_word(&self) -> Option<&'static str> {
        match self.outcome.as_str() {
            "GAP_KEPT" => Some("gap_kept"),
            "GAP_LEFT" => Some("gap_left"),
            "GOAL_LEFT" => Some("goal_left"),
            "" | "OTHER" if self.state == "SUCCEEDED" => Some("succeeded"),
            _ => None,
        }
    }
}

/// Current state of a robot.
#[derive(Clone, Debug, Default)]
pub struct RobotNow {
    pub x: f64,
    pub y: f64,
    pub theta: f64,
    pub route: Option<Route>,
    pub action: String,
    pub tree: String,
    pub clearance: Option<f64>,
}

/// Returns errors for unknown keys in `[report]`.
fn unknown_keys(configuration: &Configuration) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    let mut check = |place: &str, table: &Table, known: &[&str]| {
        for (name, entry) in table.iter().filter(|(name, _)| !known.contains(name)) {
            let message = ErrorCode::Key.of(format!("unknown key `{name}` in [{place}]"));
            let help = format!("known: {}", known.join(", "));
            diagnostics.push(configuration.diagnostic(entry.key, message, Some(help)));
        }
    };
    let Some(report) = configuration.table("report") else { return diagnostics };
    check("report", report, &["bodies", "robots", "metrics", "speed"]);
    let robots = report.get("robots").and_then(|robots| robots.as_table());
    for (name, entry) in robots.into_iter().flat_map(Table::iter) {
        if let Some(robot) = entry.value.as_table() {
            check(&format!("report.robots.{name}"), robot, &["pose", "status", "clearance"]);
        }
    }
    diagnostics
}

impl<P: PropertyFacts> Observation<P> {
    /// Finds the properties that the configuration names.
    ///
    /// # Errors
    /// Unknown keys in `[report]`, and properties that are absent or of another interface.
    pub fn new(
        configuration: &Configuration,
        index: &impl PropertyIndex<Property = P>,
    ) -> Result<Self, RunError> {
        let mut diagnostics = unknown_keys(configuration);
        let mut robots = Vec::new();
        let mut find_at = |spanned: &Spanned<Setting>| {
            let text = spanned.value.as_str().unwrap_or_default();
            if text.starts_with("slate://") {
                // Another agent's properties are in its own report.
                return None;
            }
            match index.find(text.trim_start_matches('/')) {
                Ok(found) => Some(found),
                Err(error) => {
                    diagnostics.push(configuration.diagnostic(spanned.span, Message::from(&error), None));
                    None
                }
            }
        };
        let judged = match configuration.value("report.metrics") {
            Some(Spanned { value: Setting::List(list), .. }) => list.iter().collect(),
            one => Vec::from_iter(one),
        };
        let judged =
            judged.into_iter().filter_map(&mut find_at).map(|(metrics, _)| Judged::new(metrics, index));
        let judged = judged.collect();
        let mut find_field = |path: &str| find_at(configuration.value(path)?);
        let names: Vec<String> = configuration
            .value("report.robots")
            .and_then(|robots| robots.value.as_table())
            .map(|table| table.iter().map(|(name, _)| name.to_owned()).collect())
            .unwrap_or_default();
        for name in names {
            let pose = find_field(&format!("report.robots.{name}.pose"));
            let mut find = |path: &str| find_field(path).map(|(property, _)| property);
            let status = find(&format!("report.robots.{name}.status"));
            let clearance = find(&format!("report.robots.{name}.clearance"));
            if let Some((pose, field)) = pose {
                let pose_field = field.to_owned();
                let waiting = status.as_ref().and_then(|status| waiting_of(status.path(), index));
                let goals = status.as_ref().map(|status| goals_of(status.path(), index)).unwrap_or_default();
                robots.push(ObservedRobot { name, pose, pose_field, status, clearance, goals, waiting });
            }
        }
        let mission = configuration.mission().map(|_| "mission.outcome");
        let verdict = mission.and_then(&mut find_field).map(|(property, _)| property);
        let speed = configuration.value("report.speed").and_then(|spanned| {
            let text = spanned.value.as_str().unwrap_or_default();
            if text.starts_with("slate://") {
                return None;
            }
            let field = index.find(text.trim_start_matches('/')).ok().and_then(|(property, name)| {
                let field = property.descriptor().fields.iter().find(|field| field.name == name)?;
                Some((property, field))
            });
            if field.is_none() {
                let message = ErrorCode::Name.of(format!("unknown field `{text}`"));
                let help = "name a field of parameters, such as \"/planner/params/max_linear_velocity\"";
                diagnostics.push(configuration.diagnostic(spanned.span, message, Some(help.into())));
            }
            field
        });
        if diagnostics.is_empty() {
            Ok(Self { robots, judged, verdict, speed })
        } else {
            Err(RunError::Configuration(diagnostics.into()))
        }
    }
}

impl Observation {
    /// Returns the judges' figures in the order of the report.
    pub fn metrics(&self) -> Vec<JudgeMetrics> {
        self.judged.iter().filter_map(Judged::metrics).collect()
    }

    /// Returns the judge's verdict.
    pub fn verdict(&self) -> Option<JudgeVerdict> {
        let verdict = value(self.verdict.as_ref()?)?;
        let text = |name: &str| verdict.get(name).and_then(Value::as_str).unwrap_or_default().to_owned();
        Some(JudgeVerdict { state: text("state"), outcome: text("outcome"), reason: text("reason") })
    }

    /// Returns the speed that the robots are set to, with its unit.
    pub fn speed(&self) -> Option<String> {
        let (property, field) = self.speed.as_ref()?;
        let number = value(property)?.get(field.name)?.as_f64()?;
        Some(format!("{number} {}", field.unit).trim_end().to_owned())
    }

    /// Returns whether the mission is still in progress.
    pub fn is_running(&self) -> bool {
        self.verdict().is_none_or(|verdict| verdict.state == "RUNNING")
    }
}

/// Names of properties that are the goal of a robot.
const GOAL_INPUTS: [&str; 2] = ["goal", "target"];

/// Interfaces of goals.
const GOAL_INTERFACES: [&str; 2] = ["Point2", "Pose2"];

/// Returns the goals of the robot whose Execute has its status at a path.
/// The goal of its Knowledge comes before those of other modules.
fn goals_of<I: PropertyIndex>(status: &str, index: &I) -> Vec<I::Property> {
    let Some((robot, _)) = status.trim_start_matches('/').split_once('/') else { return Vec::new() };
    let is_goal = |property: &I::Property| {
        let path = property.path().trim_start_matches('/');
        let name = path.rsplit_once('/').map(|(_, name)| name);
        is_within(path, robot)
            && name.is_some_and(|name| GOAL_INPUTS.contains(&name))
            && GOAL_INTERFACES.contains(&property.descriptor().name)
    };
    let mut goals: Vec<_> = index.properties().into_iter().filter(is_goal).collect();
    goals.sort_by_key(|goal| (!goal.path().contains("knowledge"), goal.path().to_owned()));
    goals
}

/// Returns a waiting action in words.
/// Such as `TurnAngle(1.57) reflex of rank 2, 0.1 s`.
fn waiting_text(waiting: &Value, time: u64) -> Option<String> {
    let action = waiting.get("action")?;
    let arguments = match action.get("arguments") {
        Some(Value::List(arguments)) => arguments.iter().filter_map(Value::as_f64).collect(),
        _ => Vec::new(),
    };
    let arguments: Vec<_> = arguments.iter().map(|argument: &f64| format!("{argument:.2}")).collect();
    let origin = match waiting.get("route").and_then(Value::as_str) {
        Some("REACTIVE") => format!("reflex of rank {}", waiting.get("rank").and_then(Value::as_integer)?),
        _ => format!("plan {}", waiting.get("ticket").and_then(Value::as_integer)?),
    };
    let queued = waiting.get("queued").and_then(Value::as_integer)? as u64;
    let age = time.saturating_sub(queued) as f64 * 1e-9;
    Some(format!("{}({}) {origin}, {age:.1} s", action.get("kind")?.as_str()?, arguments.join(", ")))
}

/// Finds the waiting actions of the Execute that has its status at a path.
fn waiting_of<I: PropertyIndex>(status: &str, index: &I) -> Option<I::Property> {
    let execute = status.trim_start_matches('/').strip_suffix("/status")?;
    index.find(&format!("{execute}/waiting")).ok().map(|(property, _)| property)
}

impl<P: PropertyFacts> Judged<P> {
    fn new(metrics: P, index: &impl PropertyIndex<Property = P>) -> Self {
        let judge = metrics.path();
        let judge = judge.rsplit_once('/').map_or(judge, |(judge, _)| judge).to_owned();
        let robot = index.find(&format!("{judge}/params/robot")).ok().filter(|(_, field)| field == "robot");
        Self { metrics, robot: robot.map(|(params, _)| params), judge }
    }
}

impl Judged<Arc<Property>> {
    fn metrics(&self) -> Option<JudgeMetrics> {
        let measured = value(&self.metrics)?;
        let robot = self.robot.as_ref().and_then(value);
        let robot = robot.as_ref().and_then(|params| params.get("robot")?.as_str()).unwrap_or(&self.judge);
        let mut metrics =
            JudgeMetrics { robot: robot.to_owned(), figures: SortedMap::new(), units: SortedMap::new() };
        for Field { name, unit, .. } in self.metrics.descriptor().fields {
            // A figure that does not apply is NaN.
            let number = measured.get(name).and_then(Value::as_f64).filter(|number| number.is_finite());
            let Some(number) = number else { continue };
            metrics.figures.insert((*name).to_owned(), number);
            if !unit.is_empty() {
                metrics.units.insert((*name).to_owned(), (*unit).to_owned());
            }
        }
        Some(metrics)
    }
}

impl ObservedRobot {
    /// Returns the current state of the robot; `None` before its first pose.
    pub fn now(&self) -> Option<RobotNow> {
        let whole = value(&self.pose)?;
        let mut fields = self.pose_field.split('/').filter(|field| !field.is_empty());
        let pose = fields.try_fold(&whole, |value, field| value.get(field))?;
        let number = |value: &Value, name: &str| value.get(name).and_then(Value::as_f64).unwrap_or_default();
        let mut now = RobotNow {
            x: number(pose, "x"),
            y: number(pose, "y"),
            theta: number(pose, "theta"),
            ..RobotNow::default()
        };
        if let Some(status) = self.status() {
            let text = |name: &str| status.get(name).and_then(Value::as_str).unwrap_or_default().to_owned();
            now.route = route_of(&text("route"));
            now.action = text("running");
            now.tree = text("tree");
        }
        now.clearance =
            self.clearance.as_ref().and_then(value).map(|clearance| number(&clearance, "distance"));
        Some(now)
    }

    /// Returns the position, m, and the route of the running action.
    /// `None` for a robot without Execute.
    pub fn place_and_route(&self) -> Option<([f64; 2], Option<Route>)> {
        let [route] = fields(self.status.as_ref()?, ["route".to_owned()])?;
        let within = |name: &str| format!("{}/{name}", self.pose_field).trim_start_matches('/').to_owned();
        // Both of one write.
        let [x, y] = fields(&self.pose, ["x", "y"].map(within))?;
        Some(([x.as_f64()?, y.as_f64()?], route_of(route.as_str().unwrap_or_default())))
    }

    /// Returns where the robot is to go, if it has a goal.
    pub fn goal(&self) -> Option<[f64; 2]> {
        let goal = self.goals.iter().find_map(value)?;
        Some([goal.get("x")?.as_f64()?, goal.get("y")?.as_f64()?])
    }

    /// Returns the actions that wait at a time, ns, in the order of their turns.
    /// Each with kind, arguments, origin and age.
    pub fn waiting(&self, time: u64) -> Vec<String> {
        let Some(Value::List(actions)) =
            self.waiting.as_ref().and_then(value).and_then(|waiting| waiting.get("actions").cloned())
        else {
            return Vec::new();
        };
        actions.iter().filter_map(|waiting| waiting_text(waiting, time)).collect()
    }

    /// Returns the status of the robot's Execute.
    pub fn status(&self) -> Option<Value> {
        value(self.status.as_ref()?)
    }

    /// Returns the current state of the robot as a row of the trajectory.
    pub fn sample(&self, time: u64) -> Option<Sample> {
        let now = self.now()?;
        let RobotNow { x, y, theta, route, action, .. } = now;
        Some(Sample { time, robot: self.name.clone(), x, y, theta, route, action })
    }
}

/// Returns the route of a status; `None` if no action runs.
fn route_of(name: &str) -> Option<Route> {
    match name {
        "DELIBERATIVE" => Some(Route::Deliberative),
        "REACTIVE" => Some(Route::Reactive),
        _ => None,
    }
}

/// Fields of the newest value of a property, all of one write.
fn fields<const COUNT: usize>(property: &Property, paths: [String; COUNT]) -> Option<[Value; COUNT]> {
    let (bytes, items, _) = property.newest().ok()??;
    let view = View::new(property.descriptor(), &bytes, items)?;
    let field =
        |path: &String| view.at(&slate_blackboard::interface::find(property.descriptor(), path).ok()?);
    let found: Vec<Value> = paths.iter().map_while(field).collect();
    found.try_into().ok()
}

/// Returns the newest value of a property.
/// Tools read by copying, so they hold no lock while they look.
pub fn value(property: &Arc<Property>) -> Option<Value> {
    let (bytes, items, _) = property.newest().ok()??;
    Some(View::new(property.descriptor(), &bytes, items)?.value())
}
