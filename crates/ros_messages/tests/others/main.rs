//! Messages that other programs read: `cargo test -p slate-ros-messages --features slate-test-tools/external-tools`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that fails panics")]
#![allow(missing_docs, reason = "the interfaces here are read by nobody")]

#[path = "../ros/interfaces.rs"]
mod interfaces;
mod messages;
mod python;
