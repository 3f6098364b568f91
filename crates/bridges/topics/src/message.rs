//! Values as messages of ROS.

use slate_blackboard::interface::Descriptor;
use slate_ros_messages as ros;
use slate_ros_messages::{
    Definition, DefinitionFiles, FileError, Standard, WireFormat, definition_in, standard_in,
};

use crate::type_hash::type_hash;

/// Message format of an interface's values.
/// The type that ROS has for it, or else `slate_msgs/msg/NAME`.
#[derive(Debug)]
pub struct RosMessage {
    format: WireFormat,
    descriptor: &'static Descriptor,
    standard: Option<Standard>,
    definition: Definition,
}

impl RosMessage {
    /// Creates the messages of an interface in the ROS of a format.
    pub fn new(format: WireFormat, descriptor: &'static Descriptor) -> Self {
        let standard = standard_in(format, descriptor);
        let definition = match &standard {
            Some(standard) => standard.definition().clone(),
            None => definition_in(format, descriptor),
        };
        Self { format, descriptor, standard, definition }
    }

    /// Creates the messages of an interface from definition files.
    ///
    /// # Errors
    /// A field does not fit, or none does.
    pub fn defined(
        format: WireFormat,
        descriptor: &'static Descriptor,
        files: &DefinitionFiles,
    ) -> Result<Self, FileError> {
        let standard = files.standard(descriptor)?;
        let definition = standard.definition().clone();
        Ok(Self { format, descriptor, standard: Some(standard), definition })
    }

    /// Returns the type in ROS, such as `sensor_msgs/msg/LaserScan`.
    /// In ROS 1 `sensor_msgs/LaserScan`.
    pub fn name(&self) -> &str {
        &self.definition.name
    }

    /// Returns its fields, followed by the messages in it.
    pub fn definition(&self) -> &str {
        &self.definition.text
    }

    /// Returns the hash by which ROS 2 nodes compare its type.
    pub fn type_hash(&self) -> Option<String> {
        type_hash(&self.definition).ok()
    }

    /// Checks that messages have all fields of a value.
    ///
    /// # Errors
    /// The fields that they lack, in words.
    pub fn check_decodable(&self) -> Result<(), String> {
        self.standard.as_ref().map_or(Ok(()), Standard::check_decodable)
    }

    /// Appends the message of a value.
    /// `stamp` is its time, ns; `frame` its coordinate frame.
    ///
    /// # Errors
    /// The bytes are not value of the interface.
    pub fn encode(
        &self,
        bytes: &[u8],
        stamp: u64,
        frame: &str,
        message: &mut Vec<u8>,
    ) -> Result<(), ros::Error> {
        match &self.standard {
            Some(standard) => standard.encode(bytes, stamp, frame, message),
            None => ros::encode_in(self.format, self.descriptor, bytes, message),
        }
    }

    /// Decodes the value of a message.
    ///
    /// # Errors
    /// It is no such message, or the interface has no room for it.
    pub fn decode(&self, message: &[u8]) -> Result<Vec<u8>, ros::Error> {
        match &self.standard {
            Some(standard) => standard.decode(message),
            None => ros::decode_in(self.format, self.descriptor, message),
        }
    }
}
