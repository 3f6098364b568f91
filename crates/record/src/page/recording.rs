//! What a page tells of a recording, read once from its beginning to its end.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::decisions::{Decisions, Names, Status, constants, said, units};
use super::faults::Faults;
use super::robots::Followed;
use super::table::{Table, seconds};
use super::tracks::{Series, Tracks};
use super::{Known, Part, Section, Story};
use crate::bag::{ChannelTopic, Decoder, Error, Message, Unread, Value};
use crate::plot::{self, Drawing};
use crate::{Sample, Scene, Trajectory};

/// More lines of the log or changes are not kept.
const MOST: usize = 10_000;

type Texts = BTreeMap<String, String>;

/// What is known of a recording.
pub(super) struct Recording {
    path: PathBuf,
    texts: BTreeMap<String, Texts>,
    length: u64,
    messages: u64,
    topics: Vec<ChannelTopic>,
    robots: Vec<Robot>,
    tracks: Tracks,
    judged: BTreeMap<String, Vec<(String, String)>>,
    verdict: Option<String>,
    /// The newest histograms and counts of deadlines that were missed, by who was measured.
    timing: BTreeMap<String, Timing>,
    faults: Faults,
    log: Table,
    changes: Table,
    pub decisions: Decisions,
    dropped: BTreeMap<String, u64>,
    /// The values that have been seen last, of what is told only when it changes.
    last: BTreeMap<String, Value>,
    /// Messages that can't be read.
    unread: Vec<Unread>,
}

