//! Agents that share over TLS.
#![cfg(feature = "tls")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that fails panics")]
#![allow(clippy::module_inception, reason = "its certificates are beside it, in a folder of its name")]

use crate::agents;
#[path = "exchange/mod.rs"]
mod tls;

use agents::Folder;

/// The folder of a test of the module of that name.
fn folder(_: &str) -> Folder {
    Folder::over_tls()
}
