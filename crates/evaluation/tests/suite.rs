//! Tests of evaluations.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

mod movingai;
mod slam;
