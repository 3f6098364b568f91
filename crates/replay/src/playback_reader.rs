//! Writes recorded values into an agent, and is its clock.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use slate_blackboard::channel::{ChannelSnapshot, StampedValue, Writer};
use slate_blackboard::interface::Descriptor;
use slate_blackboard::message::{Receiver, Sender};
use slate_blackboard::{Board, Carrier, Property, Stamp, is_within};
use slate_runtime::configuration::Configuration;
use slate_runtime::playback::{Playback, Played};
use slate_sorted::{SortedMap, SortedSet};

use super::requests::Requests;
use super::run::{Run, Written};
use super::timeline::{RecordedValue, Timeline};
use super::track::Mailbox;
use slate_bag::Error;

/// Position of a track's writes in the cycle.
#[derive(Clone, Debug, Default)]
pub(super) struct TrackPosition {
    /// Writers of the track.
    pub writers: SortedSet<String>,
    /// Module whose output it is, if it is an output.
    pub module: Option<String>,
    /// Modules that run before it is written.
    late_for: SortedSet<String>,
    /// Modules whose stages come after its stage.
    early_for: SortedSet<String>,
}

/// A recording on its way into an agent.
pub(super) struct PlaybackReader {
    pub timeline: Timeline,
    /// Place of each played track among the modules that run.
    /// `None` for a track that is not played.
    pub played: Vec<Option<TrackPosition>>,
    /// Linked properties that are never written.
    pub silent: Vec<(String, &'static Descriptor, usize)>,
    /// Mailboxes to which the recorded messages are sent again.
    pub inboxes: SortedSet<String>,
    /// The mailboxes of modules that do not run, to which others send that do.
    pub sender_only: SortedMap<String, &'static Descriptor>,
    /// Receivers of these mailboxes.
    receivers: Vec<(String, Receiver)>,
    /// By mailbox, its senders by their numbers.
    senders: Vec<Vec<Sender>>,
    /// The next message.
    next_message: usize,
    /// Writers by track.
    writers: Vec<Option<(Arc<Property>, Writer)>>,
    /// The next value.
    pub next: usize,
    /// Values of this cycle that their writers had not written yet.
    waiting: Vec<usize>,
    /// Requests of the modules that run to their agent.
    pub requests: Requests,
    /// The time of the cycle.
    now: u64,
    /// Set if the cycles are those of the recorded run.
    /// Otherwise they are on the grid of the period.
    pub has_cycles: bool,
    /// Set if a value was written in each cycle.
    /// Otherwise there are further cycles on that grid between.
    pub is_each_known: bool,
    /// The time of the first cycle.
    pub begin: u64,
    /// Values that were written.
    pub values: u64,
    /// Reason why no more can be written.
    failure: Option<Error>,
}

impl PlaybackReader {
    /// Creates a reader; `cycles` is the number of cycles of a run in lockstep.
    /// The inner `None` is an unknown number, the outer one a run that was not in lockstep.
    pub fn new(timeline: Timeline, cycles: Option<Option<u64>>, begin: u64) -> Self {
        let played = timeline.tracks.iter().map(|_| Some(TrackPosition::default())).collect();
        Self {
            played,
            next_message: timeline.messages.partition_point(|entry| entry.time < begin),
            inboxes: SortedSet::new(),
            sender_only: SortedMap::new(),
            receivers: Vec::new(),
            senders: Vec::new(),
            silent: Vec::new(),
            writers: Vec::new(),
            next: 0,
            waiting: Vec::new(),
            requests: Requests::new(cycles.is_some()),
            now: begin,
            has_cycles: cycles.is_some(),
            is_each_known: cycles.flatten() == Some(timeline.times.len() as u64),
            begin,
            values: 0,
            failure: None,
            timeline,
        }
    }

    /// Replaces recorded outputs by modules of the run.
    /// Returns the paths that they write, each with its writers. The modules see the same values of the others as they
    /// saw then.
    pub fn replace(
        &mut self,
        run: &Run,
        configuration: &Configuration,
        modules: &SortedSet<String>,
    ) -> Written {
        let mut written = Written::new();
        for (track, played) in self.timeline.tracks.iter().zip(&mut self.played) {
            let gate = configuration.actuators().iter().find(|own| is_within(&track.path, &own.name.value));
            // A gate follows its commanders.
            let mut writers: SortedSet<&str> =
                run.owner(&track.path).map(String::as_str).into_iter().collect();
            let commands = gate.into_iter().flat_map(|gate| &gate.commands).map(|url| url.value.path_in(""));
            let commands: Vec<String> = commands.collect();
            if writers.is_empty() {
                writers.extend(commands.iter().filter_map(|path| run.owner(path)).map(String::as_str));
                writers
                    .extend(gate.into_iter().flat_map(|gate| &gate.modules).map(|name| name.value.as_str()));
            }
            let runs = writers.iter().any(|writer| modules.contains(*writer));
            let writers: SortedSet<String> = writers.into_iter().map(str::to_owned).collect();
            if runs {
                *played = None;
                written.insert(track.path.clone(), writers);
            } else if let Some(played) = played {
                (played.writers, played.module) = (writers, run.owner(&track.path).cloned());
            }
        }
        let stages = run.stages.values().map(|stage| stage.split_whitespace().map(str::to_owned).collect());
        self.assign_positions(&stages.collect::<Vec<_>>(), modules);
        written
    }

