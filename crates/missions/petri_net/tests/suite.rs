//! Tests of the crate.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

mod analysis;
mod common;
mod execution;
mod generator;
mod labels;
mod pnml;
mod reference;
mod reload;
mod sub_plans;
mod team;