struct Robot {
    of: Followed,
    status: Status,
    names: Option<Names>,
    clearance: Series,
    /// A place waits for what Execute says in the same cycle.
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
        let mut reader = crate::logs::open(path)?;
        let metadata = reader.metadata()?;
        let topics = reader.topics();
        let is_there = |robot: &Followed| topics.iter().any(|topic| topic.topic == robot.pose);
        let mut followed = known.robots.clone();
        // What was not recorded can't be followed.
        followed.retain(is_there);
        if followed.is_empty() {
            followed = Followed::among(&topics);
        }
        let robot = |of: Followed| Robot {
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
            tracks: Tracks::new(followed.len()),
            robots: followed.into_iter().map(robot).collect(),
            judged: BTreeMap::new(),
            verdict: None,
            timing: BTreeMap::new(),
            faults: Faults::default(),
            log: Table::new("log", &["#time/s", "level", "who", "what"]),
            changes: Table::new("changes", &["#time/s", "what", "before", "after"]),
            decisions: Decisions::default(),
            dropped: BTreeMap::new(),
            last: BTreeMap::new(),
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
        let definition =
            || message.schema.map_or("", |schema| std::str::from_utf8(&schema.data).unwrap_or_default());
        let (owner, part) = topic.rsplit_once('/').unwrap_or(("", topic));
        let at = time as f64 * 1e-9;
        for robot in 0..self.robots.len() {
            let Followed { name, pose, status, clearance } = &self.robots[robot].of;
            let name = name.clone();
            if pose == topic {
                let value = decoder.decode(message).pose();
                self.place(robot);
                self.robots[robot].waiting = value.map(|pose| (time, pose));
            } else if status.as_ref() == Some(topic) {
                let value = decoder.decode(message);
                let own = &mut self.robots[robot];
                let names = own.names.get_or_insert_with(|| Names::of(definition()));
                self.decisions.status(time, &name, &value, names, &mut own.status, own.clearance.last);
            } else if clearance.as_ref() == Some(topic)
                && let Some(distance) = decoder.decode(message).number("distance")
            {
                self.robots[robot].clearance.add(at, distance);
            }
        }
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
                self.module(topic, time, owner, decoder.decode(message), definition())
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
                let units = units(definition());
                let mut fields = decoder.decode(message).fields(false);
                for (name, value) in &mut fields {
                    if let Ok(number) = value.parse::<f64>() {
                        // Counts have no decimals, and what does not apply is no number.
                        let decimals = if number.fract() == 0.0 { 0 } else { 3 };
                        let unit = units.get(name).map_or("", String::as_str);
                        *value = match number.is_finite() {
                            true => format!("{number:.decimals$} {unit}").trim_end().to_owned(),
                            false => "none".into(),
                        };
                    }
                }
                self.judged.insert(owner.trim_start_matches('/').into(), fields);
            }
            (_, "params" | "enabled") => self.setting(topic, time, decoder.decode(message)),
            (_, "change") if schema.starts_with("slate_msgs/") => {
                let robot = owner.trim_start_matches('/').split('/').next().unwrap_or_default().to_owned();
                let own = self.robots.iter().find(|own| own.of.name == robot);
                let clearance = own.and_then(|own| own.clearance.last);
                let said = said(&decoder.decode(message), definition());
                let detail = if said.is_empty() { owner.to_owned() } else { format!("{owner}: {said}") };
                self.decisions.add(time, &robot, "noticed", detail, 1, clearance);
            }
            _ => {}
        }
    }

    /// Where a robot is, with what Execute has said of it since.
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
        if level < 30.0 || self.log.rows.len() >= MOST {
            return;
        }
        let name = if level < 40.0 { "warn" } else { "error" };
        let text = |name: &str| value.text(name).unwrap_or_default();
        self.log.row([seconds(time), name.into(), text("name"), text("msg")]);
    }

    fn change(&mut self, time: u64, value: &Value) {
        if self.changes.rows.len() >= MOST {
            return;
        }
        let text = |name: &str| value.text(name).unwrap_or_default();
        let (setting, plugin) = (text("setting"), text("plugin"));
        let is_set = value.number("has_value").is_some_and(|is| is != 0.0);
        let after = if is_set { text("value") } else { "as the files say it".into() };
        let (action, file) = (text("action"), text("file"));
        let library =
            || if plugin.is_empty() { format!("library {file}") } else { format!("plugin {plugin}") };
        let from = |done: &str| if file.is_empty() { done.to_owned() } else { format!("{done} from {file}") };
        if action == "order" || action == "ask" {
            // What came of it are changes of its own.
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

    /// A parameter or a switch that has another value than before.
    fn setting(&mut self, topic: &str, time: u64, value: Value) {
        let fields = value.fields(false);
        let before = self.last.insert(topic.into(), value).map(|before| before.fields(false));
        for ((name, now), (_, before)) in fields.iter().zip(before.iter().flatten()) {
            if now != before && self.changes.rows.len() < MOST {
                self.changes.row([seconds(time), format!("{topic}/{name}"), before.clone(), now.clone()]);
            }
        }
    }

    fn about(&self, text: &str, key: &str) -> Option<&String> {
        self.texts.get(text)?.get(key)
    }

    /// What stands above the page.
    fn title(&self) -> String {
        let file = self.path.file_name().unwrap_or_default().to_string_lossy();
        let name = self.about("run", "agent").cloned().unwrap_or_else(|| file.into_owned());
        let seed = self.about("run", "seed").map_or(String::new(), |seed| format!(", seed {seed}"));
        let verdict = self.verdict.clone().unwrap_or_else(|| "recorded".into());
        let link = if self.verdict.is_some() { "after" } else { "for" };
        format!("{name}{seed}: {verdict} {link} {:.1} s", self.length as f64 * 1e-9)
    }

    fn file(&self) -> String {
        self.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// The page of a recording alone.
    pub fn tell(mut self, known: &Known) -> Result<Story, Error> {
        let (title, source) = (self.title(), format!("From the recording {}.", self.file()));
        let mut sections = vec![self.summary()];
        let trajectory = std::mem::take(&mut self.tracks).trajectory();
        sections.extend(ways(&title, &format!("recording {}", self.file()), &known.scene, &trajectory)?);
        let distances = self.distances(&trajectory)?;
        sections
            .extend(Some(distances).filter(|section| section.has_table() || self.texts.contains_key("run")));
        sections.extend(self.sections());
        Ok(Story { title, source, sections, unread: self.unread })
    }

    /// What of it can't be read.
    pub fn unread(self) -> Vec<Unread> {
        self.unread
    }

    fn summary(&self) -> Section {
        let mut section = Section::new("Summary");
        let mut table = Table::new("summary", &["what", "value"]);
        let mut row = |what: &str, value: String| table.row([what.into(), value]);
        let own = self.robots.iter().filter(|robot| robot.status.is_known());
        let counts: Vec<_> = own.map(|robot| (&robot.of.name, robot.status.counts())).collect();
        if let Some(verdict) = &self.verdict {
            row("verdict", verdict.clone());
        }
        row("length", format!("{} s", seconds(self.length)));
        row("messages", self.messages.to_string());
        for (judge, fields) in &self.judged {
            for (name, value) in fields {
                row(&format!("{judge}: {}", name.replace('_', " ")), value.clone());
            }
        }
        for (robot, [reflexes, switches]) in counts {
            row(&format!("{robot}: reflexes"), reflexes.to_string());
            row(&format!("{robot}: route switches"), switches.to_string());
        }
        for (text, key) in
            [("run", "agent"), ("run", "seed"), ("run", "clock"), ("end", "cycles"), ("end", "digest")]
        {
            if let Some(value) = self.about(text, key) {
                row(key, value.clone());
            }
        }
        section.table(table, "The recording is empty.");
        section
    }

    /// How far the robots were from other things, and from each other.
    pub fn distances(&mut self, trajectory: &Trajectory) -> Result<Section, Error> {
        let mut section = Section::new("Distances");
        let mut series: Vec<(String, Series)> = self
            .robots
            .iter_mut()
            .filter(|robot| robot.clearance.last.is_some())
            .map(|robot| (format!("{}: to anything", robot.of.name), std::mem::take(&mut robot.clearance)))
            .collect();
        series.extend(between(trajectory));
        distances(&mut section, series)?;
        Ok(section)
    }

    /// What follows the pictures.
    pub fn sections(&self) -> Vec<Section> {
        let mut decisions = Section::new("Decisions");
        decisions.text(
            "What was noticed, planned and done, in order; the same thing again is counted in its row until the action or the route \
             changes.",
        );
        decisions.table(self.decisions.table(), "The recording has no decisions of robots.");
        if self.decisions.left_out() > 0 {
            decisions.text(format!("{} later ones are left out.", self.decisions.left_out()));
        }
        let mut timing = Section::new("Timing");
        timing.text(
            "How long ticks and cycles took on the wall clock, over the last measured window. Late are ticks that took longer than their \
             deadline, and cycles that were left out.",
        );
        timing.table(self.timing(), "The recording has no timing.");
        let mut faults = Section::new("Faults and warnings");
        faults.table(self.faults.table(), "No module left its work, and nothing was refused.");
        faults.table(self.log.clone(), "The log has no line of level warn or above.");
        let mut changes = Section::new("Changed while it ran");
        changes.table(self.changes.clone(), "No parameter, setting or plugin was changed.");
        let mut missing = Section::new("Missing");
        missing.table(self.missing(), "Nothing that should have been recorded was dropped.");
        let unread = self.unreadable();
        if !unread.is_empty() {
            missing.text("Some messages are no values that can be read, so nothing is told of them.");
            missing.parts.push(Part::Table(unread));
        }
        let mut contents = Section::new("Contents");
        contents.table(self.contents(), "The recording is empty.");
        let mut sections = vec![decisions, timing, faults, changes, missing, contents];
        // Nobody misses these in what is no recording of an agent.
        if !self.texts.contains_key("run") {
            sections.retain(Section::has_table);
        }
        sections
    }

    fn timing(&self) -> Table {
        let columns = ["of what", "#measured", "#p50/µs", "#p90/µs", "#p99/µs", "#max/µs", "#late"];
        let mut table = Table::new("timing", &columns);
        for (owner, timing) in &self.timing {
            let micro = timing.nanoseconds.map(|number| format!("{:.1}", number / 1000.0));
            let row = [owner.clone(), timing.count.to_string()].into_iter().chain(micro);
            table.row(row.chain([timing.misses.to_string()]));
        }
        table
    }

    fn missing(&self) -> Table {
        let mut dropped = self.dropped.clone();
        for (topic, count) in self.texts.get("dropped").into_iter().flatten() {
            dropped.insert(topic.clone(), count.parse().unwrap_or_default());
        }
        let mut table = Table::new("dropped", &["property", "#values dropped"]);
        for (topic, count) in dropped.into_iter().filter(|(_, count)| *count > 0) {
            table.row([topic, count.to_string()]);
        }
        table
    }

    fn unreadable(&self) -> Table {
        let mut table = Table::new("unread", &["topic", "#messages", "#first at/s", "why"]);
        for Unread { topic, messages, time, why } in &self.unread {
            table.row([topic.clone(), messages.to_string(), crate::bag::seconds(*time), why.clone()]);
        }
        table
    }

    fn contents(&self) -> Table {
        let mut table = Table::new("topics", &["topic", "type", "#messages"]);
        for ChannelTopic { topic, schema, count } in &self.topics {
            table.row([topic.clone(), schema.clone(), count.to_string()]);
        }
        table
    }
}

/// The title of a picture of the start of what has that title.
fn start_title(title: &str) -> String {
    format!("{}: the start", title.rsplit_once(": ").map_or(title, |(run, _)| run))
}

/// The pictures of the ways of robots.
pub(super) fn ways(
    title: &str,
    caption: &str,
    scene: &Scene,
    trajectory: &Trajectory,
) -> Result<Option<Section>, Error> {
    if trajectory.samples.is_empty() {
        return Ok(None);
    }
    let (title, caption) = (title.to_owned(), caption.to_owned());
    let drawing = Drawing { title, caption, scene, trajectory };
    let mut section = Section::new("Ways");
    let map = plot::map(&drawing)?;
    section.parts.push(Part::Drawn("trajectory", "The ways of the robots, by route.".into(), map));
    let timeline = plot::timeline(&drawing)?;
    section.parts.push(Part::Drawn("timeline", "x and y over time, and the route.".into(), timeline));
    if !scene.robots.is_empty() {
        let start = plot::scene(&Drawing { title: start_title(&drawing.title), ..drawing })?;
        section.parts.push(Part::Drawn("scene", "The start, seen from above.".into(), start));
    }
    Ok(Some(section))
}

/// How far robots are from each other: between the points that their poses are of.
pub(super) fn between(trajectory: &Trajectory) -> Vec<(String, Series)> {
    /// Of more, no picture can be read.
    const MOST: usize = 4;
    let robots = trajectory.robots();
    let mut pairs = Vec::new();
    for (i, one) in robots.iter().enumerate().take(MOST) {
        for other in robots.iter().take(MOST).skip(i + 1) {
            let mut series = Series::default();
            let (mut at_one, mut at_other) = (None, None);
            for sample in &trajectory.samples {
                let place = (sample.x, sample.y);
                match sample.robot.as_str() {
                    name if name == *one => at_one = Some(place),
                    name if name == *other => at_other = Some(place),
                    _ => continue,
                }
                if let Some(((x, y), (u, v))) = at_one.zip(at_other) {
                    series.add(sample.seconds(), libm::hypot(x - u, y - v));
                }
            }
            if series.last.is_some() {
                pairs.push((format!("{one} to {other}: centres"), series));
            }
        }
    }
    pairs
}

/// Distances as a table and a picture.
pub(super) fn distances(section: &mut Section, series: Vec<(String, Series)>) -> Result<(), Error> {
    let mut table = Table::new("distances", &["between", "#least/m", "#at/s", "#median/m"]);
    let mut curves = Vec::new();
    for (name, series) in series {
        let metres = |number: Option<f64>| number.map(|metres| format!("{metres:.3}")).unwrap_or_default();
        let least = series.least;
        let at = least.map(|(at, _)| format!("{at:.3}")).unwrap_or_default();
        table.row([name.clone(), metres(least.map(|(_, metres)| metres)), at, metres(series.median())]);
        curves.push(series.curve(name));
    }
    if !curves.is_empty() {
        let svg = plot::curves("distances [m]", &curves)?;
        section.parts.push(Part::Drawn("distances", "Distances over time.".into(), svg));
    }
    section.table(table, "Nothing is known of distances.");
    Ok(())
}
