//! The run of a recording.

use std::io::{Read, Seek};
use std::path::Path;

use slate_blackboard::is_within;
use slate_runtime::configuration::{Configuration, Database, Link, RecordSelection, Report};
use slate_runtime::recording::{Change, configuration};
use slate_sorted::{SortedMap, SortedSet};

use super::changes::PastChange;
use super::coverage::{Coverage, abbreviated_list};
use super::timeline::Timeline;
use slate_bag::{Error, Message, Metadata, REPAIR, Reader};
use slate_record::capture::{read_change, repeats};
use slate_record::{CHANGE_TOPIC, CONFIGURATION, DROPPED_TOPIC};

type Texts = SortedMap<String, String>;

/// Modules by the paths of their outputs.
pub(super) type Written = SortedMap<String, SortedSet<String>>;

/// The run of a recording.
#[derive(Clone, Debug, Default)]
pub struct Run {
    about: Texts,
    pub(super) plugins: Texts,
    pub(super) memories: Texts,
    /// The types of its modules.
    pub(super) modules: Texts,
    /// The order in which they ran, stage by stage.
    pub(super) stages: Texts,
    /// Links of its inputs.
    links: Texts,
    /// Inputs that programs outside of the agent filled, each with its source.
    pub(super) external: Texts,
    text: Option<String>,
    /// Files attached beside it: names and content.
    files: Vec<(String, Vec<u8>)>,
    /// Number of messages without a checksum in a repaired file.
    unchecked: u64,
    /// Properties never written until the recording ended, as far as known.
    unwritten: Texts,
    /// Set if the recording is of the last seconds, which were kept in memory.
    is_flight: bool,
    /// Changes from outside, each after a cycle, in the order in which they were made.
    pub(super) changes: Vec<PastChange>,
    end: Option<Texts>,
    drops: bool,
    /// Set if the file has another run.
    has_others: bool,
    coverage: Coverage,
}

impl Run {
    /// Reads the run of a recording, which may be truncated.
    /// Values are read only where necessary.
    ///
    /// # Errors
    /// When it can't be read, is damaged, or is not a recording of an agent.
    pub fn read(path: &Path) -> Result<Self, Error> {
        Self::read_all(&mut Reader::open_unfinished(path)?)
    }

