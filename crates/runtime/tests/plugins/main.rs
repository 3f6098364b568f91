//! Plugins as shared libraries: loaded, unloaded and reloaded while an agent runs, and every way in which that can go
//! wrong.
#![allow(
    unsafe_code,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and wall-clock time is what some are about"
)]

mod damage;
mod dependencies;
mod errors;
mod faults;
mod fixtures;
mod hangs;
mod loading;
mod memory;
mod native;
mod refusals;
mod reload;
mod shadow;
mod shadow_faults;
mod snapshot;
mod support;
#[path = "../common/trace.rs"]
mod trace;
