//! What bridges on RustDDS share: messages of any type, matches of endpoints, and quality of service.

mod matches;
mod policies;
mod raw;

pub use matches::{MatchWords, Matches, OwnEndpoint, sent_type_hash};
pub use policies::policies;
pub use raw::{RawAdapter, RawDecoder, RawMessage};
