//! Quality of service of a topic.

use slate_runtime::configuration::Table;
use slate_topics::{TableReader, TopicOptions};

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
    /// Returns ROS's default: reliable, volatile, the last ten values.
    fn default() -> Self {
        Self { reliable: true, transient_local: false, depth: 10 }
    }
}

impl TopicOptions for TopicQuality {
    const READ_KEYS: &'static [&'static str] = &["reliable", "transient_local", "depth"];
    const WRITE_KEYS: &'static [&'static str] = Self::READ_KEYS;
    const CAN_WAIT: bool = true;

    fn read(reader: &mut TableReader<'_>, table: &Table) -> Self {
        let usual = Self::default();
        Self {
            reliable: table.get("reliable").is_none() || reader.flag(table, "reliable"),
            transient_local: reader.flag(table, "transient_local"),
            depth: reader.depth(table).unwrap_or(usual.depth),
        }
    }
}

/// Data representation of values in messages (DDS-XTypes 1.3, 7.4).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Representation {
    /// Version 1, the default of DDS.
    #[default]
    Xcdr1,
    /// Version 2.
    Xcdr2,
}
