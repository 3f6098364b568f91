//! Values from messages.

use super::map::{MemoryListKind, TypeMap, WireCount};
use super::xcdr::{XcdrReader, store};

impl TypeMap {
    /// Reads a part of a message into memory, and items of the tail into `tail`.
    ///
    /// # Errors
    /// It is no such message, or the value has no room for it, in words.
    pub fn read(
        &self,
        reader: &mut XcdrReader<'_>,
        memory: Option<&mut [u8]>,
        tail: &mut Vec<u8>,
    ) -> Result<(), String> {
        match self {
            Self::Number { wire, memory: kind, .. } => {
                let number = reader.number(*wire)?;
                match (memory, kind) {
                    (Some(memory), Some(kind)) => store(*kind, number, memory),
                    _ => Ok(()),
                }
            }
            Self::Text { bound, capacity } => {
                let text = reader.text()?;
                let most = capacity.unwrap_or(usize::MAX).min(bound.unwrap_or(usize::MAX));
                if text.len() > most {
                    return Err(format!("a string has {} bytes, more than {most}", text.len()));
                }
                if let (Some(memory), Some(_)) = (memory, capacity) {
                    memory[..4].copy_from_slice(&(text.len() as u32).to_ne_bytes());
                    memory[4..4 + text.len()].copy_from_slice(text.as_bytes());
                }
                Ok(())
            }
            Self::Struct { .. } => self.read_struct(reader, memory, tail),
            Self::List { item, .. } => {
                let around = match reader.encapsulation.is_second && !item.is_number() {
                    true => Some(reader.begin()?),
                    false => None,
                };
                self.read_list(reader, memory, tail)?;
                around.into_iter().for_each(|around| reader.finish(around));
                Ok(())
            }
        }
    }

    fn read_struct(
        &self,
        reader: &mut XcdrReader<'_>,
        mut memory: Option<&mut [u8]>,
        tail: &mut Vec<u8>,
    ) -> Result<(), String> {
        let Self::Struct { own, members } = self else { return Ok(()) };
        let is_appendable = own.is_appendable.unwrap_or(reader.encapsulation.is_delimited);
        let is_delimited = is_appendable && reader.encapsulation.is_second;
        let around = if is_delimited { Some(reader.begin()?) } else { None };
        for ((offset, map), member) in members.iter().zip(&own.members) {
            if is_appendable && reader.left() == 0 {
                // Of an older version of the type, without the appended members.
                break;
            }
            let memory = memory.as_deref_mut().map(|memory| &mut memory[*offset..]);
            let read = map.read(reader, memory, tail);
            read.map_err(|reason| format!("{}: {reason}", member.name))?;
        }
        around.into_iter().for_each(|around| reader.finish(around));
        Ok(())
    }

    fn read_list(
        &self,
        reader: &mut XcdrReader<'_>,
        memory: Option<&mut [u8]>,
        tail: &mut Vec<u8>,
    ) -> Result<(), String> {
        let Self::List { item, count, memory: list } = self else { return Ok(()) };
        let count = match count {
            WireCount::Fixed(count) => *count,
            WireCount::Counted(bound) => {
                let count = reader.length()?;
                let most = bound.unwrap_or(usize::MAX);
                if count > most {
                    return Err(format!("a sequence has {count} items, more than {most}"));
                }
                count
            }
        };
        let (Some(memory), Some(list)) = (memory, list) else {
            return item.skip_all(reader, count);
        };
        match list.kind {
            MemoryListKind::Array => item.read_all(reader, &mut memory[..count * list.size], list.size),
            MemoryListKind::Sequence(room) => {
                if count > room {
                    return Err(format!("a sequence has {count} items, the interface has room for {room}"));
                }
                memory[..4].copy_from_slice(&(count as u32).to_ne_bytes());
                item.read_all(reader, &mut memory[8..8 + count * list.size], list.size)
            }
            MemoryListKind::Tail => item.read_tail(reader, count, list.size, tail),
        }
    }

    /// Reads the items of a tail.
    /// Memory is allocated as items are read, as the number in the message may be wrong.
    fn read_tail(
        &self,
        reader: &mut XcdrReader<'_>,
        count: usize,
        size: usize,
        tail: &mut Vec<u8>,
    ) -> Result<(), String> {
        if self.is_copied() {
            reader.check(count.saturating_mul(size))?;
            tail.resize(count * size, 0);
            return self.read_all(reader, tail, size);
        }
        for index in 0..count {
            tail.resize((index + 1) * size, 0);
            self.read(reader, Some(&mut tail[index * size..]), &mut Vec::new())?;
        }
        Ok(())
    }

    fn read_all(&self, reader: &mut XcdrReader<'_>, memory: &mut [u8], size: usize) -> Result<(), String> {
        if self.is_copied() {
            return reader.numbers(memory, size);
        }
        // Only an interface as a whole has a tail.
        let mut none = Vec::new();
        memory.chunks_exact_mut(size).try_for_each(|memory| self.read(reader, Some(memory), &mut none))
    }

    fn skip_all(&self, reader: &mut XcdrReader<'_>, count: usize) -> Result<(), String> {
        if let Self::Number { wire, .. } = self {
            return reader.skip(count, wire.size());
        }
        (0..count).try_for_each(|_| self.read(reader, None, &mut Vec::new()))
    }

    /// Returns whether items have one layout in memory and on the wire.
    /// Except for the byte order.
    pub(super) fn is_copied(&self) -> bool {
        matches!(self, Self::Number { wire, memory: Some(kind), .. } if wire == kind)
    }

    pub(super) fn is_number(&self) -> bool {
        matches!(self, Self::Number { is_enumeration: false, .. })
    }
}
