//! Agents that share over TLS.
#![cfg(feature = "tls")]
#![allow(clippy::unwrap_used, reason = "a test ends at the first surprise")]

use crate::agents;
#[path = "exchange/mod.rs"]
mod tls;

use agents::Folder;

/// The folder of a test of the module of that name.
fn folder(module: &'static str) -> Folder {
    Folder::over(module.rsplit("::").next().unwrap())
}
