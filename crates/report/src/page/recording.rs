//! The content of a recording for its page, read in one pass.

mod sections;

use std::path::{Path, PathBuf};

use slate_sorted::SortedMap;

use super::decisions::{Decisions, Names, Status, constants, format_value, units};
use super::faults::Faults;
use super::robots::followed_among;
use super::table::{Table, seconds};
use super::tracks::{RobotTracks, Series};
use super::{Followed, Known};
use crate::Sample;
pub(super) use sections::{between, distances};
use slate_bag::{ChannelTopic, Decoder, Error, Message, Unread, Value};

/// Maximum number of lines of the log or changes.
const MAX_LINES: usize = 10_000;

type Texts = SortedMap<String, String>;

/// The summarised content of a recording.
pub(super) struct Recording {
    path: PathBuf,
    texts: SortedMap<String, Texts>,
    length: u64,
    messages: u64,
    topics: Vec<ChannelTopic>,
    robots: Vec<FollowedRobot>,
    tracks: RobotTracks,
    judged: SortedMap<String, Vec<(String, String)>>,
    verdict: Option<String>,
    /// The newest histograms and counts of missed deadlines, by measured module.
    timing: SortedMap<String, Timing>,
    faults: Faults,
    log: Table,
    changes: Table,
    pub decisions: Decisions,
    dropped: SortedMap<String, u64>,
    /// Newest values of parameters and switches, reported only when they change.
    last: SortedMap<String, Value>,
    /// Messages that can't be read.
    unread: Vec<Unread>,
}

struct FollowedRobot {
    of: Followed,
    status: Status,
    names: Option<Names>,
    clearance: Series,
    /// Pose that waits for the status of Execute in the same cycle.
    waiting: Option<(u64, [f64; 3])>,
}

#[derive(Default)]
struct Timing {
    count: f64,
    nanoseconds: [f64; 4],
    misses: f64,
}

impl Recording {
    pub fn read(path: &Path, known: &Known) -> Result<Self, Error> {
        let mut reader = slate_logs::open(path)?;
        let metadata = reader.metadata()?;
        let topics = reader.topics();
        let is_there = |robot: &Followed| topics.iter().any(|topic| topic.topic == robot.pose);
        let mut followed = known.robots.clone();
        // Robots without a recorded pose can't be followed.
        followed.retain(is_there);
        if followed.is_empty() {
            followed = followed_among(&topics);
        }
        let robot = |of: Followed| FollowedRobot {
            of,
            status: Status::default(),
            names: None,
            clearance: Series::default(),
            waiting: None,
        };
        let mut recording = Self {
            path: path.into(),
            texts: metadata.into_iter().map(|metadata| (metadata.name, metadata.metadata)).collect(),
            length: 0,
            messages: 0,
            topics: Vec::new(),
            tracks: RobotTracks::new(followed.len()),
            robots: followed.into_iter().map(robot).collect(),
            judged: SortedMap::new(),
            verdict: None,
            timing: SortedMap::new(),
            faults: Faults::default(),
            log: Table::new("log", &["#time/s", "level", "who", "what"]),
            changes: Table::new("changes", &["#time/s", "what", "before", "after"]),
            decisions: Decisions::default(),
            dropped: SortedMap::new(),
            last: SortedMap::new(),
            unread: Vec::new(),
        };
        let (mut start, mut decoder, mut checker) = (reader.start(), Decoder::default(), Decoder::default());
        while let Some(message) = reader.next_message()? {
            let time = message.log_time.saturating_sub(*start.get_or_insert(message.log_time));
            recording.length = recording.length.max(time);
            recording.messages += 1;
            checker.check(&message);
            recording.take(&message, time, &mut decoder);
        }
        for robot in 0..recording.robots.len() {
            recording.place(robot);
        }
        recording.unread = checker.into_unread();
        recording.topics = reader.topics();
        recording.topics.sort_by(|a, b| a.topic.cmp(&b.topic));
        Ok(recording)
    }

