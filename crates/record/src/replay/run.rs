//! What a recording says of its run.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use slate_blackboard::is_within;
use slate_runtime::configuration::{Configuration, Database, Link, Report};
use slate_runtime::recording::{Change, configuration};

use super::file::{Item, ReadError, Source};
use super::reel::Reel;
use crate::bag::{Error, Metadata, Reader};
use crate::recorder::{CHANGE, CONFIGURATION, DROPPED, read_change};

type Texts = BTreeMap<String, String>;

/// A run, as a recording has it.
#[derive(Clone, Debug, Default)]
pub struct Run {
    about: Texts,
    pub(super) plugins: Texts,
    pub(super) memories: Texts,
    /// The types of its modules.
    pub(super) modules: Texts,
    /// The order in which they ran, stage by stage.
    stages: Texts,
    text: Option<String>,
    /// What was changed from outside, each after the cycle of that number.
    pub(super) changes: Vec<(u64, Change)>,
    end: Option<Texts>,
    drops: bool,
}

impl Run {
    /// Reads what a recording says of its run.
    ///
    /// # Errors
    /// When it can't be read, or is damaged.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        let mut source = Source::open(path)?;
        let (mut run, mut changes, mut dropped) = (Self::default(), None::<u16>, None::<u16>);
        while let Some(item) = source.next(|channel| [changes, dropped].contains(&Some(channel)))? {
            match item {
                Item::Metadata(name, texts) => match name.as_str() {
                    "run" => run.about = texts,
                    "plugins" => run.plugins = texts,
                    "memories" => run.memories = texts,
                    "end" => run.end = Some(texts),
                    _ => {}
                },
                Item::Attachment(name, bytes) if name == CONFIGURATION => {
                    let text = String::from_utf8(bytes);
                    run.text = Some(text.map_err(|_| source.error("its configuration is no text"))?);
                }
                Item::Channel(channel) if channel.topic == CHANGE.name => changes = Some(channel.id),
                Item::Channel(channel) if channel.topic == DROPPED.name => dropped = Some(channel.id),
                Item::Message(header, bytes) if Some(header.channel_id) == changes => {
                    let change = read_change(&bytes);
                    let change = change.ok_or_else(|| source.error("a change in it can't be read"))?;
                    run.changes.push(change);
                }
                Item::Message(header, _) if Some(header.channel_id) == dropped => run.drops = true,
                _ => {}
            }
        }
        if run.about.is_empty() {
            return Err(source.error("it says nothing of its run, so it is no recording of an agent"));
        }
        // Those of one cycle stay in their order.
        run.changes.sort_by_key(|(cycle, _)| *cycle);
        Ok(run)
    }

    /// As [`read`](Run::read), strictly; nothing when it is no recording of an agent.
    pub(super) fn of(path: &Path) -> Result<Option<Self>, Error> {
        let mut reader = Reader::open(path)?;
        let mut run = Self::default();
        for Metadata { name, metadata } in reader.metadata()? {
            match name.as_str() {
                "run" => run.about = metadata,
                "modules" => run.modules = metadata,
                "stages" => run.stages = metadata,
                "plugins" => run.plugins = metadata,
                "memories" => run.memories = metadata,
                "end" => run.end = Some(metadata),
                _ => {}
            }
        }
        for number in 0..reader.attachments() {
            let attachment = reader.attachment(number)?.filter(|attachment| attachment.name == CONFIGURATION);
            let text = attachment.and_then(|attachment| String::from_utf8(attachment.data).ok());
            run.text = text.or(run.text);
        }
        Ok((!run.about.is_empty() && run.text.is_some()).then_some(run))
    }

    /// What is added to the agent's time for that of the file, nanoseconds.
    pub(super) fn epoch(&self) -> u64 {
        self.about("epoch_ns").parse().unwrap_or_default()
    }

    /// Whether it was in lockstep.
    pub(super) fn is_lockstep(&self) -> bool {
        self.about("clock") == "lockstep"
    }

    /// Whether everything that was written is recorded, from the beginning.
    pub(super) fn is_whole(&self) -> bool {
        self.about("whole") == "true" && self.about("from_cycle") == "0"
    }

    /// Has modules run in the place of what is recorded of them, and see of the others what they saw then.
    pub(super) fn replace(&self, reel: &mut Reel, configuration: &Configuration, modules: &BTreeSet<String>) {
        let order: Vec<&str> = self.stages.values().flat_map(|stage| stage.split_whitespace()).collect();
        let place = |module: &str| order.iter().position(|own| *own == module);
        let owner = |path: &str| {
            let owns =
                |name: &&String| path.strip_prefix(name.as_str()).is_some_and(|rest| rest.starts_with('/'));
            self.modules.keys().filter(owns).max_by_key(|name| name.len())
        };
        for (track, played) in reel.timeline.tracks.iter().zip(&mut reel.played) {
            let gate = configuration.actuators().iter().find(|own| is_within(&track.path, &own.name.value));
            // A gate is moved by those who command it.
            let mut writers: BTreeSet<&str> = owner(&track.path).map(String::as_str).into_iter().collect();
            let commands = gate.into_iter().flat_map(|gate| &gate.commands).map(|url| url.value.path_in(""));
            let commands: Vec<String> = commands.collect();
            if writers.is_empty() {
                writers.extend(commands.iter().filter_map(|path| owner(path)).map(String::as_str));
                writers
                    .extend(gate.into_iter().flat_map(|gate| &gate.modules).map(|name| name.value.as_str()));
            }
            if writers.iter().any(|writer| modules.contains(*writer)) {
                *played = None;
                continue;
            }
            let Some(last) = writers.iter().filter_map(|writer| place(writer)).max() else { continue };
            let before = modules.iter().filter(|module| place(module).is_some_and(|own| own < last));
            *played = Some(before.cloned().collect());
        }
    }

    /// The agent.
    pub fn agent(&self) -> &str {
        self.about("agent")
    }

    /// The configuration that it had, to load an agent like it; `sets` are settings of the command line that go over it.
    ///
    /// # Errors
    /// When it is none any more, or a setting is wrong.
    pub fn configuration(&self, sets: Vec<String>) -> Result<Database, Report> {
        let name = format!("the recording of {}", self.agent());
        // Files that the run wrote are not written again. Each setting has a line.
        let writes =
            |line: &&str| ["record.", "snapshot.", "log.targets."].iter().any(|own| line.starts_with(own));
        let lines = self.text.as_deref().unwrap_or_default().lines().filter(|line| !writes(line));
        configuration(&name, &lines.collect::<Vec<_>>().join("\n"), sets)
    }

    /// Whether its actuators were armed from the start.
    pub fn is_armed(&self) -> bool {
        self.about("armed") == "true"
    }

    /// Why a run with that configuration can't be made again, if it can't.
    pub fn obstacle_in(&self, configuration: &Configuration) -> Option<String> {
        let own = configuration.agent_name();
        let is_remote = |link: &Link| link.from.value.agent().is_some_and(|agent| agent != own);
        let takes_part = configuration.share().is_some() || configuration.links().iter().any(is_remote);
        takes_part.then(|| "values of other agents may have come into the run".into())
    }

    /// Whether messages to modules are among what is recorded.
    pub(super) fn has_messages(&self) -> bool {
        self.about("messages") == "true"
    }

    fn about(&self, key: &str) -> &str {
        self.about.get(key).map_or("", String::as_str)
    }

    /// Something that is known at the end.
    pub(super) fn end(&self, key: &str) -> Option<&str> {
        self.end.as_ref()?.get(key).map(String::as_str)
    }

    /// How many cycles it had, if it has an end.
    pub(super) fn cycles(&self) -> Option<u64> {
        self.end("cycles")?.parse().ok()
    }

    /// Why the run can't be made again, if it can't.
    pub fn obstacle(&self) -> Option<String> {
        if self.about("clock") != "lockstep" {
            return Some("the run was not in lockstep: on the wall clock no two runs are the same".into());
        }
        if self.about("whole") != "true" {
            return Some(
                "only a part of the values is recorded (`record.select`, `record.exclude`, `record.rules`)"
                    .into(),
            );
        }
        if self.about("begins") == "in the run" || self.about("from_cycle") != "0" {
            return Some("the recording does not begin with the run".into());
        }
        if self.text.is_none() {
            return Some("the recording has no configuration".into());
        }
        if self.drops || self.end("dropped").is_some_and(|dropped| dropped != "0") {
            return Some("values are missing in the recording".into());
        }
        let other = self.changes.iter().find_map(|(cycle, change)| match change {
            Change::Other { what } => Some(format!("after cycle {cycle} there was {what}")),
            _ => None,
        });
        other.map(|other| format!("{other}, which can't be made again"))
    }
}
