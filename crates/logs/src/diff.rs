use std::collections::VecDeque;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use serde::Serialize;
use slate_sorted::{SortedMap, SortedSet};

use crate::open;
use slate_bag::{Channel, Decoder, Error, Message, Reader, Schema, Selection, Unread, Value};
use slate_record::TOPICS;

/// Selection of the compared messages.
#[derive(Clone, Debug, Default)]
pub struct Compared {
    /// Selected topics and times.
    pub selection: Selection,
    /// Set if measurements on the wall clock are compared too.
    /// They differ from run to run: loads, durations of ticks, the log.
    pub is_measured: bool,
}

/// Differences between the messages of two files.
/// The first messages of each topic are compared with each other, then the second ones, and so on; the order of topics
/// among each other, chunks, indexes and metadata are not compared.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Diff {
    /// The first difference by log time; nothing if the messages are identical.
    pub first: Option<Difference>,
    /// Counts per topic.
    pub topics: SortedMap<String, Counts>,
    /// Topics that were left out, because they hold measurements.
    pub measured: SortedSet<String>,
    /// Messages of the first and the second file that can't be decoded.
    /// They are compared byte by byte.
    pub unread: [Vec<Unread>; 2],
}

/// One difference.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// The log time, nanoseconds; the earlier one if they are not the same.
    pub time: u64,
    /// The topic.
    pub topic: String,
    /// Index of the message in its topic, from 0.
    pub number: u64,
    /// The first field that differs, such as `pose/x`.
    /// A field outside of the value is in parentheses, such as `(log time)`.
    pub field: String,
    /// The value in the first file; `None` if it has no such message.
    pub a: Option<String>,
    /// The value in the second file; `None` if it has no such message.
    pub b: Option<String>,
}

/// Messages of a topic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Number of equal messages.
    pub same: u64,
    /// Number of different messages.
    pub different: u64,
    /// Number of messages that only the first file has.
    pub only_a: u64,
    /// Number of messages that only the second file has.
    pub only_b: u64,
}

/// Compares the messages of two files, except for measurements on the wall clock.
///
/// # Errors
/// As [`diff_of`].
pub fn diff(a: &Path, b: &Path) -> Result<Diff, Error> {
    diff_of(a, b, &Compared::default())
}

/// Compares those messages of two files.
///
/// # Errors
/// When one is damaged or can't be read, a topic is in none of them, or there is nothing to compare.
pub fn diff_of(a: &Path, b: &Path, compared: &Compared) -> Result<Diff, Error> {
    let mut sides = [Side::open(a, compared)?, Side::open(b, compared)?];
    let mut diff = Diff::default();
    let mut first: Option<(u64, String, u64)> = None;
    let mut differ = |time: u64, topic: &str, number: u64| {
        let found = (time, topic.to_owned(), number);
        if first.as_ref().is_none_or(|first| found < *first) {
            first = Some(found);
        }
    };
    let mut turn = 0;
    while !(sides[0].is_done && sides[1].is_done) {
        turn = if sides[turn].is_done { 1 - turn } else { turn };
        let Some((topic, mark)) = sides[turn].next()? else { continue };
        let counts = diff.topics.entry(topic.clone()).or_default();
        match sides[1 - turn].waiting.get_mut(&topic).and_then(VecDeque::pop_front) {
            Some(other) if other.digest == mark.digest => counts.same += 1,
            Some(other) => {
                counts.different += 1;
                differ(mark.time.min(other.time), &topic, mark.number);
            }
            None => sides[turn].waiting.entry(topic).or_default().push_back(mark),
        }
        turn = 1 - turn;
    }
    for (side, only_a) in sides.iter().zip([true, false]) {
        for (topic, waiting) in &side.waiting {
            let Some(mark) = waiting.front() else { continue };
            differ(mark.time, topic, mark.number);
            let counts = diff.topics.entry(topic.clone()).or_default();
            *(if only_a { &mut counts.only_a } else { &mut counts.only_b }) += waiting.len() as u64;
        }
    }
    let topics: SortedSet<_> =
        sides.iter().flat_map(|side| side.reader.channels()).map(|channel| channel.topic.as_str()).collect();
    compared.selection.check(a, topics.iter().copied())?;
    let known = topics.len();
    for side in &mut sides {
        diff.measured.extend(std::mem::take(&mut side.measured));
    }
    if diff.topics.is_empty() {
        let what = match (diff.measured.len(), known) {
            (0, 0) => "neither this file nor the other one has a message to compare".into(),
            (0, _) => "none of the messages of this file and the other one are selected".into(),
            (measured, _) => format!(
                "nothing is left to compare: the selection, of {measured} topics, has only wall-clock \
                 measurements; `--all` compares them too"
            ),
        };
        return Err(Error::Unfit { path: a.into(), what });
    }
    diff.unread = sides.map(|side| side.decoder.into_unread());
    if let Some((time, topic, number)) = first {
        let found = |path| FoundMessage::read(path, &topic, number, &compared.selection);
        let (a, b) = (found(a)?, found(b)?);
        let (field, a, b) = compare(a, b);
        diff.first = Some(Difference { time, topic, number, field, a, b });
    }
    Ok(diff)
}

