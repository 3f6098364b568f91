//! Values as messages of ROS.

use slate_blackboard::interface::Descriptor;
use slate_record::ros::{self, Standard, standard};

use crate::name::type_name;

/// How values of an interface lie in messages: as those that ROS has for it, or else as those of recordings.
#[derive(Debug)]
pub struct RosMessage {
    descriptor: &'static Descriptor,
    standard: Option<Standard>,
    name: String,
}

impl RosMessage {
    /// The messages of an interface.
    pub fn of(descriptor: &'static Descriptor) -> Self {
        let standard = standard(descriptor);
        let name = match &standard {
            Some(standard) => standard.definition().name.clone(),
            None => ros::definition(descriptor).name,
        };
        Self { descriptor, standard, name }
    }

    /// The interface.
    pub fn descriptor(&self) -> &'static Descriptor {
        self.descriptor
    }

    /// The type as ROS calls it, such as `sensor_msgs/msg/LaserScan`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The type as DDS calls it.
    pub fn type_name(&self) -> String {
        type_name(&self.name)
    }

    /// Checks that messages have all fields of a value.
    ///
    /// # Errors
    /// The fields that they lack, in words.
    pub fn check_decodable(&self) -> Result<(), String> {
        self.standard.as_ref().map_or(Ok(()), Standard::check_decodable)
    }

    /// Appends the message of a value, with its header. `stamp` is its time, ns; `frame` its coordinate frame.
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
            None => ros::encode(self.descriptor, bytes, message),
        }
    }

    /// The value of a message with its header.
    ///
    /// # Errors
    /// When it is no such message, or the interface has no room for it.
    pub fn decode(&self, message: &[u8]) -> Result<Vec<u8>, ros::Error> {
        match &self.standard {
            Some(standard) => standard.decode(message),
            None => ros::decode(self.descriptor, message),
        }
    }
}
