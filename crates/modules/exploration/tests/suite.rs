//! Tests of exploration.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

mod exploration;
mod explorer;