    /// Assigns the played tracks their places among those modules.
    /// The order is that in which all of them ran, stage by stage.
    pub fn assign_positions(&mut self, stages: &[Vec<String>], modules: &SortedSet<String>) {
        let mut positions: SortedMap<&str, (usize, usize)> = SortedMap::new();
        for (stage, names) in stages.iter().enumerate() {
            for name in names {
                let count = positions.len();
                positions.entry(name).or_insert((stage, count));
            }
        }
        let index = |module: &str| positions.get(module).copied();
        for TrackPosition { writers, late_for, early_for, .. } in self.played.iter_mut().flatten() {
            let Some(last) = writers.iter().filter_map(|writer| index(writer)).max() else { continue };
            let those = |is_one: &dyn Fn((usize, usize)) -> bool| {
                let those = modules.iter().filter(|module| index(module).is_some_and(is_one));
                those.cloned().collect()
            };
            *late_for = those(&|own| own < last);
            *early_for = those(&|own| own.0 > last.0);
        }
    }

    /// Returns the reason why the reader stopped, if it did.
    pub fn check(&mut self) -> Result<(), Error> {
        self.failure.take().map_or(Ok(()), Err)
    }

    /// Continues at a time: each property has its last value of that time.
    pub fn jump(&mut self, time: u64) -> Result<(), Error> {
        self.next = self.timeline.after(time);
        self.waiting.clear();
        self.next_message = self.timeline.messages.partition_point(|entry| entry.time < time);
        for track in 0..self.writers.len() {
            let Some((property, writer)) = &mut self.writers[track] else { continue };
            let generation = writer.generation();
            let value = self.timeline.last(track, time)?.map(|value| StampedValue {
                bytes: value.bytes,
                items: value.items,
                stamp: Stamp { sequence: value.sequence, time: value.time, generation },
            });
            self.values += u64::from(value.is_some());
            let saved = ChannelSnapshot { generation, values: value.into_iter().collect() };
            property.restore(&saved, Some(writer)).map_err(|error| Error::Unfit {
                path: self.timeline.path().into(),
                what: format!("{}: {error}", self.timeline.tracks[track].topic),
            })?;
        }
        Ok(())
    }

    /// Returns the time of the next value that is played.
    fn next_time(&self) -> Option<u64> {
        self.timeline.due(self.next)
    }

    /// Returns the next known cycle after a time, or the next value.
    pub fn following(&self, time: u64) -> Option<u64> {
        let times = &self.timeline.times;
        match self.has_cycles {
            true => times.get(times.partition_point(|own| *own <= time)).copied(),
            false => self.next_time(),
        }
    }

    fn write_to(&mut self, now: u64, before: Option<&str>) -> Result<(), Error> {
        self.now = now;
        while self.next_time().is_some_and(|time| time <= now) {
            self.waiting.push(self.next);
            self.next += 1;
        }
        for index in std::mem::take(&mut self.waiting) {
            let track = self.timeline.track(index);
            let is_between = self.has_cycles && self.timeline.is_set_between(index);
            // Values of the configuration were there before any module ran.
            let is_there = self.has_cycles && self.timeline.is_set_before(index);
            let is_late = |own: &TrackPosition| {
                before.is_some_and(|module| is_between || !is_there && own.late_for.contains(module))
            };
            if self.played.get(track).and_then(Option::as_ref).is_some_and(is_late) {
                self.waiting.push(index);
            } else {
                self.write_value(index, track)?;
            }
        }
        while let Some(entry) = self.timeline.messages.get(self.next_message).filter(|own| own.time <= now) {
            let (sent, mailbox, sender) = (entry.sent, entry.mailbox, entry.sender as usize);
            let index = self.next_message;
            self.next_message += 1;
            let senders = self.senders.get_mut(mailbox);
            let Some(sender) = senders.and_then(|senders| senders.get_mut(sender)) else { continue };
            let (bytes, items) = self.timeline.message(index)?;
            // A module that is switched off takes no more messages.
            let _ = sender.send(&bytes, items, sent);
        }
        Ok(())
    }

    fn write_value(&mut self, index: usize, track: usize) -> Result<(), Error> {
        let Some((_, writer)) = self.writers.get_mut(track).and_then(Option::as_mut) else { return Ok(()) };
        let RecordedValue { bytes, items, sequence, time } = self.timeline.value(index)?;
        let missed = sequence.saturating_sub(writer.last().sequence + 1);
        if missed > 0 {
            writer.skip(missed);
        }
        // No reader blocks a playback: in lockstep, readers see every value.
        let _ = writer.write(&bytes, items, time);
        self.values += 1;
        Ok(())
    }

