//! Conversion of samples and queries to values.

use serde_json::Value as Json;
use slate_blackboard::interface::{Descriptor, Field, Kind, Value, View};
use slate_ros_messages as ros;

use crate::attachment::{AttachmentError, SampleAttachment};

/// Encoding of values in CDR, without the name of the message.
const CDR_ENCODING: &str = "application/cdr";

/// Encodings that say nothing.
const UNSPECIFIED_ENCODINGS: [&str; 2] = ["", "zenoh/bytes"];

/// Encodings of JSON.
const JSON_ENCODINGS: [&str; 2] = ["application/json", "text/json"];

/// Encodings of a number, a truth value or a word as text.
const TEXT_ENCODINGS: [&str; 2] = ["text/plain", "zenoh/string"];

/// Maximum size of JSON or text, bytes.
/// As a value it takes many times its length.
const MAX_TEXT_LENGTH: usize = 1 << 20;

/// Package of the messages that recordings and networks name.
const SCHEMA_PACKAGE: &str = "slate_msgs/";

/// Returns the encoding of an interface's values.
/// Such as `application/cdr;slate_msgs/msg/Pose2`: CDR of the message that recordings define for it.
pub fn encoding(descriptor: &Descriptor) -> String {
    format!("{CDR_ENCODING};{}", ros::definition(descriptor).name)
}

/// Content of a sample or query.
#[derive(Clone, Copy, Debug)]
pub struct Payload<'a> {
    /// Encoding in Zenoh's notation, with the part after the semicolon.
    pub encoding: &'a str,
    /// Bytes.
    pub bytes: &'a [u8],
    /// Bytes of the attachment; empty without one.
    pub attachment: &'a [u8],
}

/// Decoded value.
#[derive(Clone, Debug, PartialEq)]
pub enum Decoded {
    /// Whole, as it lies in memory.
    Bytes(Vec<u8>),
    /// Value without its type, of the whole or of a field.
    Value(Value),
}

impl Decoded {
    /// Converts it to JSON, for a value of that interface.
    ///
    /// # Errors
    /// In words, when it is too short.
    pub fn json(&self, descriptor: &'static Descriptor) -> Result<Json, String> {
        let json = match self {
            Self::Value(value) => serde_json::to_value(value),
            Self::Bytes(bytes) => {
                let item = descriptor.tail().map_or(0, Kind::size);
                let items = bytes.len().saturating_sub(descriptor.size).checked_div(item).unwrap_or(0);
                serde_json::to_value(View::new(descriptor, bytes, items).ok_or("it is too short")?)
            }
        };
        json.map_err(|error| error.to_string())
    }
}

