use std::mem::offset_of;

use slate_blackboard::interface::{Descriptor, Field, Interface, Kind};
use slate_interfaces::{FactHead, FactTableHead};

/// Layout of a table of facts.
/// It is the `FactTable` of slate-mapek, or one of another language with the same layout.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    descriptor: &'static Descriptor,
    /// Size of a fact, bytes; the offset of its value follows.
    item: usize,
    value: usize,
}

/// Fact in a table, without its value.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TableEntry<'a> {
    pub key: &'a str,
    pub time: u64,
    pub certainty: f64,
    pub retracted: bool,
    pub value: &'a [u8],
    /// Bytes of the fact.
    pub bytes: &'a [u8],
}

impl Layout {
    /// Returns the layout of tables of an interface.
    ///
    /// # Errors
    /// In words, when it is another interface.
    pub fn of(descriptor: &'static Descriptor) -> Result<Self, String> {
        let begins = |with: &Descriptor, descriptor: &Descriptor, beyond: usize| {
            let same = |(own, other): (&Field, &Field)| {
                own.name == other.name
                    && own.offset == other.offset
                    && own.kind.describe() == other.kind.describe()
            };
            descriptor.fields.len() == with.fields.len() + beyond
                && with.fields.iter().zip(descriptor.fields).all(same)
        };
        let entry = match descriptor.tail() {
            Some(Kind::Nested(entry)) if begins(FactTableHead::DESCRIPTOR, descriptor, 1) => Some(*entry),
            _ => None,
        };
        let value = entry
            .filter(|entry| begins(FactHead::DESCRIPTOR, entry, 1))
            .and_then(|entry| Some((entry, entry.fields.last()?)))
            .filter(|(entry, value)| {
                let begin = FactHead::DESCRIPTOR.size;
                let end = begin + value.kind.size();
                value.offset == begin && end.next_multiple_of(entry.align) == entry.size
            });
        match value {
            Some((entry, value)) => Ok(Self { descriptor, item: entry.size, value: value.offset }),
            None => {
                Err(format!("{} is not a table of facts, such as FactTable of slate-mapek", descriptor.name))
            }
        }
    }

    /// Returns the interface of the tables.
    pub fn descriptor(&self) -> &'static Descriptor {
        self.descriptor
    }

    /// Returns the size of a value with its padding, bytes.
    pub fn value_size(&self) -> usize {
        self.item - self.value
    }

    /// Returns the facts of a table.
    pub(super) fn entries<'a>(&self, table: &'a [u8], items: usize) -> impl Iterator<Item = TableEntry<'a>> {
        let Self { item, value, .. } = *self;
        let facts = table.get(self.descriptor.size..).unwrap_or_default();
        facts.chunks_exact(item).take(items).map(move |bytes| TableEntry {
            // The last field of the head.
            key: text(&bytes[offset_of!(FactHead, key)..value]),
            time: number(bytes, offset_of!(FactHead, time)),
            certainty: f64::from_bits(number(bytes, offset_of!(FactHead, certainty))),
            retracted: bytes[offset_of!(FactHead, retracted)] != 0,
            value: &bytes[value..],
            bytes,
        })
    }
}

fn number(bytes: &[u8], at: usize) -> u64 {
    let mut number = [0; 8];
    number.copy_from_slice(&bytes[at..at + 8]);
    u64::from_ne_bytes(number)
}

/// Decodes a text of fixed size; empty if it is damaged.
fn text(bytes: &[u8]) -> &str {
    let Some((length, text)) = bytes.split_first_chunk() else { return "" };
    let length = (u32::from_ne_bytes(*length) as usize).min(text.len());
    std::str::from_utf8(&text[..length]).unwrap_or_default()
}
