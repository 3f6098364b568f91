//! Client of an agent for programs in C and C++.
//!
//! A program connects to an agent by its socket or its address, and reads, sets and watches properties, sends messages
//! and calls the operations of the HTTP API; values are JSON. `include/slate_client.h` is made from this crate.
#![allow(unsafe_code, reason = "C passes pointers")]

mod agent;
mod boundary;
mod error;
mod text;
mod watch;

pub use agent::SlateAgent;
pub use boundary::SlateSample;
pub use error::{SlateError, SlateErrorKind};
pub use watch::SlateWatch;
