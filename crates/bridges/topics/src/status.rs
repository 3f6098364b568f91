/// Status of an agent's topic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TopicStatus {
    /// Name in the middleware.
    pub topic: String,
    /// Type of its messages, such as `sensor_msgs/msg/LaserScan`.
    pub message: String,
    /// Path of the property.
    pub property: String,
    /// Direction: true if the agent reads it.
    pub is_read: bool,
    /// Number of connected publishers or subscriptions.
    /// `None` where the middleware does not report it.
    pub others: Option<usize>,
    /// Values that were set or sent.
    pub count: u64,
    /// Messages that did not fit.
    pub refused: u64,
    /// Values that were replaced by newer ones before they were set or sent.
    pub dropped: u64,
    /// Reason why the last message did not fit; `None` if it did.
    pub error: Option<String>,
}
