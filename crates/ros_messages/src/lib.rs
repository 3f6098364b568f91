//! Values as messages of ROS 2 and ROS 1 ([`WireFormat`]): definitions, and CDR.
//! With them logs and networks work with other tools.
//!
//! A value has two forms.
//!
//! - [`definition`], [`encode`] and [`decode`]: any interface as a message of its own, field by field and without a loss. A
//!   decoded value has the bits of the encoded one.
//! - [`standard`]: the message that ROS already has for it, such as `sensor_msgs/msg/LaserScan`, for the tools that know how to
//!   draw it.
//!
//! [`Shown`] are messages of the first form without fields for the layout alone, for readers.
//!
//! A [`Schema`] reads messages that came from elsewhere, and [`Described`] makes values of the blackboard from them.
//!
//! ```
//! use slate_blackboard::interface::{Descriptor, Field, Kind, schema_hash};
//! use slate_ros_messages as ros;
//!
//! const FIELDS: &[Field] = &[Field { name: "voltage", doc: "Under load.", unit: "V", offset: 0, kind: Kind::F64 }];
//! static BATTERY: Descriptor = Descriptor {
//!     name: "Battery", doc: "A battery.", ros: "sensor_msgs/msg/BatteryState",
//!     fields: FIELDS, size: 8, align: 8, hash: schema_hash("Battery", FIELDS),
//! };
//!
//! let mut message = Vec::new();
//! ros::encode(&BATTERY, &12.5_f64.to_ne_bytes(), &mut message)?;
//! assert_eq!(ros::decode(&BATTERY, &message)?, 12.5_f64.to_ne_bytes());
//!
//! let definition = ros::definition(&BATTERY);
//! assert_eq!(definition.name, "slate_msgs/msg/Battery");
//! let schema = ros::Schema::parse(&definition.name, &definition.text)?;
//! assert_eq!(schema.decode(&message)?.get("voltage").and_then(|value| value.as_f64()), Some(12.5));
//! # Ok::<(), ros::Error>(())
//! ```

mod cdr;
mod codec;
mod constants;
mod defined;
mod definition;
mod described;
mod encode;
mod error;
mod files;
mod followed;
mod frames;
mod names;
mod schema;
mod shown;
mod standard;
mod type_description;
mod value;

pub use cdr::CdrWriter;
pub use cdr::WireFormat;
pub use codec::{decode, decode_in, encode, encode_in};
pub use defined::{DefinedConstant, DefinedCount, DefinedField, DefinedItem, DefinedMessage};
pub use definition::SEPARATOR;
pub use definition::{Definition, definition, definition_in, definition_named};
pub use described::Described;
pub use encode::{encode_json, encode_json_in};
pub use error::Error;
pub use files::{DefinitionFiles, FileError};
pub use followed::Followed;
pub use frames::{
    FrameTransform, Frames, PublishedTransform, encode_transforms, encode_transforms_in,
    transforms_definition, transforms_definition_in,
};
pub use schema::Schema;
pub use shown::Shown;
pub use slate_blackboard::interface::Primitive;
pub use standard::{Standard, message_definition, standard, standard_in};
pub use type_description::type_description;
use value::RosPrimitive;
pub use value::{Map, Numbers, Value};
