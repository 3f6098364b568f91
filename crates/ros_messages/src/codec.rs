use slate_blackboard::interface::{Descriptor, Kind, Primitive};

use super::Error;
use super::cdr::{CdrReader, CdrWriter, WireFormat, wire_length};

/// Appends a value as a message of its [`definition`](super::definition).
/// The message is little-endian CDR with its header.
///
/// `bytes` is the value as it lies in memory, with its tail, if it has one. Its padding is zero, as all but its writer see
/// it, and is not a field of the message. Nothing is allocated when `out` has room.
///
/// # Errors
/// When `bytes` is not a value of that interface; `out` is unchanged then.
pub fn encode(descriptor: &Descriptor, bytes: &[u8], out: &mut Vec<u8>) -> Result<(), Error> {
    encode_in(WireFormat::Cdr, descriptor, bytes, out)
}

/// Appends a value as a message of that format.
///
/// # Errors
/// When `bytes` is not a value of that interface; `out` is unchanged then.
pub fn encode_in(
    format: WireFormat,
    descriptor: &Descriptor,
    bytes: &[u8],
    out: &mut Vec<u8>,
) -> Result<(), Error> {
    let tail = items(descriptor, bytes)?;
    wire_length(bytes.len())?;
    let mut encoder = Encoder { writer: CdrWriter::of(format, out), shown: true };
    encoder.message(descriptor, bytes, tail);
    if hides(descriptor) {
        let memory = if encoder.shown { &[] } else { bytes };
        encoder.writer.length(memory.len() as u32);
        encoder.writer.raw(memory);
    }
    Ok(())
}

/// Returns the value in a message of [`encode`], bit for bit.
///
/// # Errors
/// When it is not a message of that interface.
pub fn decode(descriptor: &Descriptor, message: &[u8]) -> Result<Vec<u8>, Error> {
    decode_in(WireFormat::Cdr, descriptor, message)
}

/// Returns the value in a message of that format.
///
/// # Errors
/// When it is not a message of that interface.
pub fn decode_in(format: WireFormat, descriptor: &Descriptor, message: &[u8]) -> Result<Vec<u8>, Error> {
    let mut reader = CdrReader::of(format, message)?;
    let mut value = vec![0; descriptor.size];
    read_message(&mut reader, descriptor, &mut value)?;
    if hides(descriptor) {
        let length = reader.length()?;
        let memory = reader.raw(length)?;
        if length > 0 {
            reader.end()?;
            // Readers of the fields and of the memory must see the same value.
            let mut again = Vec::new();
            encode_in(format, descriptor, memory, &mut again)?;
            let from = if format == WireFormat::Cdr { 4 } else { 0 };
            if again.get(from..) != message.get(from..again.len()) {
                return reader.error("the field `memory` holds another value than the fields before it");
            }
            return Ok(memory.to_vec());
        }
    }
    reader.end()?;
    Ok(value)
}

/// Returns the number of items in the tail of a value.
pub(super) fn items(descriptor: &Descriptor, bytes: &[u8]) -> Result<usize, Error> {
    let item = descriptor.tail().map_or(0, Kind::size);
    match bytes.len().checked_sub(descriptor.size) {
        Some(0) => Ok(0),
        Some(tail) if item > 0 && tail % item == 0 => Ok(tail / item),
        _ => Err(Error::Size {
            interface: descriptor.name.into(),
            expected: if item > 0 {
                format!("{} and {item} for each item of its tail", descriptor.size)
            } else {
                descriptor.size.to_string()
            },
            found: bytes.len(),
        }),
    }
}

/// Returns true if a value can hold bits that its message does not carry.
/// Examples are the bytes behind the end of a text.
pub(super) fn hides(descriptor: &Descriptor) -> bool {
    fn kind_hides(kind: &Kind) -> bool {
        match kind {
            Kind::Primitive(Primitive::Bool) | Kind::Text(_) | Kind::Optional(_) | Kind::Sequence(..) => true,
            Kind::Array(_, 0) => false,
            Kind::Array(item, _) | Kind::Tail(item) => kind_hides(item),
            Kind::Nested(descriptor) => hides(descriptor),
            _ => false,
        }
    }
    descriptor.fields.iter().any(|field| kind_hides(&field.kind))
}

