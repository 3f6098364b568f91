use std::sync::Arc;

use slate_blackboard::Property;
use slate_topics::InboundTopic;

use crate::settings::SCHEME;

/// Inputs that the bridge fills, by place.
#[derive(Default)]
pub struct InputList {
    pub topics: Vec<InboundTopic>,
    /// Sources of their values.
    pub sources: Vec<(Arc<Property>, String)>,
}

impl InputList {
    /// Adds an input that a topic or service fills, and returns its place.
    /// `depth` of its values may wait.
    pub fn add(
        &mut self,
        input: &str,
        property: Arc<Property>,
        (topic, message): (&str, &str),
        depth: u16,
    ) -> usize {
        self.topics.push(InboundTopic::new(topic, message, input, &property, depth.into()));
        self.add_source(property, topic);
        self.topics.len() - 1
    }

    /// Adds a port that something of ROS fills.
    pub fn add_source(&mut self, property: Arc<Property>, name: &str) {
        self.sources.push((property, format!("{SCHEME}:{name}")));
    }
}
