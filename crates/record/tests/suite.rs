//! All tests of the crate that share a process, in one program: each program costs link time.

mod bag;
mod batch;
mod beside;
mod common;
#[path = "logs/main.rs"]
mod logs;
mod page;
mod plots;
#[path = "recorder/main.rs"]
mod recorder;
#[path = "replay/main.rs"]
mod replay;
mod report;
#[path = "ros/main.rs"]
mod ros;
mod trajectory;
