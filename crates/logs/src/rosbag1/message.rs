//! Messages of ROS 1, which lie without gaps, as those of ROS 2, which are aligned.

use slate_ros_messages::CdrWriter;

/// The types of a message; the first is its own.
pub(super) struct Types {
    pub kinds: Vec<BagMessageType>,
}

pub(super) struct BagMessageType {
    /// Package and name.
    pub name: String,
    pub fields: Vec<Field>,
    /// Lines of constants.
    pub constants: Vec<String>,
}

pub(super) struct Field {
    pub name: String,
    pub item: Item,
    pub count: Count,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Item {
    /// Size in bytes, and name in ROS 2.
    Number(usize, &'static str),
    Bool,
    Text,
    Time,
    Duration,
    Message(usize),
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Count {
    One,
    Fixed(usize),
    Any,
}

/// A message that is read.
struct Input<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Maximum number of values that may follow.
    /// Hostile definitions have messages without bytes in endless lists.
    room: usize,
}

impl<'a> Input<'a> {
    fn take(&mut self, length: usize) -> Result<&'a [u8], String> {
        let rest = &self.bytes[self.at..];
        let found = rest.get(..length);
        let found = found.ok_or_else(|| {
            format!("at byte {}: {length} bytes should follow, there are {}", self.at, rest.len())
        })?;
        self.at += length;
        Ok(found)
    }

    fn length(&mut self) -> Result<usize, String> {
        let bytes = self.take(4)?;
        Ok(bytes.iter().rev().fold(0, |length, byte| length << 8 | usize::from(*byte)))
    }

    fn value(&mut self) -> Result<(), String> {
        self.room = self.room.checked_sub(1).ok_or("it has more values than bytes")?;
        Ok(())
    }
}

impl Types {
    /// Appends a message as CDR.
    pub fn convert(&self, bytes: &[u8], out: &mut Vec<u8>) -> Result<(), String> {
        let mut input = Input { bytes, at: 0, room: 64 + 32 * bytes.len() };
        self.message(0, &mut input, Some(&mut CdrWriter::new(out)))?;
        match bytes.len() - input.at {
            0 => Ok(()),
            left => Err(format!("{left} bytes are left over: it is another message")),
        }
    }

    /// Reads a message; without `out` it is skipped.
    fn message(
        &self,
        index: usize,
        input: &mut Input<'_>,
        mut out: Option<&mut CdrWriter<'_>>,
    ) -> Result<(), String> {
        input.value()?;
        let kind = &self.kinds[index];
        for field in &kind.fields {
            let out = if kind.is_left_out(field) { None } else { out.as_deref_mut() };
            self.field(field, input, out)?;
        }
        if kind.fields.is_empty()
            && let Some(out) = out
        {
            out.byte(0);
        }
        Ok(())
    }

    fn field(
        &self,
        field: &Field,
        input: &mut Input<'_>,
        mut out: Option<&mut CdrWriter<'_>>,
    ) -> Result<(), String> {
        let count = match field.count {
            Count::One => 1,
            Count::Fixed(count) => count,
            Count::Any => {
                let count = input.length()?;
                if let Some(out) = out.as_deref_mut() {
                    out.length(count as u32);
                }
                count
            }
        };
        if let Item::Number(size, _) = field.item {
            let length = count.checked_mul(size).ok_or("a list is too long")?;
            let bytes = input.take(length)?;
            if let Some(out) = out {
                out.little(bytes, size);
            }
            return Ok(());
        }
        for _ in 0..count {
            input.value()?;
            self.item(field.item, input, out.as_deref_mut())?;
        }
        Ok(())
    }

    fn item(&self, item: Item, input: &mut Input<'_>, out: Option<&mut CdrWriter<'_>>) -> Result<(), String> {
        match item {
            Item::Message(inner) => return self.message(inner, input, out),
            Item::Bool => {
                let byte = input.take(1)?[0];
                if let Some(out) = out {
                    out.byte(u8::from(byte != 0));
                }
            }
            Item::Text => {
                let (length, at) = (input.length()?, input.at);
                let text = std::str::from_utf8(input.take(length)?);
                let text = text.map_err(|_| format!("at byte {at}: a text is not UTF-8"))?;
                if let Some(out) = out {
                    // Some writers count the zero at the end of a text.
                    let text = text.trim_end_matches('\0').replace('\0', "\u{fffd}");
                    out.text(&text).map_err(|error| error.to_string())?;
                }
            }
            Item::Number(size, _) => {
                let bytes = input.take(size)?;
                if let Some(out) = out {
                    out.little(bytes, size);
                }
            }
            Item::Time | Item::Duration => {
                let bytes = input.take(8)?;
                if let Some(out) = out {
                    out.little(bytes, 4);
                }
            }
        }
        Ok(())
    }
}
