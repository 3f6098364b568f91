//! What the values of a channel are as values of the blackboard.

use std::collections::BTreeMap;

use slate_blackboard::interface::{Descriptor, Kind};

use crate::bag::Message;
use crate::ros;

/// The interface of a channel.
pub(super) struct Form {
    pub descriptor: &'static Descriptor,
    /// Items in the longest tail.
    pub capacity: usize,
}

impl Form {
    /// Finds out what the values of a message's channel are among the interfaces that are known, by their schemas.
    pub fn of(message: &Message<'_>, known: &BTreeMap<u64, &'static Descriptor>) -> Result<Self, String> {
        let channel = message.channel;
        let Some(schema) = message.schema.filter(|_| channel.message_encoding == "cdr") else {
            let encoding = &channel.message_encoding;
            return Err(format!("its messages are encoded as `{encoding}`, and only `cdr` with a definition is played"));
        };
        let said = channel.metadata.get("hash");
        let own = said.and_then(|hash| known.get(&u64::from_str_radix(hash, 16).ok()?).copied());
        // Other tools leave out what only Slate says.
        let alike = || {
            known.values().copied().find(|descriptor| {
                let definition = ros::definition(descriptor);
                definition.name == schema.name && definition.text.as_bytes() == &*schema.data
            })
        };
        let descriptor = own.or_else(|| said.is_none().then(alike).flatten());
        if let Some(descriptor) = descriptor {
            return Ok(Self { descriptor, capacity: 0 });
        }
        let name = schema.name.rsplit('/').next().unwrap_or_default();
        let other = known.values().find(|descriptor| descriptor.name == name);
        Err(match (said, other) {
            (Some(said), Some(other)) => format!(
                "its interface {name} is {said} in the recording and {:016x} here: it was recorded by another version",
                other.hash
            ),
            _ => format!("its type {} is not known here", schema.name),
        })
    }

    /// Takes note of what a value needs.
    pub fn note(&mut self, message: &[u8]) -> Result<(), ros::Error> {
        let items = self.items(&self.decode(message)?);
        self.capacity = self.capacity.max(items);
        Ok(())
    }

    /// The value of a message, as it lies in memory.
    pub fn decode(&self, message: &[u8]) -> Result<Vec<u8>, ros::Error> {
        ros::decode(self.descriptor, message)
    }

    /// How many items its tail has.
    pub fn items(&self, bytes: &[u8]) -> usize {
        let item = self.descriptor.tail().map_or(0, Kind::size);
        bytes.len().saturating_sub(self.descriptor.size).checked_div(item).unwrap_or(0)
    }
}
