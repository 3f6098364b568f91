//! Writers of topics that have the values of properties.

use std::sync::Arc;

use rustdds::{GUID, RTPSEntity};
use slate_topics::TopicSink;

use crate::participant::TopicWriter;
use slate_dds::wire::Matches;
use slate_dds::wire::RawMessage;

/// The writer of a topic.
pub struct WriterSink {
    pub writer: TopicWriter,
    /// Whether later subscriptions receive values, too.
    pub is_transient_local: bool,
    pub matches: Arc<Matches>,
}

impl WriterSink {
    pub fn guid(&self) -> GUID {
        self.writer.guid()
    }
}

impl TopicSink for WriterSink {
    fn is_wanted(&self) -> bool {
        self.is_transient_local || self.matches.count(self.guid()) > 0
    }

    fn send(&self, message: Vec<u8>) -> Result<(), String> {
        self.writer.write(RawMessage(message), None).map_err(|error| error.to_string())
    }
}