/// One of the two files.
struct Side<'a> {
    reader: Reader<BufReader<File>>,
    compared: &'a Compared,
    decoder: Decoder,
    measured: SortedSet<String>,
    is_done: bool,
    /// Start time.
    start: Option<u64>,
    /// Number of messages read, by topic.
    numbers: SortedMap<String, u64>,
    /// Messages whose counterpart has not been read yet.
    /// They are few if the files have the same order.
    waiting: SortedMap<String, VecDeque<Mark>>,
}

/// A message that waits for its counterpart.
struct Mark {
    time: u64,
    number: u64,
    digest: u128,
}

impl<'a> Side<'a> {
    fn open(path: &Path, compared: &'a Compared) -> Result<Self, Error> {
        let reader = open(path)?;
        Ok(Self {
            start: reader.start(),
            reader,
            compared,
            decoder: Decoder::default(),
            measured: SortedSet::new(),
            is_done: false,
            numbers: SortedMap::new(),
            waiting: SortedMap::new(),
        })
    }

    fn next(&mut self) -> Result<Option<(String, Mark)>, Error> {
        let Compared { selection, is_measured } = self.compared;
        while let Some(message) = self.reader.next_message()? {
            let topic = &message.channel.topic;
            let start = *self.start.get_or_insert(message.log_time);
            if !selection.has(topic) || !selection.has_time(message.log_time, start) {
                continue;
            }
            if !is_measured && measures(&message) {
                if !self.measured.contains(topic) {
                    self.measured.insert(topic.clone());
                }
                continue;
            }
            self.decoder.check(&message);
            let (topic, time, digest) = (topic.clone(), message.log_time, digest(&message));
            let number = self.numbers.entry(topic.clone()).or_default();
            let mark = Mark { time, number: *number, digest };
            *number += 1;
            return Ok(Some((topic, mark)));
        }
        self.is_done = true;
        Ok(None)
    }
}

/// Returns true if a message holds measurements on the wall clock.
/// These differ from run to run of the same configuration and seed, as the recorder notes in its channel.
fn measures(message: &Message) -> bool {
    let channel = message.channel;
    let schema = message.schema.map_or("", |schema| schema.name.as_str());
    channel.metadata.get("repeats").is_some_and(|repeats| repeats == "false")
        || TOPICS.iter().any(|own| own.name == channel.topic && own.schema == schema)
}

/// Returns a digest of everything that is compared.
fn digest(message: &Message) -> u128 {
    let mut hash = xxhash_rust::xxh3::Xxh3Default::new();
    let mut text = |text: &[u8]| {
        hash.update(&(text.len() as u64).to_le_bytes());
        hash.update(text);
    };
    text(message.channel.message_encoding.as_bytes());
    text(sender(message.channel).as_bytes());
    if let Some(schema) = message.schema {
        text(schema.name.as_bytes());
        text(schema.encoding.as_bytes());
        text(&schema.data);
    }
    text(&message.log_time.to_le_bytes());
    text(&message.publish_time.to_le_bytes());
    text(&message.sequence.to_le_bytes());
    text(message.data);
    hash.digest128()
}

