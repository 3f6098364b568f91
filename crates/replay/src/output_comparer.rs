//! Comparison of the outputs of modules on a recording with the recorded values.

use std::collections::VecDeque;
use std::sync::Arc;

use slate_blackboard::channel::Tap;
use slate_blackboard::interface::Descriptor;
use slate_blackboard::message::Message;
use slate_blackboard::{Access, Property, Stamp, Taps, is_within};
use slate_runtime::configuration::Record;
use slate_runtime::playback::Excerpt;
use slate_runtime::recording::{Change, Recording};
use slate_sorted::{SortedMap, SortedSet};

use super::difference::{self, Difference};
use super::playback_reader::{PlaybackReader, SharedPlaybackReader};
use super::recomputed::{Recomputation, Recomputed};
use super::timeline::Timeline;
use slate_bag::Error;
use slate_record::capture::{Channel, Drain, Hub, Sink};

/// Observer of the modules' outputs, which it compares with the recording.
pub(super) struct OutputComparer {
    hub: Arc<Hub>,
    drain: Drain,
    /// The modules that are not looked at.
    service_stubs: SortedSet<String>,
    comparer: ValueComparer,
}

struct ValueComparer {
    playback: SharedPlaybackReader,
    /// Set if values of one time belong together.
    /// On the wall clock only their order assigns them.
    has_times: bool,
    /// Start time of the modules, if it is not the beginning of the recording.
    fresh_from: Option<u64>,
    /// Set if every written value is recorded.
    is_whole: bool,
    /// The properties of which not every value is.
    incomplete: SortedSet<String>,
    /// The properties that are played.
    played: SortedSet<String>,
    /// The track of each property that is compared, and its next value.
    tracks: SortedMap<String, (usize, usize)>,
    /// By mailbox whose senders and receiver run, the places of its pending messages.
    messages: SortedMap<String, VecDeque<usize>>,
    /// By mailbox of which only the senders run, the places of its pending messages.
    /// The recorded receiver may have taken the messages later.
    sent: SortedMap<String, VecDeque<usize>>,
    /// The interfaces of these.
    sender_only: SortedMap<String, &'static Descriptor>,
    /// Messages sent after the last one was taken: path and time.
    unreceived: Vec<(String, u64)>,
    found: SortedMap<String, Recomputed>,
    first: Option<Difference>,
    failure: Option<Error>,
}

impl OutputComparer {
    /// Creates a witness of the agent's outputs.
    /// `incomplete` are properties of which not every value is recorded; on the wall clock it is unknown which ones those
    /// are. `mailboxes` are those whose messages are compared, and `sender_only` those among them of which only the senders
    /// run. Modules of the `excerpt` that the recorded agent did not have are not compared.
    pub fn new(
        playback: &SharedPlaybackReader,
        is_whole: bool,
        incomplete: SortedSet<String>,
        mailboxes: impl Iterator<Item = String>,
        sender_only: SortedMap<String, &'static Descriptor>,
        excerpt: &Excerpt,
    ) -> Self {
        let mut tracks = SortedMap::new();
        let own = playback.get();
        for (track, _) in own.played.iter().enumerate().filter(|(_, played)| played.is_none()) {
            if !own.has_cycles && incomplete.contains(&own.timeline.tracks[track].path) {
                continue;
            }
            let next = own.timeline.number_after(track, own.begin.checked_sub(1));
            tracks.insert(own.timeline.tracks[track].path.clone(), (track, next));
        }
        let mut messages: SortedMap<_, _> = mailboxes.map(|path| (path, VecDeque::new())).collect();
        for (index, entry) in
            own.timeline.messages.iter().enumerate().filter(|(_, entry)| entry.time >= own.begin)
        {
            let mailbox = messages.get_mut(&own.timeline.mailboxes[entry.mailbox].path);
            mailbox.into_iter().for_each(|indices| indices.push_back(index));
        }
        let mut sent: SortedMap<_, _> =
            sender_only.keys().map(|path| (path.clone(), VecDeque::new())).collect();
        for (index, entry) in
            own.timeline.messages.iter().enumerate().filter(|(_, entry)| entry.sent >= own.begin)
        {
            let mailbox = &own.timeline.mailboxes[entry.mailbox];
            let from = mailbox.from.get(&entry.sender);
            if from.is_none_or(|from| excerpt.outboxes.contains_key(from))
                && let Some(indices) = sent.get_mut(&mailbox.path)
            {
                indices.push_back(index);
            }
        }
        let played = own.timeline.tracks.iter().zip(&own.played).filter(|(_, played)| played.is_some());
        let comparer = ValueComparer {
            played: played.map(|(track, _)| track.path.clone()).collect(),
            playback: playback.clone(),
            has_times: own.has_cycles,
            fresh_from: own.timeline.span().filter(|span| span.0 < own.begin).map(|_| own.begin),
            is_whole,
            incomplete,
            tracks,
            messages,
            sent,
            sender_only,
            unreceived: Vec::new(),
            found: SortedMap::new(),
            first: None,
            failure: None,
        };
        drop(own);
        let hub = Hub::new(Record::default().buffer);
        hub.add_recording(0, Box::new(|_| true));
        Self { hub, drain: Drain::default(), service_stubs: excerpt.service_stubs.clone(), comparer }
    }

