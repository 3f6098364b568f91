//! All that a recording has, in the order of time.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use slate_blackboard::interface::Descriptor;
use slate_module::Level;
use slate_runtime::recording::Change;

use super::coverage::Coverage;
use super::fate::{Fate, check_writers, fate, log_line};
use super::form::Form;
use crate::bag::{Error, Message, Reader, Selection, Spot};
use crate::recorder::read_change;

/// Which part of a recording is played, and where.
#[derive(Clone, Debug, Default)]
pub struct Choice {
    /// The topics that are played, or patterns such as `/r2/*`; all if there are none.
    pub select: Vec<String>,
    /// The topics among them that are not.
    pub exclude: Vec<String>,
    /// Topics that are played at other paths, such as `/scan` at `/r2/laser/scan`.
    pub map: BTreeMap<String, String>,
}

impl Choice {
    /// Whether everything is played where it was.
    pub(super) fn is_all(&self) -> bool {
        self.select.is_empty() && self.exclude.is_empty() && self.map.is_empty()
    }
}

/// A recorded property.
pub(super) struct Track {
    pub topic: String,
    /// Without a leading slash.
    pub path: String,
    pub form: Form,
    /// Whether a run of the same writes the same values.
    pub is_compared: bool,
    /// The hash of its schema, if an agent recorded it, and the accesses of its channels: an input may be set at times, and filled
    /// by links at others.
    pub origin: Option<String>,
    pub accesses: BTreeSet<String>,
    /// Whether it is written on the loop of a run in lockstep.
    pub is_on_loop: bool,
    /// Whether the numbers of the recording count its values.
    pub is_counted: bool,
    pub last_sequence: u64,
    /// The latest time so far.
    pub latest: u64,
    /// Values with a time before that of one before them.
    pub backwards: u64,
    /// Its values in the order of time, by their places among all.
    pub values: Vec<u32>,
}

/// A mailbox whose messages are recorded.
pub(super) struct Mailbox {
    /// Without a leading slash.
    pub path: String,
    pub form: Form,
    /// How many have sent to it.
    pub senders: u32,
    /// By their numbers, the paths of what they sent by, as far as that is recorded.
    pub from: BTreeMap<u32, String>,
}

/// A message that a module took.
pub(super) struct Letter {
    /// When it was taken, and when it was sent.
    pub time: u64,
    pub sent: u64,
    /// Its place among the mailboxes.
    pub mailbox: usize,
    pub sender: u32,
    sequence: u32,
    spot: Spot,
}

/// A value.
struct Moment {
    /// Its time, but not before that of the one before it.
    time: u64,
    /// When it is played.
    due: u64,
    track: u16,
    /// Whether tools set it, or the configuration.
    is_setting: bool,
    /// Of its record.
    checksum: u32,
    spot: Spot,
}

/// A line of the log.
pub(super) struct LogLine {
    pub time: u64,
    pub level: Level,
    pub module: String,
    pub text: String,
}

/// The values of a recording in the order of time.
pub(super) struct Timeline {
    reader: Reader<BufReader<File>>,
    pub tracks: Vec<Track>,
    entries: Vec<Moment>,
    pub mailboxes: Vec<Mailbox>,
    pub letters: Vec<Letter>,
    pub lines: Vec<LogLine>,
    /// The times at which any property of an agent was written, also of those that are not played.
    pub times: Vec<u64>,
    span: Option<(u64, u64)>,
    /// Which values the file has, also of what is not played.
    pub coverage: Coverage,
    /// What was changed from outside while it was recorded, each with the number of the cycle after which that was, and the time.
    pub changes: Vec<(u64, u64, Change)>,
    /// Topics that are not played, and why.
    pub left_out: Vec<(String, String)>,
}

/// A value that is read.
pub(super) struct Recorded {
    pub bytes: Vec<u8>,
    pub items: usize,
    pub sequence: u64,
    /// The agent's time of the write.
    pub time: u64,
}

/// Times of one recording as those of its agent: nanoseconds after this.
pub(super) type Epoch = u64;

