//! Tests of the crate.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]