    /// Returns the recording of the agent whose values are seen.
    pub fn recording(&self) -> Arc<dyn Recording> {
        Arc::new(OutputTaps(Arc::clone(&self.hub), self.service_stubs.clone()))
    }

    /// Compares the values written so far.
    pub fn compare_values(&mut self) -> Result<(), Error> {
        while self.drain.take_values(&self.hub, &mut self.comparer) {}
        self.comparer.failure.take().map_or(Ok(()), Err)
    }

    /// Returns true if all values written until a time have come.
    pub fn has_all_until(&self, time: u64) -> bool {
        let playback = self.comparer.playback.get();
        let timeline = &playback.timeline;
        self.comparer.computed(timeline).all(|(track, next)| {
            let index = timeline.computed(track, next).map(|(index, _)| index);
            index.and_then(|index| timeline.time(index)).is_none_or(|next| next > time)
        })
    }

    /// Returns true if a property was written in nearly each cycle of that period.
    pub fn has_cyclic_property(&self, period: u64) -> bool {
        let playback = self.comparer.playback.get();
        let timeline = &playback.timeline;
        self.comparer.computed(timeline).any(|(track, _)| {
            let count = timeline.tracks[track].values.len();
            let time = |number: usize| timeline.time(timeline.index(track, number)?);
            let span = time(0).zip(time(count.saturating_sub(1))).map_or(0, |(first, last)| last - first);
            count > 1 && span / (count as u64 - 1) < period.saturating_add(period / 2)
        })
    }

    /// Compares messages that were sent to modules that do not run.
    /// Each has its mailbox, its time, and its bytes.
    pub fn compare_sent_messages(&mut self, sent: Vec<(String, u64, Vec<u8>)>) -> Result<(), Error> {
        sent.into_iter().try_for_each(|(path, time, bytes)| self.comparer.compare_sent(&path, time, &bytes))
    }

    /// Returns the result, when all was played until that time.
    pub fn outcome(&mut self, end: u64) -> Result<Recomputation, Error> {
        self.compare_values()?;
        let comparer = &mut self.comparer;
        let playback = comparer.playback.clone();
        let mut playback = playback.get();
        for (path, (track, next)) in comparer.tracks.clone() {
            if playback.timeline.is_compared(track) {
                // A property that nothing was written to is there too.
                comparer.of(&path);
                comparer.skip_missing(&mut playback, &path, track, next, |time| time <= end)?;
            }
        }
        for (path, indices) in comparer.messages.clone() {
            let times = indices.into_iter().map(|index| playback.timeline.messages[index].time);
            for time in times.filter(|time| *time <= end) {
                comparer.note_missing_message(&path, time);
            }
        }
        for (path, indices) in comparer.sent.clone() {
            // There were none is something to know too.
            comparer.of(&path);
            for time in indices.into_iter().map(|index| playback.timeline.messages[index].sent) {
                if time <= end {
                    comparer.note_missing_message(&path, time);
                }
            }
        }
        // Messages sent at the very end may not have been taken.
        for (path, time) in std::mem::take(&mut comparer.unreceived) {
            if time < end {
                comparer.note_extra_message(&path, time);
            }
        }
        // Values written before they began are not theirs.
        let is_meant = |own: &&Recomputed| comparer.fresh_from.is_none() || own.has_values();
        Ok(Recomputation {
            properties: comparer.found.values().filter(is_meant).cloned().collect(),
            first: comparer.first.clone(),
            ..Recomputation::default()
        })
    }
}

/// Observer of the agent's outputs.
struct OutputTaps(Arc<Hub>, SortedSet<String>);

impl Taps for OutputTaps {
    fn tap(&self, property: &Property) -> Option<Arc<dyn Tap>> {
        let Self(hub, service_stubs) = self;
        let is_meant = !service_stubs.iter().any(|module| is_within(property.path(), module));
        is_meant.then(|| hub.tap(property)).flatten()
    }
}

impl Recording for OutputTaps {
    fn changed(&self, _: u64, _: u64, _: &[Change]) {}
}

