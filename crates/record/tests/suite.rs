//! All tests of the crate that share a process, in one program: each program costs link time.

mod bag;
#[cfg(feature = "external-tools")]
mod bag_others;
mod batch;
mod beside;
mod common;
#[path = "logs/main.rs"]
mod logs;
mod page;
mod plots;
#[cfg(feature = "external-tools")]
mod python;
#[path = "recorder/main.rs"]
mod recorder;
#[path = "replay/main.rs"]
mod replay;
mod report;
#[path = "ros/main.rs"]
mod ros;
mod trajectory;
