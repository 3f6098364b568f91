//! A descriptor in reserve, so that a stop comes through when no other is left.

use std::fs::File;
use std::net::SocketAddr;
use std::time::Duration;

use tokio::net::{TcpListener, TcpStream};

/// How long a connection may last that has the reserve. A stop takes some milliseconds.
pub(crate) const BRIEF: Duration = Duration::from_secs(1);

/// A descriptor that is given up for one brief connection at a time when the process has no other for it.
pub(crate) struct Reserve(Option<File>);

impl Reserve {
    /// Takes a descriptor. Without one now there is none in reserve either.
    pub fn new() -> Self {
        Self(File::open("/dev/null").ok())
    }

    /// Accepts the next connection with the reserve; nothing without one, or when nobody waits.
    pub async fn accept(&mut self, listener: &TcpListener) -> Option<(TcpStream, SocketAddr)> {
        drop(self.0.take()?);
        // Who was refused a moment ago still waits.
        let accepted = tokio::time::timeout(BRIEF, listener.accept()).await;
        accepted.ok()?.ok()
    }

    /// Takes a descriptor again, as soon as there is one.
    pub fn refill(&mut self) {
        if self.0.is_none() {
            *self = Self::new();
        }
    }
}
