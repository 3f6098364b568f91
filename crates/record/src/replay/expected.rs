//! The values that a run has to write when it is made again.

use std::collections::{BTreeMap, VecDeque};

use super::file::{Item, ReadError, Source};

/// A value that is recorded.
pub(super) struct Wanted {
    pub sequence: u32,
    pub time: u64,
    pub message: Vec<u8>,
    /// When it was written, at the latest: a value may have the time of something that was long before.
    until: u64,
}

/// The values of a recording, property by property.
pub(super) struct Expected {
    source: Source,
    /// Paths and hashes of the properties that a second run writes again, by channel.
    channels: BTreeMap<u16, String>,
    hashes: BTreeMap<String, Option<u64>>,
    waiting: BTreeMap<String, VecDeque<Wanted>>,
    /// The time of the last value that was read.
    read_to: u64,
    is_over: bool,
}

/// Values of several threads stand in the file somewhat out of order, by less than this, nanoseconds. So no more than that
/// is held in memory.
const SLACK: u64 = 60_000_000_000;

impl Expected {
    pub fn new(source: Source) -> Self {
        Self {
            source,
            channels: BTreeMap::new(),
            hashes: BTreeMap::new(),
            waiting: BTreeMap::new(),
            read_to: 0,
            is_over: false,
        }
    }

    /// Reads one more value; false at the end.
    fn read(&mut self) -> Result<bool, ReadError> {
        while !self.is_over {
            match self.source.next()? {
                None => self.is_over = true,
                Some(Item::Channel(channel)) => {
                    let says = |key: &str| channel.metadata.get(key).cloned().unwrap_or_default();
                    if says("repeats") == "true" {
                        let path = channel.topic.trim_start_matches('/').to_owned();
                        self.hashes.insert(path.clone(), u64::from_str_radix(&says("hash"), 16).ok());
                        self.channels.insert(channel.id, path);
                    }
                }
                Some(Item::Message(header, message)) => {
                    let Some(path) = self.channels.get(&header.channel_id) else { continue };
                    let (sequence, time) = (header.sequence, header.log_time);
                    self.read_to = self.read_to.max(time);
                    let wanted = Wanted { sequence, time, message, until: self.read_to };
                    match self.waiting.get_mut(path) {
                        Some(waiting) => waiting.push_back(wanted),
                        None => drop(self.waiting.insert(path.clone(), VecDeque::from([wanted]))),
                    }
                    return Ok(true);
                }
                Some(_) => {}
            }
        }
        Ok(false)
    }

    /// The value of that number of a property, which was written at that time; if there is none, the next one, and
    /// nothing if none is recorded. It need not be the next one: two threads may have written, such as the loop and who
    /// stops an actuator.
    pub fn next(&mut self, path: &str, time: u64, sequence: u32) -> Result<Option<Wanted>, ReadError> {
        let mut looked = 0;
        loop {
            if let Some(waiting) = self.waiting.get_mut(path) {
                let mut news = waiting.iter().skip(looked);
                if let Some(place) = news.position(|own| own.sequence == sequence && own.time == time) {
                    return Ok(waiting.remove(looked + place));
                }
                looked = waiting.len();
            }
            if self.read_to > time.saturating_add(SLACK) || !self.read()? {
                return Ok(self.waiting.get_mut(path).and_then(VecDeque::pop_front));
            }
        }
    }

    /// The schema of a property, once a value of it was asked for.
    pub fn hash(&self, path: &str) -> Option<u64> {
        *self.hashes.get(path)?
    }

    /// Reads all that was written until a time.
    pub fn read_to(&mut self, time: u64) -> Result<(), ReadError> {
        while self.read_to <= time.saturating_add(SLACK) && self.read()? {}
        Ok(())
    }

    /// The earliest value that nobody has asked for, and that was written before that time.
    pub fn missed(&self, before: u64) -> Option<(&str, &Wanted)> {
        let fronts = self.waiting.iter().filter_map(|(path, all)| Some((path.as_str(), all.front()?)));
        fronts.filter(|(_, wanted)| wanted.until < before).min_by_key(|(_, wanted)| wanted.until)
    }

    /// Whether every recorded value was asked for.
    pub fn is_done(&self) -> bool {
        self.is_over && self.waiting.values().all(VecDeque::is_empty)
    }
}
