//! Decodes the values of messages.

use std::fmt;

use serde::{Serialize, Serializer};
use slate_sorted::SortedMap;

use super::{Message, seconds};
use slate_ros_messages as ros;

/// Decoder of message values: CDR with schemas of ROS 2 (`ros2msg`), and JSON.
/// Values of Slate's own messages have the fields of the interface, without unused ones. It counts the messages that it
/// can't read.
#[derive(Debug, Default)]
pub struct Decoder {
    /// Schemas by channel, so that a definition is read once.
    schemas: SortedMap<u16, Result<ros::Schema, String>>,
    /// Unread messages by topic.
    unread: SortedMap<String, Unread>,
    /// The longest message that is read, bytes; nothing for any.
    longest: Option<usize>,
}

/// Messages of a topic that can't be read as values.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Unread {
    /// The topic.
    pub topic: String,
    /// Number of messages.
    pub messages: u64,
    /// The log time of the first one, nanoseconds.
    pub time: u64,
    /// Reason.
    pub why: String,
}

impl fmt::Display for Unread {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { topic, messages, time, why } = self;
        let time = seconds(*time);
        match messages {
            1 => write!(f, "the message of `{topic}` at {time} s can't be read: {why}"),
            _ => write!(f, "{messages} messages of `{topic}` can't be read, the first at {time} s: {why}"),
        }
    }
}

/// Value of a message.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A message of ROS.
    Message(ros::Value),
    /// JSON.
    Json(serde_json::Value),
    /// Bytes that can't be read, and why.
    Unread {
        /// Number of bytes.
        bytes: usize,
        /// Reason.
        why: String,
    },
}

impl Decoder {
    /// Creates a decoder of messages of at most `longest` bytes.
    /// A value takes several times the memory of its bytes.
    pub fn up_to(longest: usize) -> Self {
        Self { longest: Some(longest), ..Self::default() }
    }

    /// Reads the value of a message of the one file that this decoder is for.
    pub fn decode(&mut self, message: &Message) -> Value {
        let length = message.data.len();
        let read = match message.channel.message_encoding.as_str() {
            _ if self.longest.is_some_and(|longest| length > longest) => {
                Err(format!("it has {length} bytes, and {} are the most", self.longest.unwrap_or_default()))
            }
            "json" => {
                serde_json::from_slice(message.data).map(Value::Json).map_err(|error| error.to_string())
            }
            _ => self.schema(message).and_then(|schema| {
                schema.decode(message.data).map(Value::Message).map_err(|error| error.to_string())
            }),
        };
        read.unwrap_or_else(|why| {
            self.note(message, &why);
            Value::Unread { bytes: message.data.len(), why }
        })
    }

    /// Decodes as [`decode`](Self::decode), with names for enumeration numbers.
    pub fn decode_named(&mut self, message: &Message) -> Value {
        let mut value = self.decode(message);
        if let (Value::Message(value), Some(Ok(schema))) = (&mut value, self.schemas.get(&message.channel.id))
        {
            schema.name_constants(value);
        }
        value
    }

    /// Returns true if the value of a message can be read; notes it if not.
    pub fn check(&mut self, message: &Message) -> bool {
        let read = match message.channel.message_encoding.as_str() {
            "json" => serde_json::from_slice::<serde::de::IgnoredAny>(message.data)
                .map(drop)
                .map_err(|error| error.to_string()),
            _ => self
                .schema(message)
                .and_then(|schema| schema.check(message.data).map_err(|error| error.to_string())),
        };
        if let Err(why) = &read {
            self.note(message, why);
        }
        read.is_ok()
    }

    fn schema(&mut self, message: &Message) -> Result<&ros::Schema, String> {
        match message.channel.message_encoding.as_str() {
            "cdr" => {
                let schema = self.schemas.entry(message.channel.id).or_insert_with(|| schema(message));
                schema.as_ref().map_err(String::clone)
            }
            other => Err(format!("messages that are encoded as `{other}` are not read")),
        }
    }

    fn note(&mut self, message: &Message, why: &str) {
        let topic = &message.channel.topic;
        match self.unread.get_mut(topic) {
            Some(unread) => unread.messages += 1,
            None => {
                let (time, why) = (message.log_time, why.to_owned());
                let unread = Unread { topic: topic.clone(), messages: 1, time, why };
                self.unread.insert(topic.clone(), unread);
            }
        }
    }

    /// Messages that could not be decoded so far, by topic.
    pub fn into_unread(self) -> Vec<Unread> {
        self.unread.into_values().collect()
    }
}

fn schema(message: &Message) -> Result<ros::Schema, String> {
    let schema = message.schema.ok_or("its channel has no schema")?;
    if schema.encoding != "ros2msg" {
        return Err(format!("schemas that are encoded as `{}` are not read", schema.encoding));
    }
    let text = std::str::from_utf8(&schema.data).map_err(|_| "its definition is not UTF-8")?;
    ros::Schema::parse_shown(&schema.name, text).map_err(|error| error.to_string())
}

