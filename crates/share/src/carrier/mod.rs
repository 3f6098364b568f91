//! Interface of carriers, which transport packets between agents.
//!
//! A carrier parses endpoints, listens at them and dials them; a link transports packets. It may lose, double and
//! reorder them. Sessions handle that, so a carrier needs no knowledge of properties.

#[cfg(feature = "tls")]
mod address;
pub mod local;
#[cfg(feature = "tls")]
pub mod tls;

use std::fmt;
use std::io;
use std::os::fd::AsFd;
use std::sync::Arc;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;

use slate_blackboard::channel::LentBytes;

/// Transport between agents.
pub trait Carrier: fmt::Debug + Send + Sync {
    /// Listens at an endpoint while the returned listener exists.
    ///
    /// # Errors
    /// If the endpoint is malformed, in use, or unavailable.
    fn listen(&self, endpoint: &str) -> Result<Box<dyn Listener>, CarrierError>;

    /// Checks that an endpoint can be dialed, without a connection.
    ///
    /// # Errors
    /// If the endpoint is malformed, or always refused.
    fn check(&self, endpoint: &str) -> Result<(), CarrierError> {
        let _ = endpoint;
        Ok(())
    }

    /// Opens a link to an endpoint, without a long wait for the answer.
    ///
    /// # Errors
    /// If the endpoint is malformed, or no agent answers.
    fn dial(&self, endpoint: &str) -> Result<Arc<dyn Link>, CarrierError>;
}

/// Listener for incoming links.
pub trait Listener: fmt::Debug + Send {
    /// Returns the next link; `None` if none came within `limit`.
    ///
    /// # Errors
    /// If no more links will come.
    fn accept(&self, limit: Duration) -> io::Result<Option<Arc<dyn Link>>>;
}

/// Packet link between two agents; one thread sends while another one receives.
pub trait Link: fmt::Debug + Send + Sync {
    /// Sends a packet without waiting; false when there is no room for it now.
    ///
    /// # Errors
    /// When the link is closed, from either side.
    fn send(&self, packet: &[u8]) -> io::Result<bool>;

    /// Waits until a packet can be sent, at most for `limit`.
    ///
    /// # Errors
    /// When the link is closed, from either side.
    fn wait_for_room(&self, limit: Duration) -> io::Result<()>;

    /// Waits for a packet, at most for `limit`; returns its length, bytes.
    /// `None` if no packet came.
    ///
    /// # Errors
    /// If the link is closed, from either side. `PermissionDenied` with the reason if the other end is refused.
    fn receive(&self, packet: &mut [u8], limit: Duration) -> io::Result<Option<usize>>;

    /// Returns the size of the largest packet, bytes.
    fn largest(&self) -> usize;

    /// Returns the authenticated name of the agent at the other end.
    /// `None` without authentication, and before the first packet.
    fn authenticated(&self) -> Option<&str> {
        None
    }

    /// Returns the machine at the other end, if it may be another one.
    fn origin(&self) -> Option<String> {
        None
    }

    /// Closes the link; waiting calls return.
    fn close(&self);

    /// Returns the memory shared by both agents, if any.
    fn memory(&self) -> Option<&dyn SharedMemory> {
        None
    }
}

/// Memory shared by both ends of a link, for values that would fill many packets.
pub trait SharedMemory: Send + Sync {
    /// Stores a value and appends a reference to it for the other end.
    /// Returns false if the memory is full.
    fn place(&self, bytes: &[u8], reference: &mut Vec<u8>) -> bool;

    /// Passes the value of the other end's reference to `take`, and frees its slot.
    /// Returns false for an invalid reference.
    fn read(&self, reference: &[u8], length: usize, take: &mut dyn FnMut(&[u8])) -> bool;

    /// Lends the value of the other end's reference; dropping the loan frees its slot.
    /// `None` for an invalid reference, or if too many values are lent; then the value can still be
    /// [read](SharedMemory::read). The value is followed by zeros up to its alignment.
    ///
    /// The other end could still change it, so only such values may be lent in which every bit pattern is valid.
    fn lend(&self, reference: &[u8], length: usize) -> Option<Box<dyn LentBytes>> {
        let _ = (reference, length);
        None
    }
}

/// Returns the first successful result over some addresses, else the last error.
#[cfg(feature = "tls")]
fn first_success<T>(
    addresses: &[std::net::SocketAddr],
    endpoint: &str,
    mut call: impl FnMut(std::net::SocketAddr) -> Result<T, CarrierError>,
) -> Result<T, CarrierError> {
    let mut last = CarrierError::Nobody { endpoint: endpoint.into() };
    for address in addresses {
        match call(*address) {
            Ok(found) => return Ok(found),
            Err(error) => last = error,
        }
    }
    Err(last)
}

/// Waits until a file is ready; returns no flags if it is not within `limit`.
fn wait_ready(file: &impl AsFd, events: PollFlags, limit: Duration) -> io::Result<PollFlags> {
    let limit = Timespec { tv_sec: limit.as_secs() as i64, tv_nsec: i64::from(limit.subsec_nanos()) };
    let mut files = [PollFd::new(file, events)];
    match poll(&mut files, Some(&limit)) {
        Ok(0) | Err(Errno::INTR) => Ok(PollFlags::empty()),
        Ok(_) => Ok(files[0].revents()),
        Err(error) => Err(error.into()),
    }
}

/// Error of an endpoint.
#[derive(Debug, thiserror::Error)]
pub enum CarrierError {
    /// Malformed endpoint.
    #[error("`{endpoint}` is not an endpoint: {expected}")]
    NoEndpoint {
        /// Endpoint as given.
        endpoint: String,
        /// Expected form of an endpoint.
        expected: &'static str,
    },
    /// Endpoint at which another process listens.
    #[error("endpoint `{endpoint}` is in use by another {}: stop that one, or listen at another endpoint", owner(*.process))]
    InUse {
        /// The endpoint.
        endpoint: String,
        /// Process of the other agent, if known.
        process: Option<u32>,
    },
    /// Endpoint without a listener.
    #[error("no agent listens at `{endpoint}`")]
    Nobody {
        /// The endpoint.
        endpoint: String,
    },
    /// Endpoint that other users could reach, or that belongs to one.
    #[error("endpoint `{endpoint}`: {reason}")]
    Unsafe {
        /// The endpoint.
        endpoint: String,
        /// Reason.
        reason: String,
    },
    /// Refusal by the operating system.
    #[error("endpoint `{endpoint}`: {error}")]
    System {
        /// The endpoint.
        endpoint: String,
        /// Error of the operating system.
        error: io::Error,
    },
}

fn owner(process: Option<u32>) -> String {
    process.map_or_else(|| "program".into(), |process| format!("agent, process {process}"))
}

impl CarrierError {
    /// Returns the rejected endpoint.
    pub fn endpoint(&self) -> &str {
        match self {
            Self::NoEndpoint { endpoint, .. }
            | Self::InUse { endpoint, .. }
            | Self::Nobody { endpoint }
            | Self::Unsafe { endpoint, .. }
            | Self::System { endpoint, .. } => endpoint,
        }
    }
}
