//! Common parts of the bridges on RustDDS.
//! Messages of any type, matches of endpoints, quality of service, and discovery.

mod discovery_probe;
mod matches;
mod policies;
mod raw;

pub use discovery_probe::DiscoveryProbe;
pub use matches::{MatchWords, Matches, OwnEndpoint, sent_type_hash};
pub use policies::policies;
pub use raw::{RawAdapter, RawDecoder, RawMessage};
