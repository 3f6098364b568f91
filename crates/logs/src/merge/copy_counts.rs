//! Counts in the metadata of an agent's recording.
//! They are renewed where only a part of its messages is copied.

use slate_sorted::SortedMap;

use super::merge_check::prefixed_topic;
use slate_bag::{Decoder, Message, Metadata, Selection};
use slate_record::{DROPPED_TOPIC, TOPICS};

/// The records of metadata that count messages, or say when they are.
const COUNTED_METADATA: [&str; 3] = ["dropped", "end", "flight"];

/// Counts of one file.
#[derive(Default)]
pub(super) struct CopyCounts {
    /// Metadata of the file, until all is counted.
    waiting: Vec<Metadata>,
    /// Offset from the agent's time to that of the file, nanoseconds.
    epoch: u64,
    values: u64,
    /// Times of the first and the last copied message.
    times: Option<(u64, u64)>,
    /// By property, values dropped before the copied part, and until its end.
    drops: SortedMap<String, (u64, u64)>,
    decoder: Decoder,
}

impl CopyCounts {
    /// Creates the counts of an agent's recording from the metadata of its run.
    /// The metadata says when the run began; for other files nothing is counted.
    pub fn new(run: Option<&Metadata>) -> Self {
        let epoch = run.and_then(|run| run.metadata.get("epoch_ns")?.parse().ok());
        Self { epoch: epoch.unwrap_or_default(), ..Self::default() }
    }

    /// Keeps metadata to be counted anew, and returns other metadata.
    pub fn keep(&mut self, metadata: Metadata) -> Option<Metadata> {
        if !COUNTED_METADATA.contains(&metadata.name.as_str()) {
            return Some(metadata);
        }
        self.waiting.push(metadata);
        None
    }

    /// Notes the drops that a message of the file reports, copied or not.
    pub fn note_drops(&mut self, message: &Message, start: u64, selection: &Selection) {
        let is_told = message.channel.topic == DROPPED_TOPIC.name
            && message.schema.is_some_and(|schema| schema.name == DROPPED_TOPIC.schema);
        let time = message.log_time.saturating_sub(start);
        if !is_told || selection.to.is_some_and(|to| time > to) {
            return;
        }
        let value = self.decoder.decode(message);
        let (Some(url), Some(count)) = (value.text("url"), value.number("values")) else { return };
        let drops = self.drops.entry(url).or_default();
        // It counts from the beginning of the recording.
        drops.1 = count as u64;
        if selection.from.is_some_and(|from| time < from) {
            drops.0 = drops.1;
        }
    }

    /// Counts a message that is copied.
    pub fn count(&mut self, topic: &str, log_time: u64) {
        self.values += u64::from(TOPICS.iter().all(|other| other.name != topic));
        let (from, to) = self.times.unwrap_or((log_time, log_time));
        self.times = Some((from.min(log_time), to.max(log_time)));
    }

    /// Returns the renewed metadata.
    pub fn renewed_metadata(self, selection: &Selection, prefix: &str) -> Vec<Metadata> {
        let dropped_metadata = self.waiting.iter().find(|metadata| metadata.name == "dropped");
        let counts: SortedMap<String, u64> = match dropped_metadata.filter(|_| !selection.is_span()) {
            Some(dropped_metadata) => {
                let count = |(url, count): (&String, &String)| Some((url.clone(), count.parse().ok()?));
                dropped_metadata.metadata.iter().filter_map(count).collect()
            }
            None => self.drops.into_iter().map(|(url, (before, until))| (url, until - before)).collect(),
        };
        let drops = counts.into_iter().filter(|(url, count)| *count > 0 && selection.has(url));
        let drops: SortedMap<_, _> =
            drops.map(|(url, count)| (prefixed_topic(prefix, &url), count)).collect();
        let dropped: u64 = drops.values().sum();
        let agent_time = |time: u64| time.saturating_sub(self.epoch).to_string();
        let renewed = self.waiting.into_iter().map(|mut metadata| {
            let texts = &mut metadata.metadata;
            let mut set = |key: &str, text: String| {
                if let Some(own) = texts.get_mut(key) {
                    *own = text;
                }
            };
            match (metadata.name.as_str(), self.times) {
                ("dropped", _) => {
                    *texts = drops.iter().map(|(url, count)| (url.clone(), count.to_string())).collect();
                }
                ("end", times) => {
                    set("values", self.values.to_string());
                    set("dropped", dropped.to_string());
                    if selection.is_span() {
                        times.into_iter().for_each(|(_, to)| set("time_ns", agent_time(to)));
                        // They are those of the whole run.
                        texts.retain(|key, _| !["cycles", "digest"].contains(&key.as_str()));
                    }
                }
                (_, Some((from, to))) if selection.is_span() => {
                    set("from_ns", agent_time(from));
                    set("to_ns", agent_time(to));
                }
                _ => {}
            }
            metadata
        });
        renewed.collect()
    }
}
