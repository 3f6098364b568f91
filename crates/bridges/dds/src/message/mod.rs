//! Values as messages of DDS.

mod decode;
mod encode;
mod map;
mod xcdr;

use std::sync::Arc;

use slate_blackboard::interface::{Descriptor, Kind};
use slate_ros_messages::WireFormat;
use slate_topics::RosMessage;

use crate::idl::IdlStruct;
use crate::quality::Representation;
use crate::topic_type::TopicType;
use map::{StructMapper, TypeMap};
pub(crate) use xcdr::HEADER;
use xcdr::{Encapsulation, XcdrReader, XcdrWriter};

/// Message format of an interface's values: a struct of IDL, or ROS's message.
#[derive(Debug)]
pub enum DdsMessage {
    /// Message that ROS has for the interface.
    Ros {
        /// Message.
        message: RosMessage,
        /// Name of the topic's type.
        type_name: String,
    },
    /// Struct of IDL.
    Idl(IdlMessage),
}

impl DdsMessage {
    /// Returns the messages of an interface on a topic of a type.
    /// Without a type, of the one that ROS 2 gives the interface.
    ///
    /// # Errors
    /// A member of the struct and the field of its name have types that don't fit, in words.
    pub fn of(descriptor: &'static Descriptor, of: Option<&TopicType>) -> Result<Self, String> {
        let message = RosMessage::new(WireFormat::Cdr, descriptor);
        match of {
            None => Ok(Self::Ros { type_name: ros_type_name(message.name()), message }),
            Some(TopicType { name, structure: None, .. }) => {
                Ok(Self::Ros { type_name: name.clone(), message })
            }
            Some(TopicType { structure: Some(own), representation, .. }) => {
                IdlMessage::of(descriptor, own, *representation).map(Self::Idl)
            }
        }
    }

    /// Returns the name of the topic's type.
    pub fn type_name(&self) -> &str {
        match self {
            Self::Ros { type_name, .. } => type_name,
            Self::Idl(own) => &own.structure.name,
        }
    }

    /// Returns whether a key distinguishes instances.
    pub fn has_key(&self) -> bool {
        matches!(self, Self::Idl(own) if own.structure.has_key())
    }

    /// Representations of messages that it reads.
    pub fn readable(&self) -> &'static [Representation] {
        match self {
            Self::Ros { .. } => &[Representation::Xcdr1],
            Self::Idl(_) => &[Representation::Xcdr1, Representation::Xcdr2],
        }
    }

    /// Returns the number of its encoding, for the header of a message.
    pub fn identifier(&self) -> u8 {
        match self {
            Self::Ros { .. } => 1,
            Self::Idl(own) => own.encapsulation.identifier(),
        }
    }

    /// Checks that messages have all fields of a value.
    ///
    /// # Errors
    /// The fields that they lack, in words.
    pub fn check_decodable(&self) -> Result<(), String> {
        match self {
            Self::Ros { message, .. } => message.check_decodable(),
            Self::Idl(own) => own.check_decodable(),
        }
    }

    /// Checks that messages tell something of a value.
    ///
    /// # Errors
    /// They have none of its fields, in words.
    pub fn check_encodable(&self) -> Result<(), String> {
        match self {
            Self::Ros { .. } => Ok(()),
            Self::Idl(own) => own.check_encodable(),
        }
    }

    /// Appends the message of a value, with its header.
    /// `stamp` is its time, ns, and `frame` its coordinate frame, for messages of ROS.
    ///
    /// # Errors
    /// The value does not fit, in words.
    pub fn encode(&self, bytes: &[u8], stamp: u64, frame: &str, out: &mut Vec<u8>) -> Result<(), String> {
        match self {
            Self::Ros { message, .. } => {
                message.encode(bytes, stamp, frame, out).map_err(|error| error.to_string())
            }
            Self::Idl(own) => own.encode(bytes, out),
        }
    }

    /// Decodes the value of a message with its header.
    ///
    /// # Errors
    /// It is no such message, or the interface has no room for it, in words.
    pub fn decode(&self, message: &[u8]) -> Result<Vec<u8>, String> {
        match self {
            Self::Ros { message: own, .. } => own.decode(message).map_err(|error| error.to_string()),
            Self::Idl(own) => own.decode(message),
        }
    }
}

