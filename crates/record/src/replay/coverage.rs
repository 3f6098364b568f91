//! How much of what a run wrote is in a file.

use std::collections::BTreeMap;
use std::io::{Read, Seek};

use slate_blackboard::is_within;

use crate::storage::{Message, Reader};

/// The values of a recording, counted.
#[derive(Clone, Debug, Default)]
pub(super) struct Coverage {
    /// All values and messages.
    pub values: u64,
    /// Those of them that a run of the same writes again.
    pub repeating: u64,
    /// By channel of the file, the place of its property and whether it repeats; nothing for what is none of an agent.
    channels: BTreeMap<u16, Option<(usize, bool)>>,
    /// By path, its place.
    places: BTreeMap<String, usize>,
    extents: Vec<PropertyCoverage>,
}

/// Which values there are of a property. Its writer numbers them from 1 on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct PropertyCoverage {
    /// How many there are,
    pub count: u64,
    /// and how many were written until the last one of them.
    pub written: u64,
    /// Since the property was put on the board: the least and the largest number, and how many there are.
    first: u64,
    last: u64,
    present: u64,
    /// Whether they have numbers without gaps.
    is_counted: bool,
}

impl Coverage {
    /// As the summary of a file says, without knowing which values there are; nothing when it does not say it.
    pub fn said<R: Read + Seek>(reader: &Reader<R>) -> Option<Self> {
        let mut coverage = Self::default();
        for (channel, count) in reader.said()? {
            let says = |key: &str| channel.metadata.get(key).map(String::as_str);
            coverage.values += says("access").map_or(0, |_| count);
            coverage.repeating +=
                says("access").filter(|_| says("repeats") == Some("true")).map_or(0, |_| count);
        }
        Some(coverage)
    }

    pub fn note(&mut self, message: &Message<'_>) {
        let channel = message.channel;
        let known = self.channels.entry(channel.id).or_insert_with(|| {
            let access = channel.metadata.get("access")?;
            let path = channel.topic.trim_start_matches('/');
            let place = *self.places.entry(path.to_owned()).or_insert(self.extents.len());
            if place == self.extents.len() {
                // Of messages, those are not there that nobody has taken.
                let is_counted = access != "messages";
                self.extents.push(PropertyCoverage { is_counted, ..PropertyCoverage::default() });
            }
            let repeats = channel.metadata.get("repeats").is_some_and(|repeats| repeats == "true");
            Some((place, repeats))
        });
        let Some((place, repeats)) = *known else { return };
        self.values += 1;
        self.repeating += u64::from(repeats);
        self.extents[place].note(message.sequence.into());
    }

    /// Of a property, or of the one that a path is a field of; nothing when no value of it is there.
    pub fn of(&self, path: &str) -> Option<PropertyCoverage> {
        let own = self.places.iter().find(|(own, _)| is_within(path, own));
        own.map(|(_, place)| self.extents[*place])
    }

    /// The properties of which values are missing before the last one that is there.
    pub fn gaps(&self) -> impl Iterator<Item = (&str, PropertyCoverage)> {
        let extents = self.places.iter().map(|(path, place)| (path.as_str(), self.extents[*place]));
        extents.filter(|(_, extent)| extent.has_gaps())
    }
}

impl PropertyCoverage {
    fn note(&mut self, sequence: u64) {
        if self.present == 0 || sequence == 1 && self.first == 1 {
            // A module that was loaded anew may have put its properties on the board anew.
            (self.first, self.last, self.present) = (sequence, sequence, 0);
            self.written += sequence;
        }
        self.first = if sequence < self.first { sequence } else { self.first };
        if sequence > self.last {
            self.written += sequence - self.last;
            self.last = sequence;
        }
        self.present += 1;
        self.count += 1;
    }

    /// Whether values are missing before the last one that is there.
    pub fn has_gaps(self) -> bool {
        self.is_counted && self.count < self.written
    }
}

/// A few of them, and how many more there are.
pub(super) fn some(names: &[String]) -> String {
    const SHOWN: usize = 4;
    match names.len().checked_sub(SHOWN) {
        None | Some(0) => names.join(", "),
        Some(more) => format!("{} and {more} more", names[..SHOWN].join(", ")),
    }
}
