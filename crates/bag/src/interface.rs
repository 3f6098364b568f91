//! Interface of a channel's messages.

use slate_blackboard::interface::Descriptor;
use slate_sorted::SortedMap;

use super::Message;
use slate_ros_messages as ros;

/// Returns the interface of a message's values, if its schema is a known one.
pub fn interface(
    message: &Message<'_>,
    known: &SortedMap<u64, &'static Descriptor>,
) -> Option<&'static Descriptor> {
    if let Some(hash) = message.channel.metadata.get("hash") {
        return known.get(&u64::from_str_radix(hash, 16).ok()?).copied();
    }
    // Other tools leave out what only Slate says.
    let schema = message.schema?;
    known.values().copied().find(|descriptor| {
        let definition = ros::definition(descriptor);
        definition.name == schema.name && definition.text.as_bytes() == &*schema.data
    })
}
