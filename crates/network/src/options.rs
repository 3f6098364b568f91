//! What a reader asks of the values that it receives; it is part of the key that it reads.

use std::fmt;

use slate_module::parse_duration;

/// How often values come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ReadRate {
    /// When the property changes, with at least this time between two values, ns.
    OnChange {
        /// Least interval, ns.
        interval: u64,
    },
    /// The newest value once in a period, ns, if it has changed.
    Every(u64),
}

/// Which values come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum ReadValues {
    /// The newest: one that is written before it could be sent takes the place of the one before.
    #[default]
    Newest,
    /// Each, in their order.
    All,
}

/// How values travel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum ReadMode {
    /// In their order, each sent until it arrives; the newest ones are dropped while a link is full.
    #[default]
    Usual,
    /// The origin also keeps the last ones, and sends those again that were dropped.
    Reliable,
    /// Each is sent once: as a datagram, where the link has them.
    BestEffort,
}

/// Options of one reader. Readers of a property with the same options share what is sent.
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
    /// How often values come.
    pub rate: ReadRate,
    /// Which values come.
    pub values: ReadValues,
    /// How they travel.
    pub mode: ReadMode,
}

/// What is sent to readers with the same options: the path of the property and these.
#[cfg(feature = "zenoh")]
pub type StreamName = (String, ReadOptions);

impl Default for ReadOptions {
    /// The newest value on each change.
    fn default() -> Self {
        Self {
            rate: ReadRate::OnChange { interval: 0 },
            values: ReadValues::default(),
            mode: ReadMode::default(),
        }
    }
}

/// Longest period or interval, ns: a day.
const LONGEST: u64 = 86_400_000_000_000;

impl ReadOptions {
    /// Options as they stand in a key, in this order and separated by commas: `all`, `reliable` or `best-effort`, `rate=…` or
    /// `interval=…`.
    ///
    /// # Errors
    /// What is wrong with them, in words.
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

    /// # Errors
    /// When options contradict each other.
    pub fn check(&self) -> Result<(), String> {
        if self.values == ReadValues::All && self.rate != Self::default().rate {
            return Err("with all values there is neither a rate nor an interval".into());
        }
        Ok(())
    }
}

/// A duration of more than nothing, ns.
pub fn duration(text: &str) -> Result<u64, String> {
    parse_duration(text)
        .filter(|duration| (1..=LONGEST).contains(duration))
        .ok_or_else(|| format!("`{text}` is no duration; expected one such as 100ms, up to 24 h"))
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
