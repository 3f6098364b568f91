//! Recordings that are played, and modules that run on them.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

mod editions;
mod external;
mod files;
mod flight;
mod order;
mod orders;
mod places;
mod playback;
mod recompute;
mod repaired;
mod support;
