//! Descriptions of an agent's properties for another agent.

use serde::{Deserialize, Serialize};
use slate_blackboard::interface::View;
use slate_blackboard::{Access, Board, Carrier, Pattern, Property, Stamp};
use slate_module::encode_interface;
use slate_runtime::sharing::{Newest, RemoteProperty};
use slate_sorted::SortedMap;

use super::Allowance;
use super::rights::{may_read, may_send};
use crate::schema::interface;

/// Approximate size of a part of an answer, bytes.
const PART_SIZE: usize = 32 << 10;

/// Largest answer, and limit of all incomplete answers, bytes.
const MAX_ANSWER_SIZE: usize = 64 << 20;

#[derive(Debug, Serialize, Deserialize)]
struct InspectionEntry<'a> {
    path: &'a str,
    doc: &'a str,
    access: u8,
    #[serde(with = "bytes")]
    interface: &'a [u8],
    capacity: u64,
    depth: u32,
    has_writer: bool,
    #[serde(borrow)]
    newest: EntryNewest<'a>,
}

#[derive(Debug, Serialize, Deserialize)]
enum EntryNewest<'a> {
    Unwritten,
    Value {
        #[serde(with = "bytes")]
        bytes: &'a [u8],
        items: u64,
        stamp: (u64, u64, u64),
    },
    TooLarge(u64),
    NotAllowed,
}

/// Bytes as a whole.
mod bytes {
    use serde::{Deserialize, Deserializer, Serializer};

    pub fn serialize<S: Serializer>(bytes: &[u8], serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(bytes)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<&'de [u8], D::Error> {
        <&[u8]>::deserialize(deserializer)
    }
}

/// Question of another agent that is being answered.
#[derive(Debug)]
pub(super) struct PropertyQuery {
    pattern: Pattern,
    values: bool,
    /// Path of the last reported property.
    last_sent: Option<String>,
}

impl PropertyQuery {
    /// Creates a question; `None` for an invalid pattern, which no property matches.
    pub fn new(pattern: &str, values: bool) -> Option<Self> {
        Some(Self { pattern: Pattern::parse(pattern).ok()?, values, last_sent: None })
    }

    /// Returns the next part of the answer, and whether it is the last one.
    /// Values of more than `largest` bytes are reported by their size only.
    pub fn next(&mut self, board: &Board, largest: usize, allowance: Option<&Allowance>) -> (Vec<u8>, bool) {
        let mut part = Vec::new();
        for property in board.matching(&self.pattern) {
            if self.last_sent.as_deref().is_some_and(|last_sent| property.path() <= last_sent) {
                continue;
            }
            if !may_read(allowance, property.path()) && !may_send(allowance, property.path()) {
                continue;
            }
            if part.len() >= PART_SIZE {
                return (part, false);
            }
            let may_read = may_read(allowance, property.path());
            let newest = if self.values && may_read { property.newest().ok().flatten() } else { None };
            let newest = match &newest {
                None if self.values && !may_read && property.access() != Access::Messages => {
                    EntryNewest::NotAllowed
                }
                None => EntryNewest::Unwritten,
                Some((bytes, ..)) if bytes.len() > largest => EntryNewest::TooLarge(bytes.len() as u64),
                Some((bytes, items, stamp)) => {
                    let stamp = (stamp.sequence, stamp.time, stamp.generation);
                    EntryNewest::Value { bytes, items: *items as u64, stamp }
                }
            };
            write(&property, newest, &mut part);
            self.last_sent = Some(property.path().into());
        }
        (part, true)
    }
}

fn write(property: &Property, newest: EntryNewest<'_>, part: &mut Vec<u8>) {
    let Ok(interface) = encode_interface(property.descriptor()) else { return };
    let (capacity, depth) = match property.carrier() {
        Carrier::Channel(channel) => (channel.shape().capacity, channel.depth()),
        Carrier::Mailbox(mailbox) => (mailbox.shape().capacity, 0),
    };
    let entry = InspectionEntry {
        path: property.path(),
        doc: property.doc(),
        access: match property.access() {
            Access::Output => 0,
            Access::Setting => 1,
            Access::Messages => 2,
        },
        interface: &interface,
        capacity: capacity as u64,
        depth: depth as u32,
        has_writer: property.has_writer(),
        newest,
    };
    let begin = part.len();
    match postcard::to_extend(&entry, std::mem::take(part)) {
        Ok(written) => *part = written,
        Err(_) => part.truncate(begin),
    }
}

/// Incomplete answers to this agent's questions.
#[derive(Debug, Default)]
pub(super) struct Answers {
    parts: SortedMap<u32, (Vec<RemoteProperty>, usize)>,
}

impl Answers {
    /// Takes a part; the whole when it was the last.
    pub fn take(
        &mut self,
        request: u32,
        mut bytes: &[u8],
        last: bool,
    ) -> Option<Result<Vec<RemoteProperty>, String>> {
        let others = self.parts.values().map(|(_, size)| size).sum::<usize>();
        if others.saturating_add(bytes.len()) > MAX_ANSWER_SIZE {
            let (_, own) = self.parts.remove(&request).unwrap_or_default();
            let what = if own == others { "the answer is" } else { "the answers under way are" };
            return Some(Err(format!("{what} larger than {MAX_ANSWER_SIZE} bytes: ask for fewer paths")));
        }
        let (all, size) = self.parts.entry(request).or_default();
        *size += bytes.len();
        while !bytes.is_empty() {
            let Ok((entry, rest)) = postcard::take_from_bytes::<InspectionEntry<'_>>(bytes) else {
                self.parts.remove(&request);
                return Some(Err("the answer can't be read".into()));
            };
            bytes = rest;
            match read(&entry) {
                Ok(property) => all.push(property),
                Err(reason) => {
                    let reason = format!("/{}: {reason}", entry.path);
                    self.parts.remove(&request);
                    return Some(Err(reason));
                }
            }
        }
        if last { self.parts.remove(&request).map(|(all, _)| Ok(all)) } else { None }
    }

    pub fn forget(&mut self, request: u32) {
        self.parts.remove(&request);
    }
}

fn read(entry: &InspectionEntry<'_>) -> Result<RemoteProperty, String> {
    let descriptor = interface(entry.interface).map_err(|refusal| refusal.to_string())?;
    let newest = match entry.newest {
        EntryNewest::Unwritten => Newest::Unwritten,
        EntryNewest::TooLarge(size) => Newest::TooLarge(size),
        EntryNewest::NotAllowed => Newest::NotAllowed,
        EntryNewest::Value { bytes, items, stamp: (sequence, time, generation) } => {
            let items =
                usize::try_from(items).ok().filter(|items| View::new(descriptor, bytes, *items).is_some());
            // Bytes that are not value of the interface are ignored.
            items.map_or(Newest::Unwritten, |items| {
                Newest::Value(bytes.to_vec(), items, Stamp { sequence, time, generation })
            })
        }
    };
    Ok(RemoteProperty {
        path: entry.path.into(),
        doc: entry.doc.into(),
        access: match entry.access {
            0 => Access::Output,
            1 => Access::Setting,
            _ => Access::Messages,
        },
        descriptor,
        capacity: entry.capacity,
        depth: entry.depth,
        has_writer: entry.has_writer,
        newest,
    })
}