    /// Takes messages that modules sent to modules that do not run.
    /// Each has its mailbox, its time, and its bytes.
    pub fn take_sent(&mut self, now: u64) -> Vec<(String, u64, Vec<u8>)> {
        let mut taken = Vec::new();
        for (path, receiver) in &mut self.receivers {
            if receiver.collect() == 0 {
                continue;
            }
            receiver.show(now);
            let size = self.sender_only.get(path).map_or(0, |descriptor| descriptor.size);
            for message in receiver.messages() {
                let bytes = message.bytes().get(..size).unwrap_or_default().to_vec();
                taken.push((path.clone(), message.time(), bytes));
            }
            receiver.release();
        }
        taken
    }

    /// Opens the mailboxes that messages are sent to.
    fn address(&mut self, board: &Board) -> Result<(), String> {
        for path in self.sender_only.keys() {
            // Without a link it has no messages.
            let Ok((found, _)) = board.find(path) else { continue };
            let Carrier::Mailbox(own) = found.carrier() else { continue };
            let receiver = own.receiver().map_err(|error| format!("/{path}: {error}"))?;
            self.receivers.push((path.clone(), receiver));
        }
        let address = |mailbox: &Mailbox| {
            if !self.inboxes.contains(&mailbox.path) {
                return Ok(Vec::new());
            }
            let path = &mailbox.path;
            let found = board.find(path).map_err(|error| error.to_string())?.0;
            let Carrier::Mailbox(own) = found.carrier() else {
                return Err(format!("/{path} takes no messages any more"));
            };
            if found.descriptor().hash != mailbox.form.descriptor.hash {
                return Err(format!(
                    "/{path} takes messages of another version than those that are recorded"
                ));
            }
            let senders = (0..mailbox.senders).map(|_| own.sender());
            senders.collect::<Result<_, _>>().map_err(|error| format!("/{path}: {error}"))
        };
        self.senders = self.timeline.mailboxes.iter().map(address).collect::<Result<_, String>>()?;
        Ok(())
    }
}

/// Playback reader, shared by the agent and its driver.
#[derive(Clone)]
pub(super) struct SharedPlaybackReader(Arc<Mutex<PlaybackReader>>);

impl SharedPlaybackReader {
    pub fn new(playback: PlaybackReader) -> Self {
        Self(Arc::new(Mutex::new(playback)))
    }

    pub fn get(&self) -> MutexGuard<'_, PlaybackReader> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Playback for SharedPlaybackReader {
    fn properties(&self) -> Vec<Played> {
        let playback = self.get();
        let tracks = playback.timeline.tracks.iter().zip(&playback.played).filter_map(|(track, index)| {
            Some(Played {
                path: track.path.clone(),
                doc: format!("Played from {} of a recording.", track.topic),
                descriptor: track.form.descriptor,
                capacity: track.form.capacity,
                module: index.as_ref()?.module.clone(),
                later_modules: index.as_ref()?.early_for.clone(),
                is_mailbox: false,
            })
        });
        let silent = playback.silent.iter().map(|(path, descriptor, capacity)| Played {
            path: path.clone(),
            doc: "Never written in the recorded run.".into(),
            descriptor,
            capacity: *capacity,
            module: None,
            later_modules: SortedSet::new(),
            is_mailbox: false,
        });
        let sender_only = playback.sender_only.iter().map(|(path, descriptor)| Played {
            path: path.clone(),
            doc: "Takes messages in the place of a module.".into(),
            descriptor,
            capacity: 0,
            module: None,
            later_modules: SortedSet::new(),
            is_mailbox: true,
        });
        tracks.chain(silent).chain(sender_only).collect()
    }

    fn begin(&mut self, properties: &[Arc<Property>], board: &Board) -> Result<(), String> {
        let mut playback = self.get();
        let mut properties = properties.iter();
        let is_played: Vec<bool> = playback.played.iter().map(Option::is_some).collect();
        let writer =
            |property: &Arc<Property>| Some((Arc::clone(property), property.channel()?.writer().ok()?));
        // Each was just put on the board for this, so it has a writer.
        playback.writers = is_played
            .into_iter()
            .map(|is| if is { properties.next().and_then(writer) } else { None })
            .collect();
        playback.address(board)
    }

    fn next(&mut self, last: Option<u64>, planned: u64) -> u64 {
        let playback = self.get();
        let Some(last) = last else { return playback.begin };
        match playback.following(last) {
            Some(next) if playback.is_each_known => next,
            Some(next) if playback.has_cycles => next.min(planned),
            _ => planned,
        }
    }

    fn write(&mut self, now: u64, before: Option<&str>) {
        let mut playback = self.get();
        if playback.failure.is_none() {
            playback.failure = playback.write_to(now, before).err();
        }
    }

    fn answer(&mut self, module: &str, lines: &str) -> Option<Result<String, String>> {
        let mut playback = self.get();
        let now = playback.now;
        playback.requests.answer(module, lines, now)
    }
}
