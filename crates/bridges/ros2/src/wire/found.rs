//! What a tool sees of a domain.

/// A publisher or a subscription in a domain.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoundEndpoint {
    /// The node that has it, such as `/talker`; nothing if that is not announced.
    pub node: Option<String>,
    /// The type as ROS calls it.
    pub message: String,
    /// Hash of the type, if the node sends one: nodes of Slate don't over DDS.
    pub type_hash: Option<String>,
    /// `RELIABLE`; else `BEST_EFFORT`.
    pub reliable: bool,
    /// `TRANSIENT_LOCAL`; else `VOLATILE`.
    pub transient_local: bool,
}

/// A topic in a domain.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FoundTopic {
    /// Its publishers.
    pub publishers: Vec<FoundEndpoint>,
    /// Its subscriptions.
    pub subscriptions: Vec<FoundEndpoint>,
}
