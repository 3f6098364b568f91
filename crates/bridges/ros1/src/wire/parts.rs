use std::sync::Arc;

use super::publication::TopicPublication;
use super::service::RosrpcServer;
use super::subscription::TopicSubscription;

/// Topics and services of a node.
#[derive(Default)]
pub struct NodeParts {
    pub publications: Vec<Arc<TopicPublication>>,
    pub subscriptions: Vec<Arc<TopicSubscription>>,
    pub services: Vec<RosrpcServer>,
    /// Presence of parameters.
    pub has_parameters: bool,
}

impl NodeParts {
    /// Returns whether the master knows the node by any of its parts.
    pub fn are_registered(&self) -> bool {
        self.has_parameters
            || !(self.publications.is_empty() && self.subscriptions.is_empty() && self.services.is_empty())
    }
}
