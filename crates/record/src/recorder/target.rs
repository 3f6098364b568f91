//! Active recording: a file and its content.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use slate_blackboard::{Access, Board, Property, Stamp};
use slate_runtime::configuration::RecordSelection;
use slate_runtime::recording::RecordingEntry;
use slate_sorted::SortedMap;

use super::Recorded;
use super::channels::Channel;
use super::file::File;
use super::hub::Sink;
use super::messages::TOPICS;
use super::run::unwritten;
use super::selection::Filter;

/// Progress of a recording, for queries.
#[derive(Debug, Default)]
pub(super) struct Progress {
    /// The number of the recording.
    pub number: u64,
    pub path: PathBuf,
    /// Start time.
    from: u64,
    values: AtomicU64,
    dropped: AtomicU64,
    bytes: AtomicU64,
    failure: Mutex<Option<String>>,
}

impl Progress {
    pub fn new(number: u64, path: &Path, from: u64) -> Arc<Self> {
        Arc::new(Self { number, path: path.to_owned(), from, ..Self::default() })
    }

    /// Returns the reason why nothing is written any more, if there is one.
    pub fn failure(&self) -> Option<String> {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Ends the writing with a reason; the first reason stays.
    pub fn fail(&self, reason: &str) {
        let mut failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        failure.get_or_insert_with(|| reason.to_owned());
    }

    pub fn entry(&self) -> RecordingEntry {
        let load = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        RecordingEntry {
            // Tools have other folders.
            file: std::path::absolute(&self.path).unwrap_or_else(|_| self.path.clone()),
            from: self.from,
            values: load(&self.values),
            dropped: load(&self.dropped),
            bytes: load(&self.bytes),
            failure: self.failure(),
        }
    }

    pub fn recorded(&self) -> Recorded {
        let RecordingEntry { values, dropped, bytes, .. } = self.entry();
        let file = self.path.clone();
        Recorded { file, values, dropped, bytes, earlier: None }
    }
}

/// Duration after which a stalled disk is reported.
const STALL_REPORT_DELAY: Duration = Duration::from_secs(5);

/// A recording that is under way.
pub(super) struct ActiveRecording {
    /// Number of the recording.
    pub number: u64,
    file: File,
    selection: RecordSelection,
    /// Filter by channel: inner `None` if no value goes into the file.
    /// Outer `None` for a channel that has not been looked at yet.
    filters: Vec<Option<Option<Filter>>>,
    /// By channel, numbers of the newest value at the start and of the first later one.
    /// The former is in the file already; the latter is 0 before.
    newest: SortedMap<u32, (u64, u64)>,
    /// Start time, if the recording began while the agent ran.
    /// It has no messages that were taken before.
    begin: u64,
    /// By channel, values dropped before the start, and those found missing later.
    before: Vec<u64>,
    missed: SortedMap<u32, u64>,
    within: Duration,
    /// Set if the target is a file, which could be removed.
    is_file: bool,
    /// Set if nothing may be missing, because the run waits for the disk.
    waits: bool,
    /// Set once the stalled disk has been reported.
    is_stalled: bool,
    /// Number of bytes that a caller waits for; 0 for none.
    settle_bytes: u64,
    /// Time at which the current piece was begun.
    opened: Option<Instant>,
    pub progress: Arc<Progress>,
}

impl ActiveRecording {
    /// Creates a recording; a piece is closed after `within` nanoseconds.
    /// If the run `waits` for the disk, nothing is missing.
    pub fn new(
        file: File,
        selection: RecordSelection,
        within: u64,
        waits: bool,
        progress: Arc<Progress>,
    ) -> Self {
        Self {
            number: progress.number,
            file,
            selection,
            filters: Vec::new(),
            newest: SortedMap::new(),
            begin: 0,
            before: Vec::new(),
            missed: SortedMap::new(),
            within: Duration::from_nanos(within),
            is_file: progress.path.is_file(),
            waits,
            is_stalled: false,
            settle_bytes: 0,
            opened: None,
            progress,
        }
    }

    /// Begins with the newest values of properties, by their channels.
    /// Drops count from now on.
    pub fn begin(&mut self, channels: &[Channel], properties: &[(u32, Arc<Property>)], now: u64) {
        self.begin = now;
        self.before = channels.iter().map(|channel| channel.dropped.load(Ordering::Relaxed)).collect();
        for (id, property) in properties {
            let Some(channel) = channels.get(*id as usize) else { continue };
            // Where no reader can be had, what comes next is the first.
            let Ok(Some((bytes, items, stamp))) = property.newest() else { continue };
            self.newest.insert(*id, (stamp.sequence, 0));
            if self.takes(channel, *id, stamp.time, &bytes) {
                self.file.write_initial(channel, *id, items, (stamp, now), &bytes);
            }
        }
        let closed = self.file.close_piece();
        self.file.note(closed);
    }

    fn takes(&mut self, channel: &Channel, id: u32, time: u64, bytes: &[u8]) -> bool {
        let index = id as usize;
        if index >= self.filters.len() {
            self.filters.resize_with(index + 1, || None);
        }
        let selection = &self.selection;
        let filter = self.filters[index].get_or_insert_with(|| Filter::of(selection, &channel.path));
        let Some(filter) = filter else { return false };
        if !self.waits && !self.file.has_room(bytes.len()) {
            *self.missed.entry(id).or_default() += 1;
            return false;
        }
        filter.takes(time, bytes)
    }

