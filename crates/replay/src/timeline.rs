//! Content of a recording, in the order of time.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use slate_blackboard::interface::Descriptor;
use slate_sorted::MapEntry;
use slate_sorted::{SortedMap, SortedSet};

use super::changes::PastChange;
use super::choice::Choice;
use super::coverage::Coverage;
use super::track::{LogLine, Mailbox, PropertyTrack};
use super::treatment::{ChannelTreatment, check_writers, log_line, treatment};
use slate_bag::{Error, Message, MessageLocation, Reader, Selection};
use slate_record::capture::read_change;

/// A message that a module took.
pub(super) struct RecordedMessage {
    /// Times at which it was taken and sent.
    pub time: u64,
    pub sent: u64,
    /// Place among the mailboxes.
    pub mailbox: usize,
    pub sender: u32,
    sequence: u32,
    location: MessageLocation,
}

/// A value.
struct TimelineEntry {
    /// Time of the value, but not before that of the previous one.
    time: u64,
    /// Playback time.
    due: u64,
    track: u16,
    /// Set if tools or the configuration set the value.
    is_setting: bool,
    /// Checksum of the value's record.
    checksum: u32,
    location: MessageLocation,
}

/// The values of a recording in the order of time.
pub(super) struct Timeline {
    reader: Reader<BufReader<File>>,
    pub tracks: Vec<PropertyTrack>,
    entries: Vec<TimelineEntry>,
    pub mailboxes: Vec<Mailbox>,
    pub messages: Vec<RecordedMessage>,
    pub lines: Vec<LogLine>,
    /// Times at which any property of an agent was written, also of those not played.
    pub times: Vec<u64>,
    span: Option<(u64, u64)>,
    /// Coverage of the file's values, also of those not played.
    pub coverage: Coverage,
    /// Changes from outside while it was recorded, each with its time.
    pub changes: Vec<(u64, PastChange)>,
    /// Topics that are not played, and why.
    pub left_out: Vec<(String, String)>,
}

/// A value that is read.
pub(super) struct RecordedValue {
    pub bytes: Vec<u8>,
    pub items: usize,
    pub sequence: u64,
    /// The agent's time of the write.
    pub time: u64,
}

/// The topics of a recording that are played.
struct Chosen {
    select: Selection,
    exclude: Option<Selection>,
}

impl Chosen {
    fn new(choice: &Choice) -> Self {
        let exclude = Some(&choice.exclude).filter(|exclude| !exclude.is_empty());
        Self { select: Selection::new(&choice.select), exclude: exclude.map(Selection::new) }
    }

    fn has(&self, topic: &str) -> bool {
        self.select.has(topic) && self.exclude.as_ref().is_none_or(|exclude| !exclude.has(topic))
    }
}

/// Times of one recording as those of its agent: nanoseconds after this.
pub(super) type Epoch = u64;

impl Timeline {
    /// Returns the time of the first value of a file.
    pub fn first_time(path: &Path) -> Result<u64, Error> {
        let mut reader = Reader::open(path)?;
        let said = reader.start();
        said.map_or_else(|| Ok(reader.next_message()?.map_or(0, |message| message.log_time)), Ok)
    }

    fn empty(reader: Reader<BufReader<File>>) -> Self {
        Self {
            reader,
            tracks: Vec::new(),
            entries: Vec::new(),
            mailboxes: Vec::new(),
            messages: Vec::new(),
            lines: Vec::new(),
            times: Vec::new(),
            span: None,
            coverage: Coverage::default(),
            changes: Vec::new(),
            left_out: Vec::new(),
        }
    }

