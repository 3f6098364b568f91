//! The tests of this crate, in one program.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]
#![allow(missing_docs, reason = "the interfaces here are read by nobody")]

mod dds;
