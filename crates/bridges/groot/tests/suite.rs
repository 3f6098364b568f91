//! The tests of this crate, in one program.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]
#![allow(clippy::disallowed_methods, reason = "sockets go by the machine's clock")]
#![allow(missing_docs, reason = "the interfaces here are read by nobody")]

mod agent;
mod client;
mod hostile;
mod requests;
mod settings;
