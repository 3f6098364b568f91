/// How a topic of an agent stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TopicStatus {
    /// As the others call it.
    pub topic: String,
    /// Type of its messages, such as `sensor_msgs/msg/LaserScan`.
    pub message: String,
    /// Path of the property.
    pub property: String,
    /// Whether the agent reads it.
    pub is_read: bool,
    /// Publishers or subscriptions that it is connected with; nothing where the middleware does not say.
    pub others: Option<usize>,
    /// Values that were set or sent.
    pub count: u64,
    /// Messages that did not fit.
    pub refused: u64,
    /// Values that were replaced by newer ones before they were set or sent.
    pub dropped: u64,
    /// Why the last message did not fit; nothing when it did.
    pub error: Option<String>,
}
