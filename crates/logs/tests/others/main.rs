//! Files that other programs write and read: `cargo test -p slate-logs --features slate-test-tools/external-tools`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that fails panics")]
#![allow(missing_docs, reason = "the interfaces here are read by nobody")]

mod bags;
mod bblogger;
#[path = "../logs/files.rs"]
mod files;
mod python;
mod ros_logs;
mod rosbag;
