//! Snapshots: an agent continues from one as if nothing had happened, or is left as it was.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;
mod damage;
mod layers;
mod messages;
mod refusals;
mod same;
mod support;
mod threads;
mod trigger;
