//! Links that come and go, and the files and threads that they leave in their process, in which nothing else may
//! run meanwhile.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

#[path = "../agents/mod.rs"]
mod agents;
#[cfg(feature = "tls")]
mod network;

fn main() {
    #[cfg(feature = "tls")]
    network::run(std::env::args().nth(1).filter(|argument| !argument.starts_with('-')).as_deref());
}
