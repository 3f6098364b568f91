//! Tests of Golog.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

mod analysis;
mod common;
mod concurrency;
mod errors;
mod execution;
mod search;
mod solutions;
mod state;
