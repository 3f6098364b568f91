//! Agents that share over the transports of Zenoh.
#![cfg(all(feature = "tls", feature = "zenoh"))]
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]
#![allow(clippy::duplicate_mod, reason = "each protocol has to do the same")]

use crate::agents;
#[path = "exchange/mod.rs"]
mod tcp;
#[path = "exchange/mod.rs"]
mod udp;

use agents::Folder;

/// The folder of a test of the module of that name.
fn folder(module: &'static str) -> Folder {
    Folder::over(module.rsplit("::").next().unwrap())
}