/// Returns the DDS type that ROS 2 gives a message.
/// `sensor_msgs/msg/LaserScan` is `sensor_msgs::msg::dds_::LaserScan_`.
pub fn ros_type_name(message: &str) -> String {
    match message.rsplit_once('/') {
        Some((package, name)) => format!("{}::dds_::{name}_", package.replace('/', "::")),
        None => message.into(),
    }
}

/// Interface's values as a struct of IDL, whose members are the fields by name.
#[derive(Debug)]
pub struct IdlMessage {
    descriptor: &'static Descriptor,
    structure: Arc<IdlStruct>,
    map: TypeMap,
    encapsulation: Encapsulation,
    missing: Vec<String>,
    /// Fields that both have.
    common: usize,
}

impl IdlMessage {
    /// Creates the messages of an interface as a struct.
    ///
    /// # Errors
    /// A member and the field of its name have types that don't fit, in words.
    pub fn of(
        descriptor: &'static Descriptor,
        structure: &Arc<IdlStruct>,
        representation: Representation,
    ) -> Result<Self, String> {
        let mut mapper = StructMapper { own: structure, descriptor, missing: Vec::new(), common: 0 };
        let map = mapper.map()?;
        let is_second = representation == Representation::Xcdr2;
        let is_delimited = is_second && structure.is_appendable == Some(true);
        Ok(Self {
            descriptor,
            structure: Arc::clone(structure),
            map,
            encapsulation: Encapsulation { is_second, is_little: true, is_delimited },
            missing: mapper.missing,
            common: mapper.common,
        })
    }

    fn check_decodable(&self) -> Result<(), String> {
        if self.missing.is_empty() {
            return Ok(());
        }
        let (missing, interface) = (self.missing.join(", "), self.descriptor.name);
        Err(format!("{} has no member {missing}, as {interface} has", self.shown()))
    }

    fn check_encodable(&self) -> Result<(), String> {
        if self.common > 0 {
            return Ok(());
        }
        let names: Vec<_> = self.descriptor.fields.iter().map(|field| field.name).collect();
        let interface = self.descriptor.name;
        Err(format!("{} has no member of a field of {interface}: {}", self.shown(), names.join(", ")))
    }

    fn shown(&self) -> String {
        format!("{} ({})", self.structure.name, self.structure.place)
    }

    /// Appends the message of a value, with its header.
    ///
    /// # Errors
    /// The value does not fit, in words.
    pub fn encode(&self, bytes: &[u8], out: &mut Vec<u8>) -> Result<(), String> {
        let item = self.descriptor.tail().map_or(0, Kind::size);
        let is_value = match bytes.len().checked_sub(self.descriptor.size) {
            Some(0) => true,
            Some(tail) => item > 0 && tail % item == 0,
            None => false,
        };
        if !is_value {
            return Err(format!("{} bytes are no {}", bytes.len(), self.descriptor.name));
        }
        let (fixed, tail) = bytes.split_at(self.descriptor.size);
        let start = out.len();
        let written = self.map.write(&mut XcdrWriter::new(out, self.encapsulation), Some(fixed), tail);
        written.inspect_err(|_| out.truncate(start))
    }

    /// Decodes the value of a message with its header.
    ///
    /// # Errors
    /// It is no such message, or the interface has no room for it, in words.
    pub fn decode(&self, message: &[u8]) -> Result<Vec<u8>, String> {
        let mut reader = XcdrReader::new(message)?;
        let Encapsulation { is_second, is_delimited, .. } = reader.encapsulation;
        if let Some(is_appendable) = self.structure.is_appendable
            && is_second
            && is_appendable != is_delimited
        {
            let (here, there) = if is_delimited { ("final", "appendable") } else { ("appendable", "final") };
            return Err(format!("its type is @{there}, and @{here} in {}", self.structure.place));
        }
        let (mut value, mut tail) = (vec![0; self.descriptor.size], Vec::new());
        self.map.read(&mut reader, Some(&mut value), &mut tail)?;
        // Padding at the end is not part of it.
        if reader.left() >= HEADER && self.structure.is_appendable != Some(true) {
            return Err(format!("{} bytes are left over: it is another type", reader.left()));
        }
        value.extend(tail);
        Ok(value)
    }
}