    fn take(&mut self, message: &Message<'_>, time: u64, decoder: &mut Decoder) {
        let topic = &message.channel.topic;
        let schema = message.schema.map_or("", |schema| schema.name.as_str());
        let (owner, part) = topic.rsplit_once('/').unwrap_or(("", topic));
        self.follow(topic, message, time, decoder);
        match (schema, part) {
            ("slate_msgs/msg/TimingHistogram", _) => {
                let value = decoder.decode(message);
                let timing = self.timing.entry(owner.into()).or_default();
                timing.count = value.number("count").unwrap_or_default();
                timing.nanoseconds =
                    ["p50", "p90", "p99", "max"].map(|name| value.number(name).unwrap_or_default());
            }
            ("slate_msgs/msg/ModuleTiming", _) => {
                let misses = decoder.decode(message).number("misses").unwrap_or_default();
                self.timing.entry(owner.into()).or_default().misses = misses;
            }
            ("slate_msgs/msg/LoopState", _) => {
                let value = decoder.decode(message);
                let overruns = value.number("overruns").unwrap_or_default();
                self.timing.entry(owner.into()).or_default().misses = overruns;
                self.more(
                    topic,
                    time,
                    owner,
                    &value,
                    &[("overruns", "cycles left out"), ("refused_times", "times refused")],
                );
            }
            ("slate_msgs/msg/ModuleState", _) => {
                self.module(topic, time, owner, decoder.decode(message), definition(message))
            }
            ("slate_msgs/msg/GateState", _) => {
                let value = decoder.decode(message);
                let counts = [
                    ("refused", "commands refused"),
                    ("expired", "commands expired"),
                    ("limited", "commands limited"),
                ];
                self.more(topic, time, owner, &value, &counts);
            }
            ("rcl_interfaces/msg/Log", _) => self.line(time, &decoder.decode(message)),
            ("slate_msgs/msg/Change", _) => self.change(time, &decoder.decode(message)),
            ("slate_msgs/msg/Dropped", _) => {
                let value = decoder.decode(message);
                let count = value.number("values").unwrap_or_default() as u64;
                self.dropped.insert(value.text("url").unwrap_or_default(), count);
            }
            ("slate_msgs/msg/Verdict", _) => {
                let value = decoder.decode(message);
                self.verdict = value.text("reason").filter(|reason| !reason.is_empty());
            }
            (_, "metrics") => {
                let fields = metrics(&decoder.decode(message), definition(message));
                self.judged.insert(owner.trim_start_matches('/').into(), fields);
            }
            (_, "params" | "enabled") => self.setting(topic, time, decoder.decode(message)),
            (_, "change") if schema.starts_with("slate_msgs/") => self.noticed(message, time, owner, decoder),
            _ => {}
        }
    }

    /// Notes followed values of robots: poses, states of their Execute, and distances.
    fn follow(&mut self, topic: &str, message: &Message<'_>, time: u64, decoder: &mut Decoder) {
        for robot in 0..self.robots.len() {
            let Followed { name, pose, status, clearance } = &self.robots[robot].of;
            let name = name.clone();
            if pose == topic {
                let value = decoder.decode(message).pose();
                self.place(robot);
                self.robots[robot].waiting = value.map(|pose| (time, pose));
            } else if status.as_deref() == Some(topic) {
                let value = decoder.decode(message);
                let own = &mut self.robots[robot];
                let names = own.names.get_or_insert_with(|| Names::of(definition(message)));
                self.decisions.status(time, &name, &value, names, &mut own.status, own.clearance.last);
            } else if clearance.as_deref() == Some(topic)
                && let Some(distance) = decoder.decode(message).number("distance")
            {
                self.robots[robot].clearance.add(time as f64 * 1e-9, distance);
            }
        }
    }

    /// Notes a change that an Analyze has published.
    fn noticed(&mut self, message: &Message<'_>, time: u64, owner: &str, decoder: &mut Decoder) {
        let robot = owner.trim_start_matches('/').split('/').next().unwrap_or_default().to_owned();
        let own = self.robots.iter().find(|own| own.of.name == robot);
        let clearance = own.and_then(|own| own.clearance.last);
        let text = format_value(&decoder.decode(message), definition(message));
        let detail = if text.is_empty() { owner.to_owned() } else { format!("{owner}: {text}") };
        self.decisions.add(time, &robot, "noticed", detail, 1, clearance);
    }

    /// Notes the pose of a robot, with the newest state of its Execute.
    fn place(&mut self, robot: usize) {
        let own = &mut self.robots[robot];
        let Some((time, [x, y, theta])) = own.waiting.take() else { return };
        let (route, action) = (own.status.route, own.status.running.clone());
        self.tracks.add(robot, Sample { time, robot: own.of.name.clone(), x, y, theta, route, action });
    }

