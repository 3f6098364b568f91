//! Interface of a channel's values on the blackboard.

use slate_blackboard::interface::{Descriptor, Kind};
use slate_sorted::SortedMap;

use slate_bag::{Message, interface};
use slate_ros_messages::{self as ros, Described, Schema};

/// Interface of a channel: a known one, or the one that its definition describes.
/// The definition is the one in the file.
pub(super) struct ValueForm {
    pub descriptor: &'static Descriptor,
    /// Items in the longest tail.
    pub capacity: usize,
    described: Option<Described>,
    /// Remark for the user.
    pub remark: Option<String>,
}

/// Stands for an interface that is not made yet.
static UNKNOWN: Descriptor =
    Descriptor { name: "message", doc: "", ros: "", fields: &[], size: 0, align: 1, hash: 0 };

impl ValueForm {
    /// Determines the interface of a message's channel.
    /// `known` are interfaces by schema.
    pub fn of(message: &Message<'_>, known: &SortedMap<u64, &'static Descriptor>) -> Result<Self, String> {
        let channel = message.channel;
        let wanted = message.schema.filter(|schema| schema.encoding == "ros2msg");
        let Some(schema) = wanted.filter(|_| channel.message_encoding == "cdr") else {
            let encoding = &channel.message_encoding;
            return Err(format!(
                "its messages are encoded as `{encoding}`; expected `cdr` with a definition as `ros2msg`"
            ));
        };
        let recorded = channel.metadata.get("hash");
        if let Some(descriptor) = interface(message, known) {
            return Ok(Self { descriptor, capacity: 0, described: None, remark: None });
        }
        let name = schema.name.rsplit('/').next().unwrap_or_default();
        let other = known.values().find(|descriptor| recorded.is_some() && descriptor.name == name);
        let remark = other.map(|other| {
            format!(
                "its interface {name} is {} in the recording and {:016x} here: it was recorded by another version, and is \
                 played as the recording describes it",
                recorded.map_or("", String::as_str),
                other.hash
            )
        });
        let text = std::str::from_utf8(&schema.data).map_err(|_| "its definition is not UTF-8")?;
        let parsed = Schema::parse(&schema.name, text).map_err(|error| error.to_string())?;
        // Its size is known when all values were seen.
        let described = Some(Described::new(&schema.name, parsed)?);
        Ok(Self { descriptor: &UNKNOWN, capacity: 0, described, remark })
    }

    /// Notes the size that a value needs.
    pub fn note(&mut self, message: &[u8]) -> Result<(), ros::Error> {
        if let Some(described) = &mut self.described {
            return described.note(message);
        }
        let items = self.items(&self.decode(message)?);
        self.capacity = self.capacity.max(items);
        Ok(())
    }

    /// Completes the interface, once all values were noted.
    pub fn finish(&mut self) -> Result<(), String> {
        if let Some(described) = &mut self.described {
            (self.descriptor, self.capacity) = described.interface()?;
        }
        Ok(())
    }

    /// Returns the value of a message in its memory layout.
    pub fn decode(&self, message: &[u8]) -> Result<Vec<u8>, ros::Error> {
        match &self.described {
            Some(described) => described.decode(message),
            None => ros::decode(self.descriptor, message),
        }
    }

    /// Returns the number of items in the tail of a value.
    pub fn items(&self, bytes: &[u8]) -> usize {
        let item = self.descriptor.tail().map_or(0, Kind::size);
        bytes.len().saturating_sub(self.descriptor.size).checked_div(item).unwrap_or(0)
    }
}