    /// Reads and checks all of a recording.
    /// It is whole, and each of its values is one of its type. `is_on_loop` tells the properties all of whose values
    /// stand in the order in which they were written: some have the time of an earlier event.
    pub fn read(
        path: &Path,
        epoch: Epoch,
        choice: &Choice,
        known: &SortedMap<u64, &'static Descriptor>,
        is_on_loop: impl Fn(&str) -> bool,
    ) -> Result<Self, Error> {
        let mut on_loop = 0;
        let mut timeline = Self::empty(Reader::open(path)?);
        let mut treatments: SortedMap<u16, ChannelTreatment> = SortedMap::new();
        let chosen = Chosen::new(choice);
        let unfit = |what: String| Error::Unfit { path: path.into(), what };
        while let Some((location, checksum, message)) = timeline.reader.next_located()? {
            timeline.coverage.note(&message);
            let id = message.channel.id;
            if let MapEntry::Vacant(vacant) = treatments.entry(id) {
                let topic = &message.channel.topic;
                let (tracks, mailboxes) = (&mut timeline.tracks, &mut timeline.mailboxes);
                let treatment = treatment(tracks, mailboxes, &message, chosen.has(topic), choice, known);
                if let Ok(ChannelTreatment::Played { track, .. }) = &treatment {
                    let own = &mut tracks[*track];
                    own.is_on_loop = own.is_compared && is_on_loop(topic.trim_start_matches('/'));
                }
                vacant.insert(treatment.unwrap_or_else(|why| {
                    timeline.left_out.extend(why.map(|why| (topic.clone(), why)));
                    ChannelTreatment::LeftOut
                }));
            }
            let time = message.log_time.saturating_sub(epoch);
            let (from, to) = timeline.span.unwrap_or((time, time));
            timeline.span = Some((from.min(time), to.max(time)));
            if message.channel.metadata.contains_key("access") && timeline.times.last() != Some(&time) {
                timeline.times.push(time);
            }
            match &treatments[&id] {
                ChannelTreatment::Played { track, is_setting } => {
                    let own = &mut timeline.tracks[*track];
                    own.note(&message, time).map_err(unfit)?;
                    let (time, track, is_setting) = (own.latest, *track as u16, *is_setting);
                    let due = if own.is_on_loop && !is_setting { on_loop.max(time) } else { time };
                    on_loop = if own.is_on_loop && !is_setting { due } else { on_loop };
                    timeline.entries.push(TimelineEntry { time, due, track, is_setting, checksum, location });
                }
                ChannelTreatment::Sent(mailbox, sender) => {
                    timeline.mailboxes[*mailbox].note(&message, *sender).map_err(unfit)?;
                    timeline.messages.push(RecordedMessage {
                        time,
                        sent: message.publish_time.saturating_sub(epoch),
                        mailbox: *mailbox,
                        sender: *sender,
                        sequence: message.sequence,
                        location,
                    });
                }
                ChannelTreatment::Log(schema) => {
                    let line = schema.decode(message.data).ok();
                    timeline.lines.extend(line.and_then(|line| log_line(&line, time)));
                }
                ChannelTreatment::Changes => {
                    let change = read_change(message.data);
                    let number = message.sequence;
                    timeline
                        .changes
                        .extend(change.map(|(after, change)| (time, PastChange { after, number, change })));
                }
                ChannelTreatment::LeftOut => {}
            }
        }
        timeline.check(&chosen, choice)?;
        timeline.finish_forms()?;
        timeline.sort();
        Ok(timeline)
    }

    /// Checks that everything chosen is there, and that each property has one writer.
    fn check(&self, chosen: &Chosen, choice: &Choice) -> Result<(), Error> {
        let path = self.reader.path();
        let unfit = |what: String| Error::Unfit { path: path.into(), what };
        let topics: SortedSet<_> = self.reader.channels().map(|channel| channel.topic.clone()).collect();
        let topics = || topics.iter().map(String::as_str);
        chosen.select.check(path, topics())?;
        chosen.exclude.as_ref().map_or(Ok(()), |exclude| exclude.check(path, topics()))?;
        Selection::new(choice.map.keys()).check(path, topics())?;
        if self.entries.len() > u32::MAX as usize {
            return Err(unfit(
                "it has more values than can be played: play a part of it with --select".into(),
            ));
        }
        check_writers(&self.tracks).map_err(unfit)
    }

    /// Completes the interfaces of tracks and mailboxes from all their values.
    fn finish_forms(&mut self) -> Result<(), Error> {
        let path = self.reader.path();
        let unfit = |what: String| Error::Unfit { path: path.into(), what };
        for track in &mut self.tracks {
            let topic = &track.topic;
            let finished = track.form.finish();
            finished.map_err(|error| unfit(format!("{topic}: {error}; leave it out with --exclude")))?;
        }
        for mailbox in &mut self.mailboxes {
            let path = &mailbox.path;
            mailbox.form.finish().map_err(|error| unfit(format!("/{path}: {error}")))?;
        }
        Ok(())
    }

