//! Links: what they may join, what becomes of the values on the way, and how they change while the agent runs.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and some wait for threads on the wall clock"
)]

use crate::common;
mod blocks;
mod conversion;
mod demands;
mod external;
mod inferred;
mod lateness;
mod model;
mod padding;
mod queues;
mod relinking;
mod required;
mod support;
mod threads;
mod writers;
