//! Quality of service of a topic.

/// Quality of service of a topic, as its file says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TopicQuality {
    /// `RELIABLE`; else `BEST_EFFORT`.
    pub reliable: bool,
    /// `TRANSIENT_LOCAL`: late readers receive the last values; else `VOLATILE`.
    pub transient_local: bool,
    /// Values that are kept.
    pub depth: u16,
}

impl Default for TopicQuality {
    /// ROS's own default: reliable, volatile, the last ten.
    fn default() -> Self {
        Self { reliable: true, transient_local: false, depth: 10 }
    }
}