/// Returns true if an item of a list is a message of its own.
/// ROS has no lists of lists.
pub(super) fn is_wrapped(item: &Kind) -> bool {
    matches!(item, Kind::Optional(_) | Kind::Array(..) | Kind::Sequence(..) | Kind::Tail(_))
}

/// Returns the size of a number with the same memory in the message.
/// Only the order of its bytes may differ.
fn number(kind: &Kind) -> Option<usize> {
    match kind {
        Kind::Primitive(Primitive::U8) | Kind::Primitive(Primitive::I8) => Some(1),
        Kind::Primitive(Primitive::U16) | Kind::Primitive(Primitive::I16) => Some(2),
        Kind::Primitive(Primitive::U32)
        | Kind::Primitive(Primitive::I32)
        | Kind::Primitive(Primitive::F32) => Some(4),
        Kind::Primitive(Primitive::U64)
        | Kind::Primitive(Primitive::I64)
        | Kind::Primitive(Primitive::F64) => Some(8),
        Kind::Enumeration(enumeration) => number(&enumeration.carrier),
        _ => None,
    }
}

fn word(bytes: &[u8]) -> usize {
    u32::from_ne_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as usize
}

fn is_zero(bytes: &[u8]) -> bool {
    bytes.iter().all(|byte| *byte == 0)
}

struct Encoder<'a> {
    writer: CdrWriter<'a>,
    /// Set while the fields have carried every bit.
    shown: bool,
}

impl Encoder<'_> {
    fn message(&mut self, descriptor: &Descriptor, bytes: &[u8], tail: usize) {
        let before = self.writer.written();
        for field in descriptor.fields {
            self.value(&field.kind, &bytes[field.offset..], tail);
        }
        self.fill(before);
    }

    fn fill(&mut self, before: usize) {
        if self.writer.written() == before {
            self.writer.empty();
        }
    }

    fn value(&mut self, kind: &Kind, bytes: &[u8], tail: usize) {
        match kind {
            Kind::Primitive(Primitive::Bool) => {
                self.shown &= bytes[0] <= 1;
                self.writer.byte(u8::from(bytes[0] != 0));
            }
            Kind::Enumeration(enumeration) => self.value(&enumeration.carrier, bytes, 0),
            Kind::Text(capacity) => self.text(&bytes[..4 + capacity]),
            Kind::Optional(item) => {
                self.shown &= word(bytes) <= 1 && is_zero(&bytes[4..8]);
                self.writer.byte(u8::from(word(bytes) != 0));
                self.value(item, &bytes[8..], 0);
            }
            Kind::Array(item, count) => self.list(item, bytes, *count),
            Kind::Sequence(item, capacity) => {
                let count = word(bytes).min(*capacity);
                let unused = &bytes[8 + count * item.size()..8 + capacity * item.size()];
                self.shown &= word(bytes) == count && is_zero(&bytes[4..8]) && is_zero(unused);
                self.writer.length(count as u32);
                self.list(item, &bytes[8..], count);
            }
            Kind::Nested(descriptor) => self.message(descriptor, bytes, 0),
            Kind::Tail(item) => {
                self.writer.length(tail as u32);
                self.list(item, bytes, tail);
            }
            other => self.writer.numbers(&bytes[..other.size()], other.size()),
        }
    }

    fn text(&mut self, bytes: &[u8]) {
        let (length, bytes) = (word(bytes), &bytes[4..]);
        let text = &bytes[..length.min(bytes.len())];
        // A reader of the message gets what `Text` shows of a damaged value.
        let text = match std::str::from_utf8(text) {
            Ok(text) => text.as_bytes(),
            Err(error) => &text[..error.valid_up_to()],
        };
        self.shown &= text.len() == length && is_zero(&bytes[text.len()..]);
        // The whole value fits a message, as was checked.
        let _ = self.writer.begin_text(text.len());
        self.writer.raw(text);
        self.writer.end_text();
    }

    fn list(&mut self, item: &Kind, bytes: &[u8], count: usize) {
        if let Some(size) = number(item) {
            return self.writer.numbers(&bytes[..count * size], size);
        }
        for i in 0..count {
            let before = self.writer.written();
            self.value(item, &bytes[i * item.size()..], 0);
            self.fill(before);
        }
    }
}

