//! The values that a run has to write when it is made again.

use std::collections::VecDeque;
use std::fs::File;
use std::io::BufReader;

use slate_sorted::SortedMap;

use slate_bag::{Channel, Error, Reader};

/// A value that is recorded.
pub(super) struct ExpectedValue {
    pub sequence: u32,
    pub time: u64,
    pub message: Vec<u8>,
    /// Latest possible time of the write.
    /// The value itself may have the time of something much earlier.
    until: u64,
}

/// A property that a second run writes again.
struct ExpectedTrack {
    path: String,
    /// The schema of its interface.
    hash: Option<u64>,
    /// Values that were read and not compared yet.
    waiting: VecDeque<ExpectedValue>,
}

/// The values of a recording, property by property.
pub(super) struct Expected {
    reader: Reader<BufReader<File>>,
    tracks: ExpectedTracks,
    /// The time of the last value that was read.
    read_to: u64,
    is_over: bool,
}

#[derive(Default)]
struct ExpectedTracks {
    all: Vec<ExpectedTrack>,
    /// Places of the tracks, by path.
    indices: SortedMap<String, usize>,
    /// Places of the tracks, by channel of the file.
    /// `None` for channels that are not compared.
    channels: SortedMap<u16, Option<usize>>,
}

/// Maximum disorder of values of several threads in the file, nanoseconds.
/// A value that was not found until then is missing.
const MAX_DISORDER: u64 = 60_000_000_000;

impl ExpectedTracks {
    /// Returns the track of a channel, if a second run writes its values again.
    fn index(&mut self, channel: &Channel) -> Option<usize> {
        if let Some(known) = self.channels.get(&channel.id) {
            return *known;
        }
        let says = |key: &str| channel.metadata.get(key).map_or("", String::as_str);
        let index = (says("repeats") == "true").then(|| {
            let path = channel.topic.trim_start_matches('/');
            let index = *self.indices.entry(path.to_owned()).or_insert(self.all.len());
            if index == self.all.len() {
                self.all.push(ExpectedTrack { path: path.to_owned(), hash: None, waiting: VecDeque::new() });
            }
            self.all[index].hash = u64::from_str_radix(says("hash"), 16).ok();
            index
        });
        self.channels.insert(channel.id, index);
        index
    }
}

impl Expected {
    /// Creates the values that are still to be read.
    pub fn new(reader: Reader<BufReader<File>>) -> Self {
        Self { reader, tracks: ExpectedTracks::default(), read_to: 0, is_over: false }
    }

    /// Reads one more value; false at the end.
    fn read(&mut self) -> Result<bool, Error> {
        while !self.is_over {
            let Some(message) = self.reader.next_message()? else {
                self.is_over = true;
                break;
            };
            let Some(index) = self.tracks.index(message.channel) else { continue };
            self.read_to = self.read_to.max(message.log_time);
            self.tracks.all[index].waiting.push_back(ExpectedValue {
                sequence: message.sequence,
                time: message.log_time,
                message: message.data.to_vec(),
                until: self.read_to,
            });
            return Ok(true);
        }
        Ok(false)
    }

    /// Returns the value of that number of a property, written at that time.
    /// If it is missing, returns the next one, and `None` if none is recorded. It need not be the next one: two threads
    /// may have written, such as the loop and the one that stops an actuator.
    ///
    /// `index` is for the same property the next time.
    pub fn next(
        &mut self,
        path: &str,
        index: &mut Option<usize>,
        time: u64,
        sequence: u32,
    ) -> Result<Option<ExpectedValue>, Error> {
        let mut skipped = 0;
        loop {
            if index.is_none() {
                *index = self.tracks.indices.get(path).copied();
            }
            if let Some(index) = *index {
                let waiting = &mut self.tracks.all[index].waiting;
                let mut candidates = waiting.iter().skip(skipped);
                if let Some(found) = candidates.position(|own| own.sequence == sequence && own.time == time) {
                    return Ok(waiting.remove(skipped + found));
                }
                skipped = waiting.len();
            }
            if self.read_to > time.saturating_add(MAX_DISORDER) || !self.read()? {
                return Ok(index.and_then(|index| self.tracks.all[index].waiting.pop_front()));
            }
        }
    }

    /// Returns the schema of the property at a place of [`next`](Expected::next).
    pub fn hash(&self, index: Option<usize>) -> Option<u64> {
        self.tracks.all[index?].hash
    }

    /// Reads the values written until a time.
    pub fn read_to(&mut self, time: u64) -> Result<(), Error> {
        while self.read_to <= time && self.read()? {}
        Ok(())
    }

    /// Returns the earliest value written before that time and not compared.
    pub fn missed(&self, before: u64) -> Option<(&str, &ExpectedValue)> {
        let fronts =
            self.tracks.all.iter().filter_map(|track| Some((track.path.as_str(), track.waiting.front()?)));
        fronts.filter(|(_, wanted)| wanted.until < before).min_by_key(|(_, wanted)| wanted.until)
    }

    /// Returns true if every recorded value has been requested.
    pub fn is_done(&self) -> bool {
        self.is_over && self.tracks.all.iter().all(|track| track.waiting.is_empty())
    }
}
