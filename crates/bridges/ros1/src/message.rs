//! Values as messages of ROS 1.

use slate_blackboard::interface::Descriptor;
use slate_record::ros::{self, Definition, Standard, WireFormat, definition_in, standard_in};

/// How values of an interface lie in messages: as those that ROS has for it, or else as `slate_msgs/NAME`.
#[derive(Debug)]
pub struct Ros1Message {
    descriptor: &'static Descriptor,
    standard: Option<Standard>,
    definition: Definition,
}

impl Ros1Message {
    /// The messages of an interface.
    pub fn of(descriptor: &'static Descriptor) -> Self {
        let standard = standard_in(WireFormat::Ros1, descriptor);
        let definition = match &standard {
            Some(standard) => standard.definition().clone(),
            None => definition_in(WireFormat::Ros1, descriptor),
        };
        Self { descriptor, standard, definition }
    }

    /// The interface.
    pub fn descriptor(&self) -> &'static Descriptor {
        self.descriptor
    }

    /// The type as ROS calls it, such as `sensor_msgs/LaserScan`.
    pub fn name(&self) -> &str {
        &self.definition.name
    }

    /// Its fields, followed by the messages in it.
    pub fn definition(&self) -> &str {
        &self.definition.text
    }

    /// Checks that messages have all fields of a value.
    ///
    /// # Errors
    /// The fields that they lack, in words.
    pub fn check_decodable(&self) -> Result<(), String> {
        self.standard.as_ref().map_or(Ok(()), Standard::check_decodable)
    }

    /// Appends the message of a value. `stamp` is its time, ns; `frame` its coordinate frame.
    ///
    /// # Errors
    /// When the bytes are no value of the interface.
    pub fn encode(
        &self,
        bytes: &[u8],
        stamp: u64,
        frame: &str,
        message: &mut Vec<u8>,
    ) -> Result<(), ros::Error> {
        match &self.standard {
            Some(standard) => standard.encode(bytes, stamp, frame, message),
            None => ros::encode_in(WireFormat::Ros1, self.descriptor, bytes, message),
        }
    }

    /// The value of a message.
    ///
    /// # Errors
    /// When it is no such message, or the interface has no room for it.
    pub fn decode(&self, message: &[u8]) -> Result<Vec<u8>, ros::Error> {
        match &self.standard {
            Some(standard) => standard.decode(message),
            None => ros::decode_in(WireFormat::Ros1, self.descriptor, message),
        }
    }
}
