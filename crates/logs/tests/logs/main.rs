//! Logs of other systems: what is read of them, what is refused, and what is written as one.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that fails panics")]

mod carmen;
mod files;
mod openrdk;
