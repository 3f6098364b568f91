//! The sections of a recording's page.

use super::super::table::{Table, seconds};
use super::super::tracks::Series;
use super::super::{Known, PageContent, Section, SectionPart};
use super::Recording;
use crate::Error;
use crate::plot::{self, Drawing};
use crate::{Scene, Trajectory};
use slate_bag::{ChannelTopic, Unread};

impl Recording {
    fn metadata_value(&self, text: &str, key: &str) -> Option<&String> {
        self.texts.get(text)?.get(key)
    }

    /// Returns the title of the page.
    fn title(&self) -> String {
        let file = self.path.file_name().unwrap_or_default().to_string_lossy();
        let name = self.metadata_value("run", "agent").cloned().unwrap_or_else(|| file.into_owned());
        let seed = self.metadata_value("run", "seed").map_or(String::new(), |seed| format!(", seed {seed}"));
        let verdict = self.verdict.clone().unwrap_or_else(|| "recorded".into());
        let link = if self.verdict.is_some() { "after" } else { "for" };
        format!("{name}{seed}: {verdict} {link} {:.1} s", self.length as f64 * 1e-9)
    }

    fn file(&self) -> String {
        self.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// Returns the page of a recording alone.
    pub fn content(mut self, known: &Known) -> Result<PageContent, Error> {
        let (title, source) = (self.title(), format!("From the recording {}.", self.file()));
        let mut sections = vec![self.summary()];
        let trajectory = std::mem::take(&mut self.tracks).trajectory();
        sections.extend(path_pictures(
            &title,
            &format!("recording {}", self.file()),
            &known.scene,
            &trajectory,
        )?);
        let distances = self.distances(&trajectory)?;
        sections
            .extend(Some(distances).filter(|section| section.has_table() || self.texts.contains_key("run")));
        sections.extend(self.sections());
        let scene = known.scene.clone();
        Ok(PageContent { title, source, sections, unread: self.unread, scene, trajectory })
    }

    /// Messages that can't be decoded.
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
            if let Some(value) = self.metadata_value(text, key) {
                row(key, value.clone());
            }
        }
        section.table(table, "The recording is empty.");
        section
    }

    /// Draws the distances of the robots to objects and to each other.
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

    /// Returns the sections behind the pictures.
    pub fn sections(&self) -> Vec<Section> {
        let mut decisions = Section::new("Decisions");
        decisions.text(
            "Events, plans and actions, in order; a repeated event is counted in its row until the action or \
             the route changes.",
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
            missing.text("Some messages can't be decoded and are left out.");
            missing.parts.push(SectionPart::Table(unread));
        }
        let mut contents = Section::new("Contents");
        contents.table(self.contents(), "The recording is empty.");
        let mut sections = vec![decisions, timing, faults, changes, missing, contents];
        // Only recordings of agents have these.
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
            table.row([topic.clone(), messages.to_string(), slate_bag::seconds(*time), why.clone()]);
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

/// Returns the title of the picture of the start, from the title of the run.
fn start_title(title: &str) -> String {
    format!("{}: the start", title.rsplit_once(": ").map_or(title, |(run, _)| run))
}

/// Returns the pictures of the robots' paths.
fn path_pictures(
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
    section.parts.push(SectionPart::Drawn("trajectory", "The ways of the robots, by route.".into(), map));
    let timeline = plot::timeline(&drawing)?;
    section.parts.push(SectionPart::Drawn("timeline", "x and y over time, and the route.".into(), timeline));
    if !scene.robots.is_empty() {
        let start = plot::scene(&Drawing { title: start_title(&drawing.title), ..drawing })?;
        section.parts.push(SectionPart::Drawn("scene", "The start, seen from above.".into(), start));
    }
    Ok(Some(section))
}

/// Returns the distances between robots.
/// They are between the points that their poses refer to.
pub(in crate::page) fn between(trajectory: &Trajectory) -> Vec<(String, Series)> {
    /// Maximum number of robots in a readable picture.
    const MAX_LINES: usize = 4;
    let robots = trajectory.robots();
    let mut pairs = Vec::new();
    for (i, one) in robots.iter().enumerate().take(MAX_LINES) {
        for other in robots.iter().take(MAX_LINES).skip(i + 1) {
            let mut series = Series::default();
            let (mut at_one, mut at_other) = (None, None);
            for sample in &trajectory.samples {
                let position = (sample.x, sample.y);
                match sample.robot.as_str() {
                    name if name == *one => at_one = Some(position),
                    name if name == *other => at_other = Some(position),
                    _ => continue,
                }
                if let Some(((x, y), (u, v))) = at_one.zip(at_other) {
                    series.add(sample.seconds(), libm::hypot(x - u, y - v));
                }
            }
            if series.last.is_some() {
                pairs.push((format!("{one} to {other}: centers"), series));
            }
        }
    }
    pairs
}

/// Distances as a table and a picture.
pub(in crate::page) fn distances(section: &mut Section, series: Vec<(String, Series)>) -> Result<(), Error> {
    let mut table = Table::new("distances", &["between", "#least/m", "#at/s", "#median/m"]);
    let mut curves = Vec::new();
    for (name, series) in series {
        let meters = |number: Option<f64>| number.map(|meters| format!("{meters:.3}")).unwrap_or_default();
        let least = series.least;
        let at = least.map(|(at, _)| format!("{at:.3}")).unwrap_or_default();
        table.row([name.clone(), meters(least.map(|(_, meters)| meters)), at, meters(series.median())]);
        curves.push(series.curve(name));
    }
    if !curves.is_empty() {
        let svg = plot::curves("distances [m]", &curves)?;
        section.parts.push(SectionPart::Drawn("distances", "Distances over time.".into(), svg));
    }
    section.table(table, "Nothing is known of distances.");
    Ok(())
}
