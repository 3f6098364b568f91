//! Options of a reader for the values that it receives.
//! They are part of the key that it reads.

use std::fmt;

use slate_module::parse_duration;

/// Rate of the values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ReadRate {
    /// Rate of the property's changes, with a minimum interval between values, ns.
    OnChange {
        /// Least interval, ns.
        interval: u64,
    },
    /// Newest value once in a period, ns, if it has changed.
    Every(u64),
}

/// Selection of the values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum ReadValues {
    /// Newest value; it replaces an earlier one that is not sent yet.
    #[default]
    Newest,
    /// Each, in their order.
    All,
}

/// Delivery mode of values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum ReadMode {
    /// Ordered and retransmitted; the newest values are dropped while a link is full.
    #[default]
    Usual,
    /// Reliable delivery: the origin keeps the last values, and resends lost ones.
    Reliable,
    /// Each is sent once: as a datagram, where the link has them.
    BestEffort,
}

/// Options of one reader.
/// Readers of a property with the same options share a stream.
///
/// ```
/// use slate_network::{ReadOptions, ReadRate};
///
/// let options = ReadOptions::parse("rate=100ms")?;
/// assert_eq!(options.rate, ReadRate::Every(100_000_000));
/// assert_eq!(options.to_string(), "rate=100ms");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ReadOptions {
    /// Rate of the values.
    pub rate: ReadRate,
    /// Selection of the values.
    pub values: ReadValues,
    /// Delivery mode.
    pub mode: ReadMode,
}

/// Stream to readers with the same options: path of the property and options.
#[cfg(feature = "zenoh")]
pub type StreamName = (String, ReadOptions);

impl Default for ReadOptions {
    /// Returns the options for the newest value on each change.
    fn default() -> Self {
        Self {
            rate: ReadRate::OnChange { interval: 0 },
            values: ReadValues::default(),
            mode: ReadMode::default(),
        }
    }
}

/// Longest period or interval, ns: a day.
const MAX_DURATION: u64 = 86_400_000_000_000;

impl ReadOptions {
    /// Parses options as they appear in a key, in this order, separated by commas.
    /// They are `all`, `reliable` or `best-effort`, `rate=…` or `interval=…`.
    ///
    /// # Errors
    /// Reason why they are invalid, in words.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut options = Self::default();
        for option in text.split(',') {
            match option.split_once('=') {
                None if option == "all" => options.values = ReadValues::All,
                None if option == "reliable" => options.mode = ReadMode::Reliable,
                None if option == "best-effort" => options.mode = ReadMode::BestEffort,
                Some(("rate", period)) => options.rate = ReadRate::Every(duration(period)?),
                Some(("interval", interval)) => {
                    options.rate = ReadRate::OnChange { interval: duration(interval)? };
                }
                _ => {
                    return Err(format!(
                        "unknown option `{option}`; expected all, reliable, best-effort, rate=100ms or interval=50ms"
                    ));
                }
            }
        }
        options.check()?;
        // One text for the same options, so that readers share a key.
        if options.to_string() == text { Ok(options) } else { Err(format!("write `{options}`")) }
    }

    /// Checks that options do not contradict each other.
    ///
    /// # Errors
    /// When options contradict each other.
    pub fn check(&self) -> Result<(), String> {
        if self.values == ReadValues::All && self.rate != Self::default().rate {
            return Err("with all values there is neither a rate nor an interval".into());
        }
        Ok(())
    }
}

/// Parses a positive duration, ns.
pub fn duration(text: &str) -> Result<u64, String> {
    parse_duration(text)
        .filter(|duration| (1..=MAX_DURATION).contains(duration))
        .ok_or_else(|| format!("`{text}` is not a duration; expected one such as 100ms, up to 24 h"))
}

impl fmt::Display for ReadOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (name, time) = match self.rate {
            ReadRate::OnChange { interval } => ("interval", interval),
            ReadRate::Every(period) => ("rate", period),
        };
        let units = [("s", 1_000_000_000), ("ms", 1_000_000), ("us", 1_000), ("ns", 1)];
        let (unit, length) = units.into_iter().find(|(_, length)| time % length == 0).unwrap_or(("ns", 1));
        let mode = match self.mode {
            ReadMode::Usual => None,
            ReadMode::Reliable => Some("reliable".to_owned()),
            ReadMode::BestEffort => Some("best-effort".to_owned()),
        };
        let parts = [
            (self.values == ReadValues::All).then(|| "all".to_owned()),
            mode,
            (time > 0).then(|| format!("{name}={}{unit}", time / length)),
        ];
        let parts: Vec<_> = parts.into_iter().flatten().collect();
        f.write_str(&parts.join(","))
    }
}
