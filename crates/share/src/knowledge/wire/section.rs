use super::writer::number_length;
use super::{WireReader, WireWriter};
use crate::knowledge::life::{Life, LifeEntry, StatementBody};
use crate::knowledge::version::{epoch, number};
use crate::knowledge::{Limits, MessageError};

/// Part of a life: entries after `after` up to `through` that remain at `version`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LifeSection<'a> {
    pub origin: u32,
    pub epoch: u64,
    pub after: u64,
    pub through: u64,
    pub version: u64,
    pub floor: u64,
    pub closes: bool,
    entries: WireReader<'a>,
}

/// Entry of a life in a message.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EntryView<'a> {
    pub sequence: u64,
    pub key: &'a [u8],
    pub time: u64,
    pub order: u64,
    /// Schema, certainty and value.
    pub body: Option<(u64, f64, &'a [u8])>,
}

impl EntryView<'_> {
    pub fn to_entry(self) -> LifeEntry {
        let body = self.body.map(|(schema, certainty, value)| StatementBody {
            schema,
            certainty,
            value: value.into(),
        });
        LifeEntry { key: self.key.into(), time: self.time, order: self.order, body }
    }
}

impl<'a> LifeSection<'a> {
    pub fn read(reader: &mut WireReader<'a>, limits: &Limits) -> Result<Self, MessageError> {
        let origin = reader.small()?;
        let number = reader.small()?;
        let epoch = epoch(number, u32::from_le_bytes(reader.fixed()?));
        let [after, through, version, floor] =
            [reader.number()?, reader.number()?, reader.number()?, reader.number()?];
        if !(after < through && through <= version && floor <= version) {
            return Err(reader.expected("a section within its life"));
        }
        let closes = reader.flag()?;
        let count = reader.number()?;
        let begin = *reader;
        let mut previous = after;
        for _ in 0..count {
            previous = read_entry(reader, previous, limits)?.sequence;
        }
        if previous > through {
            return Err(reader.expected("statements within their section"));
        }
        let entries = begin.until(reader);
        Ok(Self { origin, epoch, after, through, version, floor, closes, entries })
    }

    /// Returns the entries with numbers greater than `above`.
    pub fn entries(&self, above: u64, limits: &Limits) -> impl Iterator<Item = EntryView<'a>> {
        let (mut reader, mut previous, limits) = (self.entries, self.after, *limits);
        std::iter::from_fn(move || {
            if reader.is_empty() {
                return None;
            }
            // They were gone through when the section was read.
            let entry = read_entry(&mut reader, previous, &limits).ok()?;
            previous = entry.sequence;
            Some(entry)
        })
        .filter(move |entry| entry.sequence > above)
    }
}

fn read_entry<'a>(
    reader: &mut WireReader<'a>,
    previous: u64,
    limits: &Limits,
) -> Result<EntryView<'a>, MessageError> {
    let step = reader.number()?;
    let sequence = (previous.checked_add(step).filter(|_| step > 0))
        .ok_or_else(|| reader.expected("statements in order"))?;
    let length = reader.length(limits.key)?;
    let key = reader.bytes(length)?;
    let time = reader.number()?;
    let ahead = reader.number()?;
    let order = time.checked_add(ahead).ok_or_else(|| reader.expected("an order of 64 bits"))?;
    let body = match reader.flag()? {
        false => None,
        true => {
            let schema = u64::from_le_bytes(reader.fixed()?);
            let certainty = f64::from_le_bytes(reader.fixed()?);
            if !(0.0..=1.0).contains(&certainty) {
                return Err(reader.expected("a certainty from 0 to 1"));
            }
            let length = reader.length(limits.value)?;
            Some((schema, certainty, reader.bytes(length)?))
        }
    };
    Ok(EntryView { sequence, key, time, order, body })
}

fn write_entry(writer: &mut WireWriter, step: u64, entry: &LifeEntry) {
    writer.number(step);
    writer.number(entry.key.len() as u64);
    writer.bytes(&entry.key);
    writer.number(entry.time);
    writer.number(entry.order.saturating_sub(entry.time));
    writer.byte(entry.body.is_some().into());
    if let Some(body) = &entry.body {
        writer.bytes(&body.schema.to_le_bytes());
        writer.bytes(&body.certainty.to_le_bytes());
        writer.number(body.value.len() as u64);
        writer.bytes(&body.value);
    }
}

fn entry_length(step: u64, entry: &LifeEntry) -> usize {
    let (key, ahead) = (entry.key.len(), entry.order.saturating_sub(entry.time));
    let head = number_length(step) + number_length(key as u64) + key;
    let body = entry.body.as_ref().map_or(0, |body| {
        let length = body.value.len();
        16 + number_length(length as u64) + length
    });
    head + number_length(entry.time) + number_length(ahead) + 1 + body
}

/// Largest header of a section, bytes.
/// It has the origin, the epoch, four versions, a flag and a count.
const MAX_HEADER_SIZE: usize = 5 + 9 + 4 * 10 + 1 + 10;

/// Writes the entries of a life after a statement, as far as they fit the length.
/// Returns the last statement written; writes nothing if not even one entry fits.
pub(crate) fn write_section(
    writer: &mut WireWriter,
    origin: u32,
    life: &Life,
    after: u64,
    limit: usize,
) -> Option<u64> {
    let mut room = limit.checked_sub(writer.length() + MAX_HEADER_SIZE)?;
    let (mut count, mut through, mut complete) = (0_u64, after, true);
    for (sequence, entry) in life.after(after) {
        match room.checked_sub(entry_length(sequence - through, entry)) {
            Some(rest) => room = rest,
            None => {
                complete = false;
                break;
            }
        }
        (count, through) = (count + 1, sequence);
    }
    if complete {
        through = life.version;
    } else if count == 0 {
        return None;
    }
    writer.number(origin.into());
    writer.number(number(life.epoch).into());
    writer.bytes(&(life.epoch as u32).to_le_bytes());
    for version in [after, through, life.version, life.floor] {
        writer.number(version);
    }
    writer.byte(life.closes.into());
    writer.number(count);
    let mut previous = after;
    for (sequence, entry) in life.after(after).take(count as usize) {
        write_entry(writer, sequence - previous, entry);
        previous = sequence;
    }
    Some(through)
}