impl ValueComparer {
    /// Iterates over compared tracks that modules compute, with their next values.
    /// The host writes a module's state, and not in every run at the same place.
    fn computed(&self, timeline: &Timeline) -> impl Iterator<Item = (usize, usize)> {
        let tracks = self
            .tracks
            .iter()
            .filter(|(path, (track, _))| timeline.is_compared(*track) && !path.ends_with("/state"));
        tracks.map(|(_, own)| *own)
    }

    fn of(&mut self, path: &str) -> &mut Recomputed {
        let new = || Recomputed { url: format!("/{path}"), ..Recomputed::default() };
        self.found.entry(path.to_owned()).or_insert_with(new)
    }

    fn note_difference(&mut self, difference: Difference) {
        if self.first.as_ref().is_none_or(|first| difference.time < first.time) {
            self.first = Some(difference);
        }
    }

    /// Skips recorded values of such times, which were not written.
    /// Returns the next one.
    fn skip_missing(
        &mut self,
        playback: &mut PlaybackReader,
        path: &str,
        track: usize,
        mut next: usize,
        is_missed: impl Fn(u64) -> bool,
    ) -> Result<usize, Error> {
        while let Some((index, number)) = playback.timeline.computed(track, next)
            && let Some(time) = playback.timeline.time(index).filter(|time| is_missed(*time))
        {
            let sequence = playback.timeline.value(index)?.sequence;
            self.of(path).only_recorded += 1;
            self.note_difference(Difference {
                time,
                url: format!("/{path}"),
                field: String::new(),
                recorded: format!("value {sequence}"),
                replayed: "no such value".into(),
            });
            next = number + 1;
        }
        Ok(next)
    }

    fn compare(&mut self, channel: &Channel, items: usize, stamp: Stamp, bytes: &[u8]) -> Result<(), Error> {
        let path = channel.path.as_str();
        if channel.access == Access::Messages {
            return self.compare_message(channel, items, stamp, bytes);
        }
        if channel.descriptor.name == "ModuleState"
            && self.fresh_from.is_some_and(|begin| stamp.time <= begin)
        {
            // Its run is reported where it begins.
            return Ok(());
        }
        let Some((track, next)) = self.tracks.get(path).copied() else {
            if self.is_whole && !self.incomplete.contains(path) {
                self.of(path).only_recomputed += 1;
                self.note_difference(extra(path, stamp));
            }
            return Ok(());
        };
        let playback = self.playback.clone();
        let mut playback = playback.get();
        let has_times = self.has_times;
        let mut next =
            self.skip_missing(&mut playback, path, track, next, |time| has_times && time < stamp.time)?;
        let index = playback.timeline.computed(track, next);
        let index =
            index.filter(|(index, _)| !has_times || playback.timeline.time(*index) == Some(stamp.time));
        if let Some((index, number)) = index {
            next = number + 1;
            let recorded = playback.timeline.value(index)?;
            let form = &playback.timeline.tracks[track].form;
            if form.descriptor.hash != channel.descriptor.hash {
                self.of(path).different += 1;
                self.note_difference(Difference {
                    time: stamp.time,
                    url: format!("/{path}"),
                    field: String::new(),
                    recorded: format!("{} of another version", form.descriptor.name),
                    replayed: format!("{} {:016x}", channel.descriptor.name, channel.descriptor.hash),
                });
                self.tracks.insert(path.to_owned(), (track, next));
                return Ok(());
            }
            self.compare_bytes(
                (path, channel.descriptor),
                stamp.time,
                &recorded.bytes,
                channel.value(items, bytes),
            );
        } else if !self.incomplete.contains(path) {
            self.of(path).only_recomputed += 1;
            self.note_difference(extra(path, stamp));
        }
        self.tracks.insert(path.to_owned(), (track, next));
        Ok(())
    }

