//! All tests of the crate, in one program: each program costs link time.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

#[cfg(feature = "lua")]
mod behavior_plan;
mod behavior_tree_plan;
mod common;
mod conditions;
mod golog_plan;
mod manager;
mod petri_net_plan;
#[cfg(feature = "lua")]
mod skill_view;
mod team;
mod tree_view;
mod view;
