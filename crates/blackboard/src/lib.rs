//! The robot's knowledge: properties with one writer and many readers.
//! Values are the newest one or queues of the last ones; messages go to the writer.
//!
//! A [`Channel`] carries the values of one property. Its writer never waits for a reader, a reader never waits for the
//! writer, and a preempted thread blocks no other one. Steady state allocates nothing. The crate starts no thread, does
//! no input or output and reads no clock: the host passes the time.
#![allow(unsafe_code, reason = "the lock-free core lives here and nowhere else")]

mod board;
pub mod bytes;
pub mod channel;
pub mod commit;
pub mod interface;
pub mod message;
mod nearest;
mod shape;
mod stamp;
mod sync;
mod url;
pub mod wake;

pub use board::{
    Access, AddressEntry, AddressSpace, Board, BoardError, Carrier, Event, Observer, Pattern, PatternError,
    Placement, Property, Setter, SettingsCounter, Store, Taps, Watch, Watchers, Watching,
};
pub use channel::Channel;
pub use nearest::{nearest_names, nearest_paths};
pub use shape::Shape;
pub use stamp::Stamp;
pub use url::{Url, UrlError, is_within};