    fn sort(&mut self) {
        // Values of one time stay in the order of the file.
        self.entries.sort_by_key(|entry| entry.due);
        self.times.sort_unstable();
        self.times.dedup();
        self.messages.sort_by_key(|entry| (entry.time, entry.mailbox, entry.sequence));
        self.lines.sort_by_key(|line| line.time);
        self.changes.sort_by_key(|(time, own)| (own.after, own.number, *time));
        self.tracks.iter_mut().for_each(|track| track.values.clear());
        for (index, entry) in self.entries.iter().enumerate() {
            self.tracks[usize::from(entry.track)].values.push(index as u32);
        }
    }

    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        self.reader.path()
    }

    /// Returns the playback time of a value.
    pub fn due(&self, index: usize) -> Option<u64> {
        self.entries.get(index).map(|entry| entry.due)
    }

    /// Returns the time of a value.
    pub fn time(&self, index: usize) -> Option<u64> {
        self.entries.get(index).map(|entry| entry.time)
    }

    /// Returns true if a value was set between the cycle of its time and the next.
    /// Values set before all cycles do not count.
    pub fn is_set_between(&self, index: usize) -> bool {
        self.is_setting(index) && !self.is_set_before(index)
    }

    /// Returns true if a value was set before all cycles.
    /// It is the first of its property, when they begin.
    pub fn is_set_before(&self, index: usize) -> bool {
        let track = self.tracks.get(self.track(index)).filter(|_| self.is_setting(index));
        track.is_some_and(|track| track.values.first() == Some(&(index as u32)))
            && self.time(index) <= self.times.first().copied()
    }

    /// Returns true if tools or the configuration set a value.
    fn is_setting(&self, index: usize) -> bool {
        self.entries.get(index).is_some_and(|entry| entry.is_setting)
    }

    /// Returns index and number of a track's first computed value from a number on.
    pub fn computed(&self, track: usize, from: usize) -> Option<(usize, usize)> {
        let values = self.tracks[track].values.iter().enumerate().skip(from);
        let mut computed = values.map(|(number, index)| (number, *index as usize));
        computed.find(|(_, index)| !self.is_setting(*index)).map(|(number, index)| (index, number))
    }

    /// Returns the track of a value.
    pub fn track(&self, index: usize) -> usize {
        self.entries.get(index).map_or(usize::MAX, |entry| usize::from(entry.track))
    }

    /// Returns the first and the last time of the file, if it has anything to play.
    pub fn span(&self) -> Option<(u64, u64)> {
        self.span.filter(|_| !self.entries.is_empty())
    }

    /// Returns the index of the first value after a time.
    pub fn after(&self, time: u64) -> usize {
        self.entries.partition_point(|entry| entry.due <= time)
    }

    /// Returns the index of a track's value of that number, from 0.
    pub fn index(&self, track: usize, number: usize) -> Option<usize> {
        self.tracks[track].values.get(number).map(|index| *index as usize)
    }

    /// Returns the number of a track's first value after a time.
    /// Without a time, it is that of its first value.
    pub fn number_after(&self, track: usize, time: Option<u64>) -> usize {
        let is_before = |index: &u32| time.is_some_and(|time| self.entries[*index as usize].time <= time);
        self.tracks[track].values.partition_point(is_before)
    }

    /// Returns the number of a track's first value from a time and sequence number on.
    /// The sequence number counts among values of that time.
    pub fn number_from(&mut self, track: usize, time: u64, sequence: u64) -> Result<usize, Error> {
        let mut first = self.number_after(track, time.checked_sub(1));
        let mut end = if sequence > 0 { self.number_after(track, Some(time)) } else { first };
        // Along a track they rise. An entry does not have its own, as hardly anybody requests it.
        while first < end {
            let middle = first + (end - first) / 2;
            let index = self.tracks[track].values[middle] as usize;
            match self.value_alone(index)?.sequence < sequence {
                true => first = middle + 1,
                false => end = middle,
            }
        }
        Ok(first)
    }

    /// Returns true if a second run writes the same values of the track.
    pub fn is_compared(&self, track: usize) -> bool {
        self.tracks[track].is_compared
    }

    /// Returns the last value of a track until a time.
    pub fn last(&mut self, track: usize, time: u64) -> Result<Option<RecordedValue>, Error> {
        let values = &self.tracks[track].values;
        let count = values.partition_point(|index| self.entries[*index as usize].time <= time);
        let index = count.checked_sub(1).map(|last| values[last] as usize);
        index.map(|index| self.value(index)).transpose()
    }

    /// Returns the message at an index among all.
    pub fn message(&mut self, index: usize) -> Result<(Vec<u8>, usize), Error> {
        let entry = &self.messages[index];
        let message = self.reader.message_at(entry.location)?;
        let Mailbox { path, form, .. } = &self.mailboxes[entry.mailbox];
        let bytes = form.decode(message.data).map_err(|error| Error::Unfit {
            path: self.reader.path().into(),
            what: format!("a message to /{path} can't be read: {error}"),
        })?;
        let items = form.items(&bytes);
        Ok((bytes, items))
    }

    /// Returns the value at an index.
    pub fn value(&mut self, index: usize) -> Result<RecordedValue, Error> {
        let location = self.entries[index].location;
        self.recorded(index, |reader| reader.message_at(location))
    }

    /// Returns a value as [`value`](Timeline::value), without reading those beside it.
    pub fn value_alone(&mut self, index: usize) -> Result<RecordedValue, Error> {
        let TimelineEntry { location, checksum, .. } = self.entries[index];
        self.recorded(index, |reader| reader.message_alone(location, checksum))
    }

    fn recorded(
        &mut self,
        index: usize,
        read: impl FnOnce(&mut Reader<BufReader<File>>) -> Result<Message<'_>, Error>,
    ) -> Result<RecordedValue, Error> {
        let TimelineEntry { time, track, .. } = self.entries[index];
        let track = usize::from(track);
        let message = read(&mut self.reader)?;
        let own = &self.tracks[track];
        let bytes = own.form.decode(message.data);
        let sequence = match own.is_counted {
            true => u64::from(message.sequence),
            false => own.values.partition_point(|own| (*own as usize) < index) as u64 + 1,
        };
        let bytes = bytes.map_err(|error| Error::Unfit {
            path: self.reader.path().into(),
            what: format!("a value of {} can't be read: {error}", own.topic),
        })?;
        let items = own.form.items(&bytes);
        Ok(RecordedValue { items, bytes, sequence, time })
    }
}
