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

/// A property that a second run writes again.
struct Track {
    path: String,
    /// The schema of its interface.
    hash: Option<u64>,
    /// The values that were read and nobody has asked for.
    waiting: VecDeque<Wanted>,
}

/// The values of a recording, property by property.
pub(super) struct Expected {
    source: Source,
    tracks: Vec<Track>,
    /// The places of properties among the tracks, by their paths.
    places: BTreeMap<String, usize>,
    /// And by the channels of the file.
    channels: Vec<Option<usize>>,
    /// The time of the last value that was read.
    read_to: u64,
    is_over: bool,
}

/// Values of several threads stand in the file somewhat out of order, by less than this, nanoseconds. A value that was not
/// found until then is not there.
const SLACK: u64 = 60_000_000_000;

impl Expected {
    pub fn new(source: Source) -> Self {
        Self {
            source,
            tracks: Vec::new(),
            places: BTreeMap::new(),
            channels: Vec::new(),
            read_to: 0,
            is_over: false,
        }
    }

    /// Reads one more value; false at the end.
    fn read(&mut self) -> Result<bool, ReadError> {
        while !self.is_over {
            let channels = &self.channels;
            let place = |channel: u16| channels.get(usize::from(channel)).copied().flatten();
            match self.source.next(|channel| place(channel).is_some())? {
                None => self.is_over = true,
                Some(Item::Channel(channel)) => {
                    let says = |key: &str| channel.metadata.get(key).map_or("", String::as_str);
                    if says("repeats") == "true" {
                        let hash = u64::from_str_radix(says("hash"), 16).ok();
                        self.add(channel.id, channel.topic.trim_start_matches('/'), hash);
                    }
                }
                Some(Item::Message(header, message)) => {
                    let Some(place) = place(header.channel_id) else { continue };
                    let (sequence, time) = (header.sequence, header.log_time);
                    self.read_to = self.read_to.max(time);
                    let wanted = Wanted { sequence, time, message, until: self.read_to };
                    self.tracks[place].waiting.push_back(wanted);
                    return Ok(true);
                }
                Some(_) => {}
            }
        }
        Ok(false)
    }

    fn add(&mut self, channel: u16, path: &str, hash: Option<u64>) {
        let place = *self.places.entry(path.to_owned()).or_insert(self.tracks.len());
        if place == self.tracks.len() {
            self.tracks.push(Track { path: path.to_owned(), hash, waiting: VecDeque::new() });
        }
        self.tracks[place].hash = hash;
        let channel = usize::from(channel);
        if channel >= self.channels.len() {
            self.channels.resize(channel + 1, None);
        }
        self.channels[channel] = Some(place);
    }

    /// The value of that number of a property, which was written at that time; if there is none, the next one, and
    /// nothing if none is recorded. It need not be the next one: two threads may have written, such as the loop and who
    /// stops an actuator.
    ///
    /// `place` is for the same property the next time.
    pub fn next(
        &mut self,
        path: &str,
        place: &mut Option<usize>,
        time: u64,
        sequence: u32,
    ) -> Result<Option<Wanted>, ReadError> {
        let mut looked = 0;
        loop {
            if place.is_none() {
                *place = self.places.get(path).copied();
            }
            if let Some(place) = *place {
                let waiting = &mut self.tracks[place].waiting;
                let mut news = waiting.iter().skip(looked);
                if let Some(found) = news.position(|own| own.sequence == sequence && own.time == time) {
                    return Ok(waiting.remove(looked + found));
                }
                looked = waiting.len();
            }
            if self.read_to > time.saturating_add(SLACK) || !self.read()? {
                return Ok(place.and_then(|place| self.tracks[place].waiting.pop_front()));
            }
        }
    }

    /// The schema of the property at a place that [`next`](Expected::next) gave.
    pub fn hash(&self, place: Option<usize>) -> Option<u64> {
        self.tracks[place?].hash
    }

    /// Reads all that was written until a time.
    pub fn read_to(&mut self, time: u64) -> Result<(), ReadError> {
        while self.read_to <= time && self.read()? {}
        Ok(())
    }

    /// The earliest value that nobody has asked for, and that was written before that time.
    pub fn missed(&self, before: u64) -> Option<(&str, &Wanted)> {
        let fronts =
            self.tracks.iter().filter_map(|track| Some((track.path.as_str(), track.waiting.front()?)));
        fronts.filter(|(_, wanted)| wanted.until < before).min_by_key(|(_, wanted)| wanted.until)
    }

    /// Whether every recorded value was asked for.
    pub fn is_done(&self) -> bool {
        self.is_over && self.tracks.iter().all(|track| track.waiting.is_empty())
    }
}