    pub fn value(&mut self, channel: Option<&Channel>, id: u32, items: usize, stamp: Stamp, bytes: &[u8]) {
        let Some(channel) = channel else {
            match self.waits || self.file.has_room(bytes.len()) {
                true => self.file.value(None, id, items, stamp, bytes),
                false => *self.missed.entry(id).or_default() += 1,
            }
            return;
        };
        if stamp.time < self.begin && channel.access == Access::Messages {
            return;
        }
        if let Some((newest, first)) = self.newest.get_mut(&id) {
            if stamp.sequence <= *newest {
                // It, or a newer one, was the first in the file.
                return;
            }
            // Of two threads that write it, the later value may come before the earlier.
            if *first == 0 {
                *first = stamp.sequence;
                *self.missed.entry(id).or_default() += stamp.sequence - *newest - 1;
            } else if stamp.sequence < *first {
                self.missed.entry(id).and_modify(|missed| *missed = missed.saturating_sub(1));
            }
        }
        if self.takes(channel, id, stamp.time, bytes) {
            self.file.value(Some(channel), id, items, stamp, bytes);
        }
    }

    /// Returns true if the run must wait until the disk has taken something.
    pub fn must_wait(&self) -> bool {
        self.waits && self.file.failure().is_none() && !self.file.has_room(0)
    }

    /// Gives up a disk that has accepted no data for `timeout`.
    pub fn fail_after(&mut self, timeout: Duration) {
        let stall = self.file.stall_duration();
        if stall >= timeout {
            self.file.note(Err(format!("the disk has accepted no data for {} s", stall.as_secs())));
        }
    }

    /// Returns the duration of a new stall of the disk, once for each long stall.
    pub fn new_stall(&mut self) -> Option<Duration> {
        let stall = self.file.stall_duration();
        let was_stuck = std::mem::replace(&mut self.is_stalled, stall >= STALL_REPORT_DELAY);
        (self.is_stalled && !was_stuck).then_some(stall)
    }

    /// Closes the current piece when it is time to.
    pub fn close_piece(&mut self, now: Instant, is_urgent: bool) {
        if self.file.is_open() {
            let since = *self.opened.get_or_insert(now);
            if is_urgent || self.file.is_urgent() || now.duration_since(since) >= self.within {
                let closed = self.file.close_piece();
                self.file.note(closed);
            }
        }
        if !self.file.is_open() {
            self.opened = None;
        }
    }

    /// Closes the current piece for a caller that waits until the system has it.
    pub fn request_settle(&mut self) {
        let closed = self.file.close_piece();
        self.file.note(closed);
        self.settle_bytes = self.file.closed();
    }

    /// Returns true if the system has the wanted bytes, or never will.
    pub fn is_settled(&self) -> bool {
        self.file.has(self.settle_bytes) || self.file.failure().is_some()
    }

    /// Returns the reason why nothing can be written any more, if there is one.
    pub fn failure(&self) -> Option<String> {
        self.file.failure()
    }

    /// Writes the number of drops to the file, and publishes the progress.
    pub fn publish(&mut self, channels: &[Channel], time: u64) {
        let mut all = 0;
        for (index, channel) in channels.iter().enumerate() {
            let before = self.before.get(index).copied().unwrap_or(0);
            let missed = self.missed.get(&(index as u32)).copied().unwrap_or(0);
            let count = channel.dropped.load(Ordering::Relaxed) - before + missed;
            if count > 0 && super::selection::selects(&self.selection, &channel.path) {
                all += count;
                self.file.write_drops(&channel.path, count, time);
            }
        }
        for topic in TOPICS {
            let count = self.missed.get(&topic.id).copied().unwrap_or(0);
            all += count;
            self.file.write_drops(topic.name.trim_start_matches('/'), count, time);
        }
        let Progress { values, dropped, bytes, .. } = &*self.progress;
        values.store(self.file.values, Ordering::Relaxed);
        dropped.store(all, Ordering::Relaxed);
        bytes.store(self.file.bytes(), Ordering::Relaxed);
    }

    /// Closes the file, with the final metadata.
    pub fn end(
        &mut self,
        channels: &[Channel],
        board: &Board,
        time: u64,
        end: Vec<(&str, String)>,
    ) -> Result<Recorded, String> {
        // Counts of drops need room.
        self.file.settle();
        if let Some(reason) = self.progress.failure().or_else(|| self.file.failure()) {
            return Err(reason);
        }
        self.publish(channels, time);
        let entry = self.progress.entry();
        let all = [
            ("time_ns", time.to_string()),
            ("values", entry.values.to_string()),
            ("dropped", entry.dropped.to_string()),
        ];
        let end = all.into_iter().chain(end).map(|(key, value)| (key.to_owned(), value)).collect();
        self.file.write_unwritten(unwritten(board))?;
        self.file.end("end", end)?;
        if self.is_file && !self.progress.path.is_file() {
            return Err("its file was removed or moved".into());
        }
        self.publish(&[], time);
        self.progress.dropped.store(entry.dropped, Ordering::Relaxed);
        Ok(self.progress.recorded())
    }
}