/// Returns the sender of the messages of a channel, if it is a mailbox.
fn sender(channel: &Channel) -> &str {
    channel.metadata.get("sender").map_or("", String::as_str)
}

/// A message that was searched for.
struct FoundMessage {
    encoding: String,
    sender: String,
    schema: Option<Schema>,
    sequence: u32,
    log_time: u64,
    publish_time: u64,
    data: Vec<u8>,
    value: Value,
}

impl FoundMessage {
    fn read(path: &Path, topic: &str, number: u64, selection: &Selection) -> Result<Option<Self>, Error> {
        let mut reader = open(path)?;
        let (mut start, mut seen) = (reader.start(), 0);
        while let Some(message) = reader.next_message()? {
            let start = *start.get_or_insert(message.log_time);
            if message.channel.topic != topic || !selection.has_time(message.log_time, start) {
                continue;
            }
            if seen == number {
                return Ok(Some(Self {
                    encoding: message.channel.message_encoding.clone(),
                    sender: sender(message.channel).to_owned(),
                    schema: message.schema.map(|schema| Schema::clone(schema)),
                    sequence: message.sequence,
                    log_time: message.log_time,
                    publish_time: message.publish_time,
                    data: message.data.to_vec(),
                    value: Decoder::default().decode(&message),
                }));
            }
            seen += 1;
        }
        Ok(None)
    }

    fn type_name(&self) -> String {
        self.schema.as_ref().map_or_else(|| "none".into(), |schema| schema.name.clone())
    }
}

/// Returns the first field that differs, and its two values.
fn compare(a: Option<FoundMessage>, b: Option<FoundMessage>) -> (String, Option<String>, Option<String>) {
    let (a, b) = match (a, b) {
        (Some(a), Some(b)) => (a, b),
        (a, b) => {
            let text = |found: FoundMessage| found.value.to_string();
            return ("(message)".into(), a.map(text), b.map(text));
        }
    };
    let pair = |field: &str, a: String, b: String| (field.to_owned(), Some(a), Some(b));
    if a.type_name() != b.type_name() {
        return pair("(type)", a.type_name(), b.type_name());
    }
    if a.sender != b.sender {
        return pair("(sender)", a.sender, b.sender);
    }
    if a.encoding != b.encoding {
        return pair("(encoding)", a.encoding, b.encoding);
    }
    if let (Some(a), Some(b)) = (&a.schema, &b.schema)
        && a != &(Schema { id: a.id, ..b.clone() })
    {
        let text = |schema: &Schema| String::from_utf8_lossy(&schema.data).into_owned();
        return pair("(definition)", text(a), text(b));
    }
    let times = [
        ("(log time)", a.log_time, b.log_time),
        ("(publish time)", a.publish_time, b.publish_time),
        ("(sequence)", a.sequence.into(), b.sequence.into()),
    ];
    if let Some((field, a, b)) = times.into_iter().find(|(_, a, b)| a != b) {
        return pair(field, a.to_string(), b.to_string());
    }
    let (left, right) = (a.value.fields(true), b.value.fields(true));
    for (i, (field, value)) in left.iter().enumerate() {
        match right.get(i) {
            Some((other_field, other)) if field == other_field && value == other => {}
            Some((other_field, other)) if field == other_field => {
                return pair(field, value.clone(), other.clone());
            }
            _ => return (field.clone(), Some(value.clone()), None),
        }
    }
    if let Some((field, value)) = right.get(left.len()) {
        return (field.clone(), None, Some(value.clone()));
    }
    // Padding, or the payload of a NaN, or what can't be read.
    let offset = a.data.iter().zip(&b.data).take_while(|(a, b)| a == b).count();
    let byte = |data: &[u8]| data.get(offset).map_or_else(|| "none".into(), |byte| format!("{byte:#04x}"));
    pair(&format!("(byte {offset})"), byte(&a.data), byte(&b.data))
}
