//! All tests of the crate, in one program: each program costs link time.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

mod common;

mod analysis;
mod errors;
mod interfaces;
mod limits;
mod machines;
mod sandbox;
mod skills;
mod state;
