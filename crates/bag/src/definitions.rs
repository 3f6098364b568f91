//! Schemas and channels of a file, and the content of a chunk.

use std::sync::Arc;

use slate_sorted::SortedMap;

use super::record::{Channel, Chunk, Field, Malformed, MessageRecord, Record, RecordInput, Records, Schema};

/// Schemas and channels defined so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Definitions {
    pub schemas: SortedMap<u16, Arc<Schema>>,
    pub channels: SortedMap<u16, Arc<Channel>>,
}

impl Definitions {
    pub fn add_schema(&mut self, schema: Schema) -> Result<(), Malformed> {
        if schema.id == 0 {
            return Err("a schema has the number 0, which stands for none".into());
        }
        match self.schemas.get(&schema.id) {
            Some(known) if **known != schema => {
                Err(format!("schema {} is defined again as another one", schema.id))
            }
            Some(_) => Ok(()),
            None => {
                self.schemas.insert(schema.id, schema.into());
                Ok(())
            }
        }
    }

    pub fn add_channel(&mut self, channel: Channel) -> Result<(), Malformed> {
        if channel.schema_id != 0 && !self.schemas.contains_key(&channel.schema_id) {
            return Err(format!(
                "channel {} (`{}`) has schema {}, which is not defined before it",
                channel.id, channel.topic, channel.schema_id
            ));
        }
        match self.channels.get(&channel.id) {
            Some(known) if **known != channel => {
                Err(format!("channel {} (`{}`) is defined again as another one", channel.id, known.topic))
            }
            Some(_) => Ok(()),
            None => {
                self.channels.insert(channel.id, channel.into());
                Ok(())
            }
        }
    }

    /// Notes the definition of a chunk's record, or returns its message.
    pub fn take<'a>(&mut self, opcode: u8, bytes: &'a [u8]) -> Result<Option<MessageRecord<'a>>, Malformed> {
        match opcode {
            Schema::OPCODE => self.add_schema(Schema::parse(bytes)?).map(|()| None),
            Channel::OPCODE => self.add_channel(Channel::parse(bytes)?).map(|()| None),
            MessageRecord::OPCODE => {
                let message = MessageRecord::parse(bytes)?;
                match self.channels.contains_key(&message.channel_id) {
                    true => Ok(Some(message)),
                    false => Err(format!(
                        "message {} is of channel {}, which is not defined before it",
                        message.sequence, message.channel_id
                    )),
                }
            }
            other => Err(format!("a record in it has opcode {other:#04x}, which can't be in a chunk")),
        }
    }
}

/// The times and places of the messages of a chunk.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Content {
    /// Earliest and latest log time; 0 without messages.
    pub times: (u64, u64),
    /// By channel, the log times and places of its messages.
    pub index: SortedMap<u16, Vec<(u64, u64)>>,
}

impl Content {
    /// Reads all records of a chunk, and notes their definitions.
    pub fn read(records: &[u8], definitions: &mut Definitions) -> Result<Self, Malformed> {
        let mut content = Self::default();
        for record in Records::new(records) {
            let (offset, opcode, bytes) = record?;
            let message =
                definitions.take(opcode, bytes).map_err(|what| format!("at byte {offset}: {what}"))?;
            if let Some(message) = message {
                content.add(offset, &message);
            }
        }
        Ok(content)
    }

    pub fn add(&mut self, offset: u64, message: &MessageRecord) {
        let time = message.log_time;
        self.times = match self.index.is_empty() {
            true => (time, time),
            false => (self.times.0.min(time), self.times.1.max(time)),
        };
        self.index.entry(message.channel_id).or_default().push((time, offset));
    }

    /// Returns the number of messages.
    pub fn messages(&self) -> u64 {
        self.index.values().map(|entries| entries.len() as u64).sum()
    }
}

/// Reads the available fields of a chunk before its records; returns the rest.
/// The rest may be shorter than it should be.
pub(super) fn chunk_head(bytes: &[u8]) -> Result<(Chunk<'static>, u64, &[u8]), Malformed> {
    let mut input = RecordInput(bytes);
    let head = Chunk {
        message_start_time: Field::read(&mut input)?,
        message_end_time: Field::read(&mut input)?,
        uncompressed_size: Field::read(&mut input)?,
        uncompressed_crc: Field::read(&mut input)?,
        compression: Field::read(&mut input)?,
        records: &[],
    };
    let compressed = Field::read(&mut input)?;
    Ok((head, compressed, input.0))
}