/// Reason why a payload is not a value of an interface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PayloadError {
    /// Other interface.
    #[error("it is {found}, expected {expected}: name a source of that interface")]
    Type {
        /// Interface of this end.
        expected: String,
        /// Interface of the other end.
        found: String,
    },
    /// The interface has other fields there.
    #[error(
        "{interface} has schema {found:016x} there and {expected:016x} here: both ends need the same version of it"
    )]
    Schema {
        /// Name.
        interface: &'static str,
        /// Hash here.
        expected: u64,
        /// Hash there.
        found: u64,
    },
    /// The bytes are no such message.
    #[error("it is not {expected}: {error}")]
    Message {
        /// Name of the message.
        expected: String,
        /// Reason.
        error: ros::Error,
    },
    /// The bytes beside it are of Slate, and can't be read.
    #[error(transparent)]
    Attachment(#[from] AttachmentError),
    /// Payload without JSON.
    #[error("it is not JSON: {0}")]
    Json(String),
    /// Payload without text.
    #[error("it is not UTF-8, as `{0}` says; send CDR, JSON or text")]
    Text(String),
    /// The text is too long.
    #[error("it has {0} bytes of text, more than {longest}; send CDR", longest = MAX_TEXT_LENGTH)]
    Long(usize),
    /// Unknown encoding.
    #[error("its encoding is `{0}`; send application/cdr, application/json or text/plain")]
    Encoding(String),
    /// Whole value for a field.
    #[error("a field takes JSON or text, and this is CDR of a whole value")]
    Field,
    /// Bare number for several fields.
    #[error("{0} has several fields, and this is one value: name the field, or send an object")]
    Several(&'static str),
}

impl Payload<'_> {
    /// Decodes the value of an interface, or of a field of it.
    ///
    /// # Errors
    /// Reason why it is invalid. Memory stays in proportion to the payload and the interface.
    pub fn decode(&self, descriptor: &Descriptor, field: &str) -> Result<Decoded, PayloadError> {
        let (name, schema) = self.encoding.split_once(';').unwrap_or((self.encoding, ""));
        match name {
            CDR_ENCODING => self.cdr(descriptor, field, schema),
            // No text begins with the header of CDR.
            name if UNSPECIFIED_ENCODINGS.contains(&name) && matches!(self.bytes, [0, 0 | 1, ..]) => {
                self.cdr(descriptor, field, "")
            }
            name if is_text(name) && self.bytes.len() > MAX_TEXT_LENGTH => {
                Err(PayloadError::Long(self.bytes.len()))
            }
            name if JSON_ENCODINGS.contains(&name) => {
                let json = serde_json::from_slice(self.bytes)
                    .map_err(|error| PayloadError::Json(error.to_string()))?;
                whole_or_field(descriptor, field, json)
            }
            name if is_text(name) => {
                let text = std::str::from_utf8(self.bytes)
                    .map_err(|_| PayloadError::Text(self.encoding.into()))?
                    .trim();
                whole_or_field(descriptor, field, value_of_text(text))
            }
            _ => Err(PayloadError::Encoding(shortened(self.encoding))),
        }
    }

    /// Returns the stamp and the schema, if the sender is an agent.
    ///
    /// # Errors
    /// When it claims to be one, and they can't be read.
    pub fn attachment(&self) -> Result<Option<SampleAttachment>, AttachmentError> {
        if self.attachment.is_empty() {
            return Ok(None);
        }
        match SampleAttachment::decode(self.attachment) {
            Ok(attachment) => Ok(Some(attachment)),
            // Other programs have attachments of their own.
            Err(error) if self.is_slate() => Err(error),
            Err(_) => Ok(None),
        }
    }

    fn is_slate(&self) -> bool {
        self.encoding.split_once(';').is_some_and(|(_, schema)| schema.starts_with(SCHEMA_PACKAGE))
    }

    fn cdr(&self, descriptor: &Descriptor, field: &str, schema: &str) -> Result<Decoded, PayloadError> {
        let expected = || ros::definition(descriptor).name;
        if !field.is_empty() {
            return Err(PayloadError::Field);
        }
        if !schema.is_empty() && schema != expected() {
            return Err(PayloadError::Type { expected: expected(), found: shortened(schema) });
        }
        if self.is_slate()
            && let Some(found) = self.attachment()?.map(|attachment| attachment.hash)
            && found != descriptor.hash
        {
            return Err(PayloadError::Schema {
                interface: descriptor.name,
                expected: descriptor.hash,
                found,
            });
        }
        let decoded = ros::decode(descriptor, self.bytes);
        decoded.map(Decoded::Bytes).map_err(|error| PayloadError::Message { expected: expected(), error })
    }
}

/// Returns whether an encoding is read as text, unless it is CDR.
fn is_text(encoding: &str) -> bool {
    [&JSON_ENCODINGS[..], &TEXT_ENCODINGS, &UNSPECIFIED_ENCODINGS]
        .iter()
        .any(|names| names.contains(&encoding))
}

/// Assigns a bare value to the only field.
fn whole_or_field(descriptor: &Descriptor, field: &str, value: Value) -> Result<Decoded, PayloadError> {
    match (field, &value, descriptor.fields) {
        ("", Value::Table(_), _) => Ok(Decoded::Value(value)),
        ("", _, [only]) if !is_nested(only) => {
            Ok(Decoded::Value(Value::Table(vec![(only.name.into(), value)])))
        }
        ("", ..) => Err(PayloadError::Several(descriptor.name)),
        _ => Ok(Decoded::Value(value)),
    }
}

fn is_nested(field: &Field) -> bool {
    matches!(field.kind, Kind::Nested(_))
}

/// Parses a number, a truth value, or else the text itself.
fn value_of_text(text: &str) -> Value {
    match serde_json::from_str(text) {
        Ok(
            value @ (Value::Bool(_) | Value::Integer(_) | Value::Float(_) | Value::Table(_) | Value::List(_)),
        ) => value,
        _ => Value::Text(text.into()),
    }
}

/// Returns the beginning of an untrusted text, short enough for a message.
fn shortened(text: &str) -> String {
    text.chars().take(80).filter(|letter| !letter.is_control()).collect()
}
