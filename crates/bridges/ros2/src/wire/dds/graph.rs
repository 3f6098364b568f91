//! Announcement of the agent's node to ROS's tools.
//! It is `rmw_dds_common/msg/ParticipantEntitiesInfo`.

use rustdds::GUID;

use crate::name::NodeName;
use slate_dds::wire::RawMessage;

/// Topic, which has no prefix.
pub const TOPIC: &str = "ros_discovery_info";

/// Message.
pub const MESSAGE: &str = "rmw_dds_common/msg/ParticipantEntitiesInfo";

/// Returns the message of a participant with one node, as in ROS 2 from Iron on.
pub fn entities(participant: GUID, node: &NodeName, readers: &[GUID], writers: &[GUID]) -> RawMessage {
    let mut message = GraphMessage(vec![0, 1, 0, 0]);
    message.0.extend(participant.to_bytes());
    message.count(1);
    message.text(&node.namespace);
    message.text(&node.name);
    for guids in [readers, writers] {
        message.count(guids.len());
        guids.iter().for_each(|guid| message.0.extend(guid.to_bytes()));
    }
    RawMessage(message.0)
}

/// Message in little-endian CDR.
/// Its header has as many bytes as the largest alignment in it.
struct GraphMessage(Vec<u8>);

impl GraphMessage {
    fn count(&mut self, count: usize) {
        self.0.resize(self.0.len().next_multiple_of(4), 0);
        self.0.extend((count as u32).to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.count(text.len() + 1);
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }
}
