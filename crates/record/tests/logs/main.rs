//! Logs of other systems: what is read of them, what is refused, and what is written as one.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that fails panics")]

#[cfg(feature = "external-tools")]
mod bblogger;
mod carmen;
mod files;
mod openrdk;
#[cfg(feature = "external-tools")]
use crate::python;
#[cfg(feature = "external-tools")]
mod ros;
#[cfg(feature = "external-tools")]
mod rosbag;