impl Timeline {
    /// When the first value of a file was recorded.
    pub fn first_time(path: &Path) -> Result<u64, Error> {
        let mut reader = Reader::open(path)?;
        let said = reader.start();
        said.map_or_else(|| Ok(reader.next_message()?.map_or(0, |message| message.log_time)), Ok)
    }

    /// Reads all of a recording; it is whole, and each of its values is one of its type. `is_on_loop` says of which properties the
    /// values stand in the order in which they were written, all of them: some have the time of what was before.
    pub fn read(
        path: &Path,
        epoch: Epoch,
        choice: &Choice,
        known: &BTreeMap<u64, &'static Descriptor>,
        is_on_loop: impl Fn(&str) -> bool,
    ) -> Result<Self, Error> {
        let mut on_loop = 0;
        let mut timeline = Self {
            reader: Reader::open(path)?,
            tracks: Vec::new(),
            entries: Vec::new(),
            mailboxes: Vec::new(),
            letters: Vec::new(),
            lines: Vec::new(),
            times: Vec::new(),
            span: None,
            coverage: Coverage::default(),
            changes: Vec::new(),
            left_out: Vec::new(),
        };
        let mut fates: BTreeMap<u16, Fate> = BTreeMap::new();
        let select = Selection::new(&choice.select);
        let exclude = Some(&choice.exclude).filter(|exclude| !exclude.is_empty()).map(Selection::new);
        let is_chosen =
            |topic: &str| select.has(topic) && exclude.as_ref().is_none_or(|exclude| !exclude.has(topic));
        let unfit = |what: String| Error::Unfit { path: path.into(), what };
        while let Some((spot, checksum, message)) = timeline.reader.next_spot()? {
            timeline.coverage.note(&message);
            let id = message.channel.id;
            if let Entry::Vacant(place) = fates.entry(id) {
                let is_chosen = is_chosen(&message.channel.topic);
                let (tracks, mailboxes) = (&mut timeline.tracks, &mut timeline.mailboxes);
                let fate = fate(tracks, mailboxes, &message, is_chosen, choice, known);
                if let Ok(Fate::Played { track, .. }) = &fate {
                    let own = &mut tracks[*track];
                    own.is_on_loop =
                        own.is_compared && is_on_loop(message.channel.topic.trim_start_matches('/'));
                }
                let fate = fate.unwrap_or_else(|why| {
                    timeline.left_out.extend(why.map(|why| (message.channel.topic.clone(), why)));
                    Fate::LeftOut
                });
                place.insert(fate);
            }
            let time = message.log_time.saturating_sub(epoch);
            let (from, to) = timeline.span.unwrap_or((time, time));
            timeline.span = Some((from.min(time), to.max(time)));
            if message.channel.metadata.contains_key("access") && timeline.times.last() != Some(&time) {
                timeline.times.push(time);
            }
            match &fates[&id] {
                Fate::Played { track, is_setting } => {
                    let own = &mut timeline.tracks[*track];
                    let number = own.values.len() as u64 + 1;
                    own.form.note(message.data).map_err(|error| {
                        let name = own.form.descriptor.name;
                        unfit(format!("value {number} of {} is no {name}: {error}", own.topic))
                    })?;
                    let sequence = u64::from(message.sequence);
                    own.is_counted &= sequence > own.last_sequence;
                    own.last_sequence = sequence;
                    own.backwards += u64::from(time < own.latest);
                    own.latest = own.latest.max(time);
                    // Their places are given when they are in order.
                    own.values.push(0);
                    let time = own.latest;
                    let is_on_loop = own.is_on_loop && !is_setting;
                    if is_on_loop {
                        on_loop = on_loop.max(time);
                    }
                    let due = if is_on_loop { on_loop } else { time };
                    let (track, is_setting) = (*track as u16, *is_setting);
                    let entry = Moment { time, due, track, is_setting, checksum, spot };
                    timeline.entries.push(entry);
                }
                Fate::Sent(mailbox, sender) => {
                    let Mailbox { path, form, senders, .. } = &mut timeline.mailboxes[*mailbox];
                    form.note(message.data).map_err(|error| {
                        let name = form.descriptor.name;
                        unfit(format!("a message to /{path} is no {name}: {error}"))
                    })?;
                    *senders = (*senders).max(sender.saturating_add(1));
                    timeline.letters.push(Letter {
                        time,
                        sent: message.publish_time.saturating_sub(epoch),
                        mailbox: *mailbox,
                        sender: *sender,
                        sequence: message.sequence,
                        spot,
                    });
                }
                Fate::Log(schema) => {
                    let line = schema.decode(message.data).ok();
                    timeline.lines.extend(line.and_then(|line| log_line(&line, time)));
                }
                Fate::Changes => {
                    let change = read_change(message.data);
                    timeline.changes.extend(change.map(|(cycle, change)| (cycle, time, change)));
                }
                Fate::LeftOut => {}
            }
        }
        let topics: BTreeSet<_> = timeline.reader.channels().map(|channel| channel.topic.clone()).collect();
        let topics = || topics.iter().map(String::as_str);
        select.check(path, topics())?;
        exclude.map_or(Ok(()), |exclude| exclude.check(path, topics()))?;
        Selection::new(choice.map.keys()).check(path, topics())?;
        if timeline.entries.len() > u32::MAX as usize {
            return Err(unfit(
                "it has more values than can be played: play a part of it with --select".into(),
            ));
        }
        check_writers(&timeline.tracks).map_err(unfit)?;
        for track in &mut timeline.tracks {
            track.form.finish().map_err(|error| {
                let topic = &track.topic;
                Error::Unfit {
                    path: path.into(),
                    what: format!("{topic}: {error}; leave it out with --exclude"),
                }
            })?;
        }
        for mailbox in &mut timeline.mailboxes {
            let path = &mailbox.path;
            mailbox.form.finish().map_err(|error| unfit(format!("/{path}: {error}")))?;
        }
        timeline.sort();
        Ok(timeline)
    }

