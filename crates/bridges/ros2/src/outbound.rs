//! Writers of topics that have the values of properties.

use std::sync::Arc;

use slate_topics::TopicSink;

use crate::wire::TopicWriter;

/// Writer of a topic.
pub struct WriterSink {
    pub writer: Arc<dyn TopicWriter>,
    /// Transient-local durability: later subscriptions receive values, too.
    pub is_transient_local: bool,
}

impl TopicSink for WriterSink {
    fn is_wanted(&self) -> bool {
        self.is_transient_local || self.writer.has_receivers()
    }

    fn send(&self, message: Vec<u8>) -> Result<(), String> {
        self.writer.write(message)
    }
}
