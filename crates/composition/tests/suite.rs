//! All tests of the crate, in one program.
#![allow(clippy::unwrap_used, clippy::panic, missing_docs, reason = "a test that fails panics")]

mod checked;
mod devices;
mod hardware;
mod inference;
mod order;
mod robot;
mod rules;