    fn sort(&mut self) {
        // Values of one time stay in the order of the file.
        self.entries.sort_by_key(|entry| entry.due);
        self.times.sort_unstable();
        self.times.dedup();
        self.letters.sort_by_key(|letter| (letter.time, letter.mailbox, letter.sequence));
        self.lines.sort_by_key(|line| line.time);
        self.changes.sort_by_key(|(cycle, time, _)| (*cycle, *time));
        self.tracks.iter_mut().for_each(|track| track.values.clear());
        for (place, entry) in self.entries.iter().enumerate() {
            self.tracks[usize::from(entry.track)].values.push(place as u32);
        }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        self.reader.path()
    }

    /// When a value is played.
    pub fn due(&self, place: usize) -> Option<u64> {
        self.entries.get(place).map(|entry| entry.due)
    }

    /// The time of a value.
    pub fn time(&self, place: usize) -> Option<u64> {
        self.entries.get(place).map(|entry| entry.time)
    }

    /// Whether a value was set between the cycle of its time and the next, and not before all cycles.
    pub fn is_set_between(&self, place: usize) -> bool {
        self.is_setting(place) && !self.is_set_before(place)
    }

    /// Whether a value was set before all cycles: the first of its property, when they begin.
    pub fn is_set_before(&self, place: usize) -> bool {
        let track = self.tracks.get(self.track(place)).filter(|_| self.is_setting(place));
        track.is_some_and(|track| track.values.first() == Some(&(place as u32)))
            && self.time(place) <= self.times.first().copied()
    }

    /// Whether tools set a value, or the configuration.
    fn is_setting(&self, place: usize) -> bool {
        self.entries.get(place).is_some_and(|entry| entry.is_setting)
    }

    /// The place of a track's first computed value from that number on, and its number.
    pub fn computed(&self, track: usize, from: usize) -> Option<(usize, usize)> {
        let values = self.tracks[track].values.iter().enumerate().skip(from);
        let mut computed = values.map(|(number, place)| (number, *place as usize));
        computed.find(|(_, place)| !self.is_setting(*place)).map(|(number, place)| (place, number))
    }

    /// Whose value it is.
    pub fn track(&self, place: usize) -> usize {
        self.entries.get(place).map_or(usize::MAX, |entry| usize::from(entry.track))
    }