    /// Counts that have grown.
    fn more(&mut self, topic: &str, time: u64, owner: &str, value: &Value, counts: &[(&str, &str)]) {
        let before = self.last.get(topic);
        for (name, what) in counts {
            let count = |value: &Value| value.number(name).unwrap_or_default();
            let (now, before) = (count(value), before.map_or(0.0, count));
            if now > before {
                self.faults.count(time, owner, what, now - before, now);
            }
        }
        self.last.insert(topic.into(), value.clone());
    }

    fn module(&mut self, topic: &str, time: u64, owner: &str, value: Value, definition: &str) {
        let names = constants(definition, "CONDITION_");
        let condition = |value: &Value| {
            let number = value.number("condition").unwrap_or_default();
            names.get(&(number as i64)).cloned().unwrap_or_else(|| format!("condition {number}"))
        };
        let now = condition(&value);
        let before = self.last.get(topic).map(condition);
        let is_well = ["working", "inactive"].contains(&now.as_str());
        let is_change = match &before {
            None => !is_well,
            Some(before) => *before != now,
        };
        if is_change {
            let before = before.map_or(String::new(), |before| format!(", before {before}"));
            self.faults.note(time, owner, format!("is {now}{before}"));
        }
        self.more(topic, time, owner, &value, &[("panics", "panics")]);
    }

    fn line(&mut self, time: u64, value: &Value) {
        let level = value.number("level").unwrap_or_default();
        if level < 30.0 || self.log.rows.len() >= MAX_LINES {
            return;
        }
        let name = if level < 40.0 { "warn" } else { "error" };
        let text = |name: &str| value.text(name).unwrap_or_default();
        self.log.row([seconds(time), name.into(), text("name"), text("msg")]);
    }

    fn change(&mut self, time: u64, value: &Value) {
        if self.changes.rows.len() >= MAX_LINES {
            return;
        }
        let text = |name: &str| value.text(name).unwrap_or_default();
        let (setting, plugin) = (text("setting"), text("plugin"));
        let is_set = value.number("has_value").is_some_and(|is| is != 0.0);
        let after = if is_set { text("value") } else { "the value of the files".into() };
        let (action, file) = (text("action"), text("file"));
        let library =
            || if plugin.is_empty() { format!("library {file}") } else { format!("plugin {plugin}") };
        let from = |done: &str| if file.is_empty() { done.to_owned() } else { format!("{done} from {file}") };
        if action == "order" || action == "ask" {
            // Its effects are changes of their own.
            return;
        }
        let by = if action == "own" { plugin.as_str() } else { "from outside" }.to_owned();
        let (what, after) = match action.as_str() {
            "own" => (setting, after),
            "load" => (library(), from("loaded")),
            "unload" => (library(), "unloaded".into()),
            "arm" => ("arm".into(), if is_set { text("value") } else { "all actuators".into() }),
            "" if !setting.is_empty() => (setting, after),
            "" if !plugin.is_empty() => (library(), from("reloaded")),
            "" => (text("value"), "done".into()),
            // A stop with its reason, and a reset.
            action => (action.to_owned(), if is_set { text("value") } else { "done".into() }),
        };
        self.changes.row([seconds(time), format!("{by}: {what}"), String::new(), after]);
    }

    /// Notes a parameter or a switch with a new value.
    fn setting(&mut self, topic: &str, time: u64, value: Value) {
        let fields = value.fields(false);
        let before = self.last.insert(topic.into(), value).map(|before| before.fields(false));
        for ((name, now), (_, before)) in fields.iter().zip(before.iter().flatten()) {
            if now != before && self.changes.rows.len() < MAX_LINES {
                self.changes.row([seconds(time), format!("{topic}/{name}"), before.clone(), now.clone()]);
            }
        }
    }
}

/// Returns the definition of a message; empty if it has none.
fn definition<'a>(message: &Message<'a>) -> &'a str {
    message.schema.map_or("", |schema| std::str::from_utf8(&schema.data).unwrap_or_default())
}

/// Returns the metrics of a referee, each with its unit.
fn metrics(value: &Value, definition: &str) -> Vec<(String, String)> {
    let units = units(definition);
    let mut fields = value.fields(false);
    for (name, value) in &mut fields {
        if let Ok(number) = value.parse::<f64>() {
            // Counts have no decimals, and what does not apply is not a number.
            let decimals = if number.fract() == 0.0 { 0 } else { 3 };
            let unit = units.get(name).map_or("", String::as_str);
            *value = match number.is_finite() {
                true => format!("{number:.decimals$} {unit}").trim_end().to_owned(),
                false => "none".into(),
            };
        }
    }
    fields
}