fn read_message(
    reader: &mut CdrReader<'_>,
    descriptor: &Descriptor,
    memory: &mut Vec<u8>,
) -> Result<(), Error> {
    let fixed = match descriptor.fields.split_last() {
        Some((last, others)) if matches!(last.kind, Kind::Tail(_)) => others,
        _ => descriptor.fields,
    };
    let before = reader.left();
    for field in fixed {
        read(reader, &field.kind, &mut memory[field.offset..])?;
    }
    if let Some(item) = descriptor.tail() {
        let count = reader.length()?;
        if let Some(size) = number(item) {
            let tail = reader.new_numbers(count, size)?;
            memory.extend_from_slice(&tail);
        } else {
            for _ in 0..count {
                let start = memory.len();
                memory.resize(start + item.size(), 0);
                read_item(reader, item, &mut memory[start..])?;
            }
        }
    }
    read_fill(reader, before)
}

fn read_fill(reader: &mut CdrReader<'_>, before: usize) -> Result<(), Error> {
    if reader.left() == before { reader.empty() } else { Ok(()) }
}

fn read_item(reader: &mut CdrReader<'_>, item: &Kind, memory: &mut [u8]) -> Result<(), Error> {
    let before = reader.left();
    read(reader, item, memory)?;
    read_fill(reader, before)
}

fn read(reader: &mut CdrReader<'_>, kind: &Kind, memory: &mut [u8]) -> Result<(), Error> {
    let set = |memory: &mut [u8], number: usize| memory[..4].copy_from_slice(&(number as u32).to_ne_bytes());
    match kind {
        Kind::Primitive(Primitive::Bool) => memory[0] = reader.bool()?.into(),
        Kind::Enumeration(enumeration) => read(reader, &enumeration.carrier, memory)?,
        Kind::Text(capacity) => {
            let text = reader.text()?;
            if text.len() > *capacity {
                return reader.error(format!("a string has {} bytes, more than {capacity}", text.len()));
            }
            set(memory, text.len());
            memory[4..4 + text.len()].copy_from_slice(text.as_bytes());
        }
        Kind::Optional(item) => {
            set(memory, reader.bool()?.into());
            read(reader, item, &mut memory[8..])?;
        }
        Kind::Array(item, count) => read_list(reader, item, *count, memory)?,
        Kind::Sequence(item, capacity) => {
            let count = reader.length()?;
            if count > *capacity {
                return reader.error(format!("a list has {count} items, more than {capacity}"));
            }
            set(memory, count);
            read_list(reader, item, count, &mut memory[8..])?;
        }
        Kind::Nested(descriptor) => {
            let before = reader.left();
            for field in descriptor.fields {
                read(reader, &field.kind, &mut memory[field.offset..])?;
            }
            read_fill(reader, before)?;
        }
        // Only an interface as a whole has a tail.
        Kind::Tail(_) => return reader.error("a list stands where none can be"),
        other => reader.numbers(&mut memory[..other.size()], other.size())?,
    }
    Ok(())
}

fn read_list(reader: &mut CdrReader<'_>, item: &Kind, count: usize, memory: &mut [u8]) -> Result<(), Error> {
    if let Some(size) = number(item) {
        return reader.numbers(&mut memory[..count * size], size);
    }
    (0..count).try_for_each(|i| read_item(reader, item, &mut memory[i * item.size()..]))
}
