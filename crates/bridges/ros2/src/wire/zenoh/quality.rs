//! Quality of service in liveliness tokens.

use slate_dds::TopicQuality;

/// Depth that `rmw_zenoh` has where nothing is said.
const DEPTH: u16 = 42;

/// QoS values as `rmw` numbers them.
/// `RELIABLE` and `BEST_EFFORT`, `TRANSIENT_LOCAL` and `VOLATILE`.
const BEST_EFFORT: &str = "2";
const TRANSIENT_LOCAL: &str = "1";

/// Encodes a quality of service as text.
/// The defaults of `rmw_zenoh` are left out: reliable, volatile, the last 42 values, no deadline, no lifespan,
/// automatic liveliness.
pub fn encode(quality: TopicQuality) -> String {
    let reliability = if quality.reliable { "" } else { BEST_EFFORT };
    let durability = if quality.transient_local { TRANSIENT_LOCAL } else { "" };
    let depth = if quality.depth == DEPTH { String::new() } else { quality.depth.to_string() };
    format!("{reliability}:{durability}:,{depth}:,:,:,,")
}

/// Parses a quality of service; `None` if the text is invalid.
pub fn decode(text: &str) -> Option<TopicQuality> {
    let parts: Vec<_> = text.split(':').collect();
    let [reliability, durability, history, ..] = parts[..] else { return None };
    let (_, depth) = history.split_once(',')?;
    let depth = if depth.is_empty() { DEPTH.into() } else { depth.parse::<u64>().ok()? };
    Some(TopicQuality {
        reliable: reliability != BEST_EFFORT,
        transient_local: durability == TRANSIENT_LOCAL,
        depth: u16::try_from(depth).unwrap_or(u16::MAX),
    })
}
