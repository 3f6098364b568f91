//! A running agent and its HTTP clients.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and the wall clock is what some are about"
)]

mod agent;
mod attacks;
mod client;
#[cfg(feature = "external-tools")]
mod foxglove;
mod leases;
mod modules;
#[cfg(feature = "external-tools")]
mod openapi;
mod pages;
mod playback;
mod reading;
mod recordings;
mod remote;
mod sockets;
#[cfg(feature = "tls")]
mod tls;
mod writing;
