//! Tests of the crate.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

mod analysis;
mod common;
mod conditions;
mod control;
mod decorators;
mod errors;
mod includes;
mod monitor;
mod scripts;
mod state;
mod sub_trees;
mod updates;