    /// Reads the run at the beginning of `reader`, as [`read`](Run::read) does.
    pub(super) fn read_all<R: Read + Seek>(reader: &mut Reader<R>) -> Result<Self, Error> {
        let path = reader.path().to_owned();
        let unfit = |what: &str| Error::Unfit { path: path.clone(), what: what.into() };
        let mut run = Self::head(reader)?;
        if run.about.is_empty() {
            return Err(unfit(
                "it has no record of its run, so it is not a recording of an agent; `slate bag info` describes it",
            ));
        }
        let unread = || unfit("a change in it can't be read: another version of Slate has written it");
        let (mut changes, mut drops) = (Vec::new(), false);
        let mut note = |message: &Message<'_>| {
            match message.channel.topic.as_str() {
                topic if topic == CHANGE_TOPIC.name => {
                    let (after, change) = read_change(message.data).ok_or_else(unread)?;
                    changes.push(PastChange { after, number: message.sequence, change });
                }
                topic => drops |= topic == DROPPED_TOPIC.name,
            }
            Ok(())
        };
        // Of a file that has as much as it should, only what came from outside is looked at here.
        let summary = Coverage::from_summary(reader)
            .filter(|summary| run.has_all_of(summary) && run.end("values").is_some());
        let is_known =
            summary.is_some() && reader.each_of(&[CHANGE_TOPIC.name, DROPPED_TOPIC.name], &mut note)?;
        match summary.filter(|_| is_known) {
            Some(summary) => run.coverage = summary,
            None => {
                while let Some(message) = reader.next_message()? {
                    run.coverage.note(&message);
                    note(&message)?;
                }
            }
        }
        (run.changes, run.drops) = (changes, drops);
        // Those without a number stay in the order of the file.
        run.changes.sort_by_key(|own| (own.after, own.number));
        Ok(run)
    }

    /// Reads metadata and attachments.
    fn head<R: Read + Seek>(reader: &mut Reader<R>) -> Result<Self, Error> {
        let mut run = Self::default();
        for Metadata { name, metadata } in reader.metadata()? {
            match name.as_str() {
                "run" => {
                    run.has_others |= !run.about.is_empty() && run.about != metadata;
                    run.about = metadata;
                }
                "modules" => run.modules = metadata,
                "stages" => run.stages = metadata,
                "links" => run.links = metadata,
                "external" => run.external = metadata,
                "plugins" => run.plugins = metadata,
                "memories" => run.memories = metadata,
                "unwritten" => run.unwritten = metadata,
                "flight" => run.is_flight = true,
                REPAIR => {
                    let count = metadata.get("without_checksum").and_then(|count| count.parse().ok());
                    run.unchecked = run.unchecked.saturating_add(count.unwrap_or(0));
                }
                "end" => run.end = Some(metadata),
                _ => {}
            }
        }
        for number in 0..reader.attachments() {
            match reader.attachment(number)? {
                Some(own) if own.name == CONFIGURATION => {
                    run.text = String::from_utf8(own.data).ok().or(run.text);
                }
                own => run.files.extend(own.map(|own| (own.name, own.data))),
            }
        }
        Ok(run)
    }

    /// Reads metadata and attachments of a whole file.
    /// `None` if it is not a recording of an agent.
    pub(super) fn of(path: &Path) -> Result<Option<Self>, Error> {
        let run = Self::head(&mut Reader::open(path)?)?;
        Ok((!run.about.is_empty() && run.text.is_some()).then_some(run))
    }

    /// Returns the offset from the agent's time to that of the file, nanoseconds.
    pub(super) fn epoch(&self) -> u64 {
        self.about("epoch_ns").parse().unwrap_or_default()
    }

    /// Returns true if the run was in lockstep.
    pub(super) fn is_lockstep(&self) -> bool {
        self.about("clock") == "lockstep"
    }

    /// Returns true if every written value is recorded, from the beginning.
    fn is_whole(&self) -> bool {
        self.about("whole") == "true" && self.about("from_cycle") == "0"
    }

    /// Returns true if [`is_whole`](Run::is_whole), and the file has all its values.
    pub(super) fn has_all_of(&self, coverage: &Coverage) -> bool {
        let recorded: Option<u64> = self.end("values").and_then(|values| values.parse().ok());
        self.is_whole() && recorded.is_none_or(|recorded| recorded == coverage.values)
    }

    /// Returns the recorded selection, if the recording was made by its configuration.
    pub(super) fn selection(&self) -> Option<RecordSelection> {
        let text = self.text.as_deref().filter(|_| self.is_first() && !self.is_whole())?;
        let database = configuration("the recording", text, Vec::new()).ok()?;
        Some(database.current().record().selection.clone())
    }

    /// Returns true if the recording began with the run, as its configuration says.
    pub(super) fn is_first(&self) -> bool {
        self.about("begins") != "in the run"
    }

    /// Returns the number of cycles before the one of the first value.
    /// If a recording begins while the agent runs, the time of that value gives it, because cycles continued while its
    /// file was created.
    pub(super) fn cycles_before(&self, first: u64, period: u64) -> u64 {
        let is_late = !["", "0"].contains(&self.about("from_cycle"));
        if is_late { first.saturating_add(period / 2).checked_div(period).unwrap_or_default() } else { 0 }
    }

    /// Describes a late beginning: the recording was begun while the agent ran.
    /// `None` if it began with the run.
    pub(super) fn late_begin(&self) -> Option<String> {
        let cycle = self.about("from_cycle");
        // Those of before say nothing of it.
        (!["", "0"].contains(&cycle))
            .then(|| format!("the recording begins after cycle {cycle} of the run, and not with it"))
    }

    /// Returns the mailboxes of running modules whose senders all run too.
    /// Each has its senders. All messages that they take are sent anew.
    pub(super) fn closed_mailboxes(&self, timeline: &Timeline, modules: &SortedSet<String>) -> Written {
        let mut mailboxes = Written::new();
        for (to, from) in &self.links {
            let path = from.trim_start_matches('/');
            let is_property = timeline.tracks.iter().any(|track| is_within(path, &track.path));
            let runs = self.owner(path).is_some_and(|owner| modules.contains(owner));
            if let Some(sender) = self.owner(to).filter(|_| runs && !is_property) {
                mailboxes.entry(path.to_owned()).or_default().insert(sender.clone());
            }
        }
        mailboxes.retain(|_, senders| self.has_messages() && senders.is_subset(modules));
        mailboxes
    }

    /// Returns the module that owns a path, by the longest name.
    pub(super) fn owner(&self, path: &str) -> Option<&String> {
        let owns =
            |name: &&String| path.strip_prefix(name.as_str()).is_some_and(|rest| rest.starts_with('/'));
        self.modules.keys().filter(owns).max_by_key(|name| name.len())
    }

    /// Returns true for a recording of the last seconds, which were kept in memory.
    pub(super) fn is_flight(&self) -> bool {
        self.is_flight
    }

    /// Returns true if the main loop writes a property, in lockstep.
    /// Its module is then on the loop.
    pub(super) fn is_on_loop(&self, path: &str) -> bool {
        self.is_lockstep() && self.owner(path).is_some_and(|owner| self.is_staged(owner))
    }

    fn is_staged(&self, module: &str) -> bool {
        self.stages.values().any(|stage| stage.split_whitespace().any(|own| own == module))
    }

    /// Returns true if modules had threads of their own.
    /// The values that a tick saw are then unknown.
    pub(super) fn has_threads(&self) -> bool {
        !self.is_lockstep() && self.modules.keys().any(|module| !self.is_staged(module))
    }

    /// Returns the name of the agent.
    pub fn agent(&self) -> &str {
        self.about("agent")
    }

    /// Returns the recorded configuration, overlaid by `sets` of the command line.
    ///
    /// # Errors
    /// When it is invalid, or a setting is.
    pub fn configuration(&self, sets: Vec<String>) -> Result<Database, Report> {
        let name = format!("the recording of {}", self.agent());
        // Files that the run wrote are not written again. Each setting has a line.
        let writes =
            |line: &&str| ["record.", "snapshot.", "log.targets."].iter().any(|own| line.starts_with(own));
        let lines = self.text.as_deref().unwrap_or_default().lines().filter(|line| !writes(line));
        configuration(&name, &lines.collect::<Vec<_>>().join("\n"), sets)
    }

    /// Returns the reason, in one line, why the configuration can't be read, if any.
    /// Another version of Slate has written it.
    pub(super) fn foreign_configuration(&self) -> Option<String> {
        self.text.as_ref()?;
        let report = self.configuration(Vec::new()).err()?.to_string();
        Some(report.lines().next().unwrap_or_default().to_owned())
    }

    /// Returns a configuration with only the agent's name and period.
    /// It replaces a configuration that can't be read.
    pub(super) fn bare_configuration(&self, sets: Vec<String>) -> Result<Database, Report> {
        let mut lines = self.text.as_deref().unwrap_or_default().lines();
        let period = lines.rfind(|line| line.starts_with("loop.period = ")).unwrap_or_default();
        let text = format!("agent.name = {:?}\n{period}\n", self.agent());
        configuration(&format!("the recording of {}", self.agent()), &text, sets)
    }

    /// Returns the files beside the configuration, such as that of the world.
    /// Each has the name by which the configuration calls it, and its content.
    pub fn files(&self) -> &[(String, Vec<u8>)] {
        &self.files
    }

    /// Returns true if the actuators were armed from the start.
    pub fn is_armed(&self) -> bool {
        self.about("armed") == "true"
    }

    /// Returns the reason why a run with that configuration can't be repeated, if any.
    pub fn obstacle_in(&self, configuration: &Configuration) -> Option<String> {
        let own = configuration.agent_name();
        let is_remote = |link: &Link| link.from.value.agent().is_some_and(|agent| agent != own);
        let takes_part = configuration.share().is_some() || configuration.links().iter().any(is_remote);
        takes_part.then(|| "values of other agents may have come into the run".into())
    }

    /// Returns true if messages to modules are recorded.
    pub(super) fn has_messages(&self) -> bool {
        self.about("messages") == "true"
    }

    fn about(&self, key: &str) -> &str {
        self.about.get(key).map_or("", String::as_str)
    }

    /// Returns a value of the final metadata.
    pub(super) fn end(&self, key: &str) -> Option<&str> {
        self.end.as_ref()?.get(key).map(String::as_str)
    }

    /// Returns true if the recording reaches the end of the run.
    /// Otherwise it is truncated.
    pub fn has_ended(&self) -> bool {
        self.cycles().is_some()
    }

    /// Returns the number of cycles, if the recording has an end.
    pub(super) fn cycles(&self) -> Option<u64> {
        self.end("cycles")?.parse().ok()
    }

    /// Returns true if no value could be compared with a second run.
    pub(super) fn is_empty(&self) -> bool {
        self.coverage.repeating == 0 || self.cycles() == Some(0)
    }

    /// Returns true if a property was never written.
    /// `path` may be that of a field of the property.
    pub(super) fn is_unwritten(&self, path: &str) -> bool {
        self.unwritten.keys().any(|own| is_within(path, own.trim_start_matches('/')))
    }

    /// Returns the missing parts of the run in words; empty if none is known.
    fn missing(&self) -> String {
        let read: SortedSet<&str> = self.links.values().map(|from| from.trim_start_matches('/')).collect();
        // Values on the wall clock or of another agent are not repeated.
        let read = read.into_iter().filter(|path| !path.contains("://") && repeats(path));
        let absent = read.filter(|path| self.coverage.of(path).is_none() && !self.is_unwritten(path));
        let absent: Vec<_> = absent.map(|path| format!("/{path}")).collect();
        let incomplete = self.coverage.gaps();
        let incomplete =
            incomplete.map(|(path, own)| format!("/{path} ({} of {} values)", own.count, own.written));
        let incomplete: Vec<_> = incomplete.collect();
        let mut remarks = String::new();
        if !absent.is_empty() {
            remarks += &format!("; inputs not recorded: {}", abbreviated_list(&absent));
        }
        if !incomplete.is_empty() {
            remarks += &format!("; inputs recorded in part: {}", abbreviated_list(&incomplete));
        }
        remarks
    }

    /// Returns the reason why the file lacks a part of the run, if it does.
    fn lack(&self) -> Option<String> {
        let found = self.coverage.values;
        let recorded: Option<u64> = self.end("values").and_then(|values| values.parse().ok());
        let what = match recorded {
            _ if self.has_others => return Some("recordings of several runs are merged in it".into()),
            _ if self.about("whole") != "true" => {
                "only a part of the values is recorded (`record.select`, `record.exclude`, `record.rules`), or the file is a part \
                 of a recording (`slate bag filter`, `slate bag merge`)"
                    .into()
            }
            Some(recorded) if found > recorded => {
                return Some(format!(
                    "it has {found} values, and {recorded} were recorded: the same run is in it more than once"
                ));
            }
            Some(recorded) if found < recorded => {
                format!(
                    "it has {found} of the {recorded} values that were recorded, so it is a part or a repaired copy of that file"
                )
            }
            _ if self.coverage.gaps().next().is_some() => "values are missing between those that it has".into(),
            _ => return None,
        };
        Some(format!("it is not a whole run: {what}{}", self.missing()))
    }

    /// Returns the number of messages without a checksum in a repaired file.
    pub(super) fn unchecked(&self) -> u64 {
        self.unchecked
    }

    /// Returns the reason why the run can't be repeated, if any.
    pub fn obstacle(&self) -> Option<String> {
        if self.about("clock") != "lockstep" {
            return Some("the run was not in lockstep: on the wall clock no two runs are the same".into());
        }
        if let Some(begins) = self.late_begin() {
            return Some(format!(
                "{begins}: what modules remembered then is not in it; `slate try MODULE --bag FILE --partial` lets one run on it"
            ));
        }
        if !self.is_first() || self.about("from_cycle") != "0" {
            return Some(
                "the recording was begun while the agent was there, and may have less than the run wrote: that of the run itself \
                 (`record.enabled`) has all; `slate try MODULE --bag FILE` lets one module run on this one"
                    .into(),
            );
        }
        if self.drops || self.end("dropped").is_some_and(|dropped| dropped != "0") {
            return Some("values were dropped while it was recorded".into());
        }
        if let Some(lack) = self.lack() {
            return Some(lack);
        }
        if self.text.is_none() {
            return Some("the recording has no configuration".into());
        }
        if let Some(reason) = self.foreign_configuration() {
            return Some(format!(
                "another version of Slate has recorded it, whose configuration this one does not read ({reason}): the version \
                 that recorded it can make the run again"
            ));
        }
        let other = self.changes.iter().find_map(|PastChange { after, change, .. }| match change {
            Change::Other { what } => Some(format!("after cycle {after} there was {what}")),
            _ => None,
        });
        other.map(|other| format!("{other}, which can't be made again"))
    }
}
