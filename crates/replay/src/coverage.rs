//! Coverage of a run's values by a file.

use std::io::{Read, Seek};

use slate_blackboard::is_within;
use slate_sorted::SortedMap;

use slate_bag::{Message, Reader};

/// The values of a recording, counted.
#[derive(Clone, Debug, Default)]
pub(super) struct Coverage {
    /// Number of values and messages.
    pub values: u64,
    /// Number of those that a run of the same configuration writes again.
    pub repeating: u64,
    /// By channel of the file, the place of its property, and whether it repeats.
    /// `None` for a channel that is not an agent's.
    channels: SortedMap<u16, Option<(usize, bool)>>,
    /// Place of each property, by path.
    indices: SortedMap<String, usize>,
    extents: Vec<PropertyCoverage>,
}

/// Recorded values of a property, which its writer numbers from 1 on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct PropertyCoverage {
    /// Number of recorded values.
    pub count: u64,
    /// Number of values written until the last recorded one.
    pub written: u64,
    /// Smallest and largest number, and count, since the property was created.
    first: u64,
    last: u64,
    present: u64,
    /// Set if the values have numbers without gaps.
    is_counted: bool,
}

impl Coverage {
    /// Returns the counts in the summary of a file; `None` if it has none.
    /// The summary does not tell the values of single properties.
    pub fn from_summary<R: Read + Seek>(reader: &Reader<R>) -> Option<Self> {
        let mut coverage = Self::default();
        for (channel, count) in reader.channel_counts()? {
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
            let index = *self.indices.entry(path.to_owned()).or_insert(self.extents.len());
            if index == self.extents.len() {
                // Messages that were not taken are missing.
                let is_counted = access != "messages";
                self.extents.push(PropertyCoverage { is_counted, ..PropertyCoverage::default() });
            }
            let repeats = channel.metadata.get("repeats").is_some_and(|repeats| repeats == "true");
            Some((index, repeats))
        });
        let Some((index, repeats)) = *known else { return };
        self.values += 1;
        self.repeating += u64::from(repeats);
        self.extents[index].note(message.sequence.into());
    }

    /// Returns the coverage of a property, or of the one that contains a path.
    /// `None` if it has no value.
    pub fn of(&self, path: &str) -> Option<PropertyCoverage> {
        let own = self.indices.iter().find(|(own, _)| is_within(path, own));
        own.map(|(_, index)| self.extents[*index])
    }

    /// Returns the properties with values missing before the last present one.
    pub fn gaps(&self) -> impl Iterator<Item = (&str, PropertyCoverage)> {
        let extents = self.indices.iter().map(|(path, index)| (path.as_str(), self.extents[*index]));
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

    /// Returns true if values are missing before the last present one.
    pub fn has_gaps(self) -> bool {
        self.is_counted && self.count < self.written
    }
}

/// Lists a few names, and the number of further ones.
pub(super) fn abbreviated_list(names: &[String]) -> String {
    const MAX_NAMES: usize = 4;
    match names.len().checked_sub(MAX_NAMES) {
        None | Some(0) => names.join(", "),
        Some(more) => format!("{} and {more} more", names[..MAX_NAMES].join(", ")),
    }
}