    /// Compares a value of a property, or a message, with the recorded one.
    fn compare_bytes(
        &mut self,
        (path, descriptor): (&str, &'static Descriptor),
        time: u64,
        recorded: &[u8],
        own: &[u8],
    ) {
        if recorded == own {
            self.of(path).same += 1;
            return;
        }
        self.of(path).different += 1;
        let (mut one, mut other) = (Vec::new(), Vec::new());
        // Both were encoded or decoded before.
        let _ = slate_ros_messages::encode(descriptor, recorded, &mut one);
        let _ = slate_ros_messages::encode(descriptor, own, &mut other);
        let [field, recorded, replayed] = difference::field(descriptor, &one, &other);
        self.note_difference(Difference { time, url: format!("/{path}"), field, recorded, replayed });
    }

    /// Notes a recorded message that did not come.
    fn note_missing_message(&mut self, path: &str, time: u64) {
        self.of(path).only_recorded += 1;
        let (recorded, replayed) = ("a message".into(), "no such message".into());
        self.note_difference(Difference {
            time,
            url: format!("/{path}"),
            field: String::new(),
            recorded,
            replayed,
        });
    }

    /// Compares a message that was taken with the one that was taken in its place.
    fn compare_message(
        &mut self,
        channel: &Channel,
        items: usize,
        stamp: Stamp,
        bytes: &[u8],
    ) -> Result<(), Error> {
        let path = channel.path.as_str();
        let Some(mut indices) = self.messages.remove(path) else { return Ok(()) };
        let playback = self.playback.clone();
        let mut playback = playback.get();
        let has_times = self.has_times;
        let time = |index: &usize| playback.timeline.messages[*index].time;
        while let Some(missed) = indices.pop_front_if(|index| has_times && time(index) < stamp.time) {
            self.note_missing_message(path, time(&missed));
        }
        let index = indices.pop_front_if(|index| !has_times || time(index) == stamp.time);
        self.messages.insert(path.to_owned(), indices);
        let Some(index) = index else {
            self.note_extra_message(path, stamp.time);
            return Ok(());
        };
        let (recorded, _) = playback.timeline.message(index)?;
        self.compare_bytes((path, channel.descriptor), stamp.time, &recorded, channel.value(items, bytes));
        Ok(())
    }

    /// Notes a message that is not recorded.
    fn note_extra_message(&mut self, path: &str, time: u64) {
        self.of(path).only_recomputed += 1;
        let (recorded, replayed) = ("no such message".into(), "a message".into());
        self.note_difference(Difference {
            time,
            url: format!("/{path}"),
            field: String::new(),
            recorded,
            replayed,
        });
    }

    /// Compares a message to a module that does not run with the recorded one.
    fn compare_sent(&mut self, path: &str, time: u64, bytes: &[u8]) -> Result<(), Error> {
        let Some(descriptor) = self.sender_only.get(path).copied() else { return Ok(()) };
        let mut indices = self.sent.remove(path).unwrap_or_default();
        let playback = self.playback.clone();
        let mut playback = playback.get();
        let has_times = self.has_times;
        let sent = |index: &usize| playback.timeline.messages[*index].sent;
        while let Some(missed) = indices.pop_front_if(|index| has_times && sent(index) < time) {
            self.note_missing_message(path, sent(&missed));
        }
        let index = indices.pop_front_if(|index| !has_times || sent(index) == time);
        let was_last = indices.is_empty();
        self.sent.insert(path.to_owned(), indices);
        match index {
            Some(index) => {
                let (recorded, _) = playback.timeline.message(index)?;
                self.compare_bytes((path, descriptor), time, &recorded, bytes);
            }
            None if was_last => self.unreceived.push((path.to_owned(), time)),
            None => self.note_extra_message(path, time),
        }
        Ok(())
    }
}

fn extra(path: &str, stamp: Stamp) -> Difference {
    Difference {
        time: stamp.time,
        url: format!("/{path}"),
        field: String::new(),
        recorded: "no such value".into(),
        replayed: format!("value {} at {:.3} s", stamp.sequence, stamp.time as f64 * 1e-9),
    }
}

impl Sink for ValueComparer {
    fn value(&mut self, channel: Option<&Channel>, _: u32, items: usize, stamp: Stamp, bytes: &[u8]) {
        let Some(channel) = channel else { return };
        // Set values are not computed.
        if !channel.repeats() || channel.access == Access::Setting || self.failure.is_some() {
            return;
        }
        if !self.played.contains(&channel.path) {
            self.failure = self.compare(channel, items, stamp, bytes).err();
        }
    }
}

/// Two that see the same agent.
pub(super) struct BothRecordings(pub Arc<dyn Recording>, pub Arc<dyn Recording>);

/// Two that see the same values.
struct BothTaps(Arc<dyn Tap>, Arc<dyn Tap>);

impl Tap for BothTaps {
    fn wrote(&self, bytes: &[u8], items: usize, stamp: Stamp) {
        self.0.wrote(bytes, items, stamp);
        self.1.wrote(bytes, items, stamp);
    }

    fn took(&self, message: &Message<'_>, now: u64) {
        self.0.took(message, now);
        self.1.took(message, now);
    }
}

impl Taps for BothRecordings {
    fn tap(&self, property: &Property) -> Option<Arc<dyn Tap>> {
        match (self.0.tap(property), self.1.tap(property)) {
            (Some(one), Some(other)) => Some(Arc::new(BothTaps(one, other))),
            (one, other) => one.or(other),
        }
    }
}

impl Recording for BothRecordings {
    fn changed(&self, cycle: u64, time: u64, changes: &[Change]) {
        self.0.changed(cycle, time, changes);
        self.1.changed(cycle, time, changes);
    }

    fn settle(&self) {
        self.0.settle();
        self.1.settle();
    }
}
