//! Messages from values.

use super::map::{MemoryListKind, TypeMap, WireCount};
use super::xcdr::{XcdrWriter, load, store};

impl TypeMap {
    /// Appends a part of a message; members that the value lacks are zero or empty.
    ///
    /// # Errors
    /// The value does not fit the type, in words.
    pub fn write(
        &self,
        writer: &mut XcdrWriter<'_>,
        memory: Option<&[u8]>,
        tail: &[u8],
    ) -> Result<(), String> {
        match self {
            Self::Number { wire, memory: kind, .. } => {
                let mut number = [0; 8];
                if let (Some(memory), Some(kind)) = (memory, kind) {
                    store(*wire, load(*kind, memory), &mut number)?;
                }
                writer.numbers(&number[..wire.size()], wire.size());
                Ok(())
            }
            Self::Text { bound, capacity } => {
                let text = match (memory, capacity) {
                    (Some(memory), Some(capacity)) => text(memory, *capacity),
                    _ => "",
                };
                match bound {
                    Some(most) if text.len() > *most => {
                        Err(format!("a string has {} bytes, more than {most}", text.len()))
                    }
                    _ => writer.text(text),
                }
            }
            Self::Struct { .. } => self.write_struct(writer, memory, tail),
            Self::List { item, .. } => {
                let begun = (writer.encapsulation.is_second && !item.is_number()).then(|| writer.begin());
                self.write_list(writer, memory, tail)?;
                begun.map_or(Ok(()), |begun| writer.finish(begun))
            }
        }
    }

    fn write_struct(
        &self,
        writer: &mut XcdrWriter<'_>,
        memory: Option<&[u8]>,
        tail: &[u8],
    ) -> Result<(), String> {
        let Self::Struct { own, members } = self else { return Ok(()) };
        let is_delimited = own.is_appendable == Some(true) && writer.encapsulation.is_second;
        let begun = is_delimited.then(|| writer.begin());
        for ((offset, map), member) in members.iter().zip(&own.members) {
            let written = map.write(writer, memory.map(|memory| &memory[*offset..]), tail);
            written.map_err(|reason| format!("{}: {reason}", member.name))?;
        }
        begun.map_or(Ok(()), |begun| writer.finish(begun))
    }

    fn write_list(
        &self,
        writer: &mut XcdrWriter<'_>,
        memory: Option<&[u8]>,
        tail: &[u8],
    ) -> Result<(), String> {
        let Self::List { item, count, memory: list } = self else { return Ok(()) };
        let (Some(memory), Some(list)) = (memory, list) else {
            return match count {
                WireCount::Fixed(count) => (0..*count).try_for_each(|_| item.write(writer, None, &[])),
                WireCount::Counted(_) => writer.length(0),
            };
        };
        let items = match (list.kind, count) {
            (MemoryListKind::Array, WireCount::Fixed(count)) => &memory[..count * list.size],
            (MemoryListKind::Sequence(room), _) => {
                let count = length(memory).min(room);
                &memory[8..8 + count * list.size]
            }
            (MemoryListKind::Tail, _) | (MemoryListKind::Array, WireCount::Counted(_)) => tail,
        };
        if let WireCount::Counted(bound) = count {
            let (found, most) = (items.len() / list.size.max(1), bound.unwrap_or(usize::MAX));
            if found > most {
                return Err(format!("a sequence has {found} items, more than {most}"));
            }
            writer.length(found)?;
        }
        if item.is_copied() {
            writer.numbers(items, list.size);
            return Ok(());
        }
        items.chunks_exact(list.size).try_for_each(|memory| item.write(writer, Some(memory), &[]))
    }
}

fn length(memory: &[u8]) -> usize {
    u32::from_ne_bytes([memory[0], memory[1], memory[2], memory[3]]) as usize
}

/// Returns a text in a value, up to damaged bytes.
fn text(memory: &[u8], capacity: usize) -> &str {
    let bytes = &memory[4..4 + length(memory).min(capacity)];
    match std::str::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) => std::str::from_utf8(&bytes[..error.valid_up_to()]).unwrap_or_default(),
    }
}