    /// The first and the last time of the file, if there is anything to play.
    pub fn span(&self) -> Option<(u64, u64)> {
        self.span.filter(|_| !self.entries.is_empty())
    }

    /// The place of the first value after a time.
    pub fn after(&self, time: u64) -> usize {
        self.entries.partition_point(|entry| entry.due <= time)
    }

    /// The place of a track's value of that number, from 0.
    pub fn place(&self, track: usize, number: usize) -> Option<usize> {
        self.tracks[track].values.get(number).map(|place| *place as usize)
    }

    /// The number of a track's first value after a time; without a time, of its first one.
    pub fn place_after(&self, track: usize, time: Option<u64>) -> usize {
        let is_before = |place: &u32| time.is_some_and(|time| self.entries[*place as usize].time <= time);
        self.tracks[track].values.partition_point(is_before)
    }

    /// The number of a track's first value from a time on, and of those of that time from a sequence number on.
    pub fn place_from(&mut self, track: usize, time: u64, sequence: u64) -> Result<usize, Error> {
        let mut first = self.place_after(track, time.checked_sub(1));
        let mut end = if sequence > 0 { self.place_after(track, Some(time)) } else { first };
        // Along a track they rise. An entry does not have its own, as hardly anybody asks for it.
        while first < end {
            let middle = first + (end - first) / 2;
            let place = self.tracks[track].values[middle] as usize;
            match self.value_alone(place)?.sequence < sequence {
                true => first = middle + 1,
                false => end = middle,
            }
        }
        Ok(first)
    }

    /// Whether a second run writes the same values of it.
    pub fn is_compared(&self, track: usize) -> bool {
        self.tracks[track].is_compared
    }

    /// The last value of a track until a time.
    pub fn last(&mut self, track: usize, time: u64) -> Result<Option<Recorded>, Error> {
        let values = &self.tracks[track].values;
        let count = values.partition_point(|place| self.entries[*place as usize].time <= time);
        let place = count.checked_sub(1).map(|last| values[last] as usize);
        place.map(|place| self.value(place)).transpose()
    }

    /// The message at a place among all.
    pub fn letter(&mut self, place: usize) -> Result<(Vec<u8>, usize), Error> {
        let letter = &self.letters[place];
        let message = self.reader.message_at(letter.spot)?;
        let Mailbox { path, form, .. } = &self.mailboxes[letter.mailbox];
        let bytes = form.decode(message.data).map_err(|error| Error::Unfit {
            path: self.reader.path().into(),
            what: format!("a message to /{path} can't be read: {error}"),
        })?;
        let items = form.items(&bytes);
        Ok((bytes, items))
    }

    /// The value at a place.
    pub fn value(&mut self, place: usize) -> Result<Recorded, Error> {
        let spot = self.entries[place].spot;
        self.recorded(place, |reader| reader.message_at(spot))
    }

    /// As [`value`](Timeline::value), where those beside it are not wanted too.
    pub fn value_alone(&mut self, place: usize) -> Result<Recorded, Error> {
        let Moment { spot, checksum, .. } = self.entries[place];
        self.recorded(place, |reader| reader.message_alone(spot, checksum))
    }

    fn recorded(
        &mut self,
        place: usize,
        read: impl FnOnce(&mut Reader<BufReader<File>>) -> Result<Message<'_>, Error>,
    ) -> Result<Recorded, Error> {
        let Moment { time, track, .. } = self.entries[place];
        let track = usize::from(track);
        let message = read(&mut self.reader)?;
        let own = &self.tracks[track];
        let bytes = own.form.decode(message.data);
        let sequence = match own.is_counted {
            true => u64::from(message.sequence),
            false => own.values.partition_point(|own| (*own as usize) < place) as u64 + 1,
        };
        let bytes = bytes.map_err(|error| Error::Unfit {
            path: self.reader.path().into(),
            what: format!("a value of {} can't be read: {error}", own.topic),
        })?;
        let items = own.form.items(&bytes);
        Ok(Recorded { items, bytes, sequence, time })
    }
}
