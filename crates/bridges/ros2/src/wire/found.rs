//! Nodes and topics of a domain, as a tool sees them.

/// Publisher or a subscription in a domain.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoundEndpoint {
    /// Node that has it, such as `/talker`; `None` if that is not announced.
    pub node: Option<String>,
    /// Type in ROS.
    pub message: String,
    /// Hash of the type, if the node sends one: nodes of Slate don't over DDS.
    pub type_hash: Option<String>,
    /// `RELIABLE`; else `BEST_EFFORT`.
    pub reliable: bool,
    /// `TRANSIENT_LOCAL`; else `VOLATILE`.
    pub transient_local: bool,
}

/// Topic in a domain.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FoundTopic {
    /// Publishers.
    pub publishers: Vec<FoundEndpoint>,
    /// Subscriptions.
    pub subscriptions: Vec<FoundEndpoint>,
}
