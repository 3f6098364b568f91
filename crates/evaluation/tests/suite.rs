//! Tests of evaluations.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

mod barn;
mod exploration;
mod localization;
mod movingai;
mod mrclam;
mod slam;