impl Value {
    /// Returns a number or boolean at a path such as `pose/position/x` or `ranges/3`.
    pub fn number(&self, path: &str) -> Option<f64> {
        match self {
            Self::Message(value) => {
                let value = value.at(path)?;
                value.as_f64().or_else(|| value.as_bool().map(|is| f64::from(u8::from(is))))
            }
            Self::Json(value) => {
                let value = value.pointer(&format!("/{path}"))?;
                value.as_f64().or_else(|| value.as_bool().map(|is| f64::from(u8::from(is))))
            }
            Self::Unread { .. } => None,
        }
    }

    /// Returns a pose in the plane: x and y in meters and the heading in radians.
    /// The value is a pose in the plane or in space, by itself or in an odometry or a stamped pose.
    pub fn pose(&self) -> Option<[f64; 3]> {
        for group in ["", "pose/"] {
            let [x, y, theta] = ["x", "y", "theta"].map(|name| self.number(&format!("{group}{name}")));
            if let (Some(x), Some(y), Some(theta)) = (x, y, theta) {
                // One that is unknown is not a number.
                return Some([x, y, theta]).filter(|pose| pose.iter().all(|number| number.is_finite()));
            }
        }
        ["pose/pose/", "pose/", ""].into_iter().find_map(|group| {
            let number = |name: &str| self.number(&format!("{group}{name}"));
            let (x, y) = (number("position/x")?, number("position/y")?);
            let [qx, qy, qz, qw] = ["x", "y", "z", "w"].map(|name| number(&format!("orientation/{name}")));
            let (qx, qy, qz, qw) = (qx?, qy?, qz?, qw?);
            let theta = libm::atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz));
            Some([x, y, theta])
        })
    }

    /// Returns the transform in a value, as a module publishes it.
    /// Missing parts are empty or 0.
    pub fn transform(&self) -> ros::PublishedTransform {
        let numbers = |group: &str, field: &str| self.number(&format!("{group}/{field}")).unwrap_or_default();
        ros::PublishedTransform {
            parent: self.text("parent").unwrap_or_default(),
            child: self.text("child").unwrap_or_default(),
            translation: ["x", "y", "z"].map(|field| numbers("translation", field)),
            rotation: ["x", "y", "z", "w"].map(|field| numbers("rotation", field)),
            is_fixed: self.number("fixed").is_some_and(|fixed| fixed != 0.0),
        }
    }

    /// Returns a text at a path.
    pub fn text(&self, path: &str) -> Option<String> {
        match self {
            Self::Message(value) => value.at(path)?.as_str().map(str::to_owned),
            Self::Json(value) => value.pointer(&format!("/{path}"))?.as_str().map(str::to_owned),
            Self::Unread { .. } => None,
        }
    }

    /// Returns the fields that are not messages themselves, with their paths, as text.
    /// A list is one field, or with `elements` as many as it has elements.
    pub fn fields(&self, elements: bool) -> Vec<(String, String)> {
        let mut fields = Vec::new();
        match self {
            Self::Message(value) => message_fields(value, "", elements, &mut fields),
            Self::Json(value) => json_fields(value, "", elements, &mut fields),
            Self::Unread { .. } => {}
        }
        fields
    }
}

fn below(path: &str, name: impl fmt::Display) -> String {
    if path.is_empty() { name.to_string() } else { format!("{path}/{name}") }
}

fn message_fields(value: &ros::Value, path: &str, elements: bool, fields: &mut Vec<(String, String)>) {
    match value {
        ros::Value::Map(map) => {
            for (name, value) in map.iter() {
                message_fields(value, &below(path, name), elements, fields);
            }
        }
        ros::Value::Numbers(numbers) if elements => {
            fields.extend(numbers.iter().enumerate().map(|(i, number)| (below(path, i), number.to_string())));
        }
        ros::Value::List(items) if elements => {
            for (i, item) in items.iter().enumerate() {
                message_fields(item, &below(path, i), elements, fields);
            }
        }
        ros::Value::Text(text) => fields.push((path.into(), text.to_string())),
        other => fields.push((path.into(), other.to_string())),
    }
}

fn json_fields(value: &serde_json::Value, path: &str, elements: bool, fields: &mut Vec<(String, String)>) {
    match value {
        serde_json::Value::Object(map) => {
            for (name, value) in map {
                json_fields(value, &below(path, name), elements, fields);
            }
        }
        serde_json::Value::Array(items) if elements => {
            for (i, item) in items.iter().enumerate() {
                json_fields(item, &below(path, i), elements, fields);
            }
        }
        serde_json::Value::String(text) => fields.push((path.into(), text.clone())),
        other => fields.push((path.into(), other.to_string())),
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Message(value) => value.fmt(f),
            Self::Json(value) => value.fmt(f),
            Self::Unread { bytes, why } => write!(f, "{bytes} bytes ({why})"),
        }
    }
}

/// Serialization: an undecodable value is null.
impl Serialize for Value {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Message(value) => value.serialize(serializer),
            Self::Json(value) => value.serialize(serializer),
            Self::Unread { .. } => serializer.serialize_none(),
        }
    }
}
