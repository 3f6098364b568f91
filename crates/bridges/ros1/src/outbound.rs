//! Publications of topics that have the values of properties.

use std::sync::Arc;

use slate_topics::TopicSink;

use crate::wire::TopicPublication;

/// Publication of a topic.
pub struct PublicationSink(pub Arc<TopicPublication>);

impl TopicSink for PublicationSink {
    fn is_wanted(&self) -> bool {
        self.0.is_wanted()
    }

    fn send(&self, message: Vec<u8>) -> Result<(), String> {
        self.0.publish(&message)
    }
}
