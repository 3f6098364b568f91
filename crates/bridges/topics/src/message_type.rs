use serde_json::{Map, Value as Json};
use slate_ros_messages::{Definition, Schema, WireFormat, encode_json_in};

use crate::type_hash::type_hash;

/// Type of a message that its definition describes.
#[derive(Clone, Debug)]
pub struct MessageType {
    format: WireFormat,
    name: String,
    definition: String,
    schema: Schema,
}

impl PartialEq for MessageType {
    fn eq(&self, other: &Self) -> bool {
        (self.format, &self.name, &self.definition) == (other.format, &other.name, &other.definition)
    }
}

impl MessageType {
    /// Parses a definition.
    /// Messages in it follow, each after a line of `=` and `MSG: package/Name`.
    ///
    /// # Errors
    /// The definition is invalid; the reason in words.
    pub fn parse(format: WireFormat, name: &str, definition: &str) -> Result<Self, String> {
        let schema = Schema::parse(name, definition).map_err(|error| error.to_string())?;
        Ok(Self { format, name: name.into(), definition: definition.into(), schema })
    }

    /// Returns the name in ROS, such as `std_srvs/srv/SetBool_Request`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns its fields, followed by the messages in it.
    pub fn definition(&self) -> &str {
        &self.definition
    }

    /// Returns the hash by which ROS 2 nodes compare it.
    pub fn type_hash(&self) -> Option<String> {
        type_hash(&Definition { name: self.name.clone(), text: self.definition.clone() }).ok()
    }

    /// Returns its fields.
    pub fn schema(&self) -> &Schema {
        &self.schema
    }

    /// Encodes a message; fields that it lacks are zero or empty.
    ///
    /// # Errors
    /// A value does not fit; the reason in words.
    pub fn encode(&self, message: &Json) -> Result<Vec<u8>, String> {
        encode_json_in(self.format, &self.schema, message).map_err(|error| error.to_string())
    }

    /// Decodes a message.
    ///
    /// # Errors
    /// They are no such message; the reason in words.
    pub fn decode(&self, bytes: &[u8]) -> Result<Json, String> {
        let value = self.schema.decode_in(self.format, bytes).map_err(|error| error.to_string())?;
        serde_json::to_value(value).map_err(|error| error.to_string())
    }

    /// Returns the message whose fields are zero or empty.
    ///
    /// # Errors
    /// The definition has no such message; the reason in words.
    pub fn empty(&self) -> Result<Json, String> {
        self.decode(&self.encode(&Json::Object(Map::new()))?)
    }
}
