//! The seam to whatever carries packets from agent to agent.
//!
//! A carrier knows what its endpoints look like, listens at them and dials them; a link carries packets. It may lose,
//! double and reorder them. Sessions do the rest, so a carrier has nothing to know of properties.

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

/// A way from agent to agent.
pub trait Carrier: fmt::Debug + Send + Sync {
    /// Listens at an endpoint, for as long as what is returned lives.
    ///
    /// # Errors
    /// When the endpoint makes no sense, is in use, or can't be had.
    fn listen(&self, endpoint: &str) -> Result<Box<dyn Listener>, CarrierError>;

    /// Whether an endpoint can be dialled, as far as that can be told before; nobody is asked.
    ///
    /// # Errors
    /// When the endpoint makes no sense, or is refused whoever is there.
    fn check(&self, endpoint: &str) -> Result<(), CarrierError> {
        let _ = endpoint;
        Ok(())
    }

    /// Begins a link to an endpoint; it does not wait long for an answer.
    ///
    /// # Errors
    /// When the endpoint makes no sense, or nobody answers.
    fn dial(&self, endpoint: &str) -> Result<Arc<dyn Link>, CarrierError>;
}

/// Hears of links that others begin.
pub trait Listener: fmt::Debug + Send {
    /// The next link; nothing when none came within `limit`.
    ///
    /// # Errors
    /// When no more will come.
    fn accept(&self, limit: Duration) -> io::Result<Option<Arc<dyn Link>>>;
}

/// Carries packets between two agents. One thread sends while another one receives.
pub trait Link: fmt::Debug + Send + Sync {
    /// Sends a packet without waiting; false when there is no room for it now.
    ///
    /// # Errors
    /// When the link is closed, from either side.
    fn send(&self, packet: &[u8]) -> io::Result<bool>;

    /// Waits for room, at most for `limit`.
    ///
    /// # Errors
    /// When the link is closed, from either side.
    fn wait_for_room(&self, limit: Duration) -> io::Result<()>;

    /// Waits for a packet, at most for `limit`; how many bytes of `packet` it takes, nothing when none came.
    ///
    /// # Errors
    /// When the link is closed, from either side. When the other end is not let in, `PermissionDenied` with the reason.
    fn receive(&self, packet: &mut [u8], limit: Duration) -> io::Result<Option<usize>>;

    /// The largest packet that is carried, bytes.
    fn largest(&self) -> usize;

    /// The agent at the other end, where something proves that it is that one: then it is no other. It is known when a
    /// packet has come.
    fn authenticated(&self) -> Option<&str> {
        None
    }

    /// The machine at the other end, where it may be another one.
    fn origin(&self) -> Option<String> {
        None
    }

    /// Ends the link: whoever waits for it goes on.
    fn close(&self);

    /// Memory that both agents see, where there is such memory.
    fn memory(&self) -> Option<&dyn SharedMemory> {
        None
    }
}

/// Memory that both ends of a link see, for values that would fill many packets.
pub trait SharedMemory: Send + Sync {
    /// Puts a value there, and appends a reference to it for the other end; false when there is no room now.
    fn place(&self, bytes: &[u8], reference: &mut Vec<u8>) -> bool;

    /// Hands the value that the other end's reference means to `take`, and gives its place back; false when there is no
    /// such value.
    fn read(&self, reference: &[u8], length: usize, take: &mut dyn FnMut(&[u8])) -> bool;

    /// Lends the value that the other end's reference means, and gives its place back when that is dropped; nothing when
    /// there is no such value, or too many are lent already: then it is there to be [read](SharedMemory::read). Behind
    /// the value, up to what its alignment rounds it up to, it has zeros.
    ///
    /// The other end could still change it, so only such values may be lent in which every bit pattern is valid.
    fn lend(&self, reference: &[u8], length: usize) -> Option<Box<dyn LentBytes>> {
        let _ = (reference, length);
        None
    }
}

/// What comes of the first of some addresses that works; else what came of the last.
#[cfg(feature = "tls")]
fn first_of<T>(
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

/// Waits until a file is ready; for nothing when it is not within `limit`.
fn ready(file: &impl AsFd, for_what: PollFlags, limit: Duration) -> io::Result<PollFlags> {
    let limit = Timespec { tv_sec: limit.as_secs() as i64, tv_nsec: i64::from(limit.subsec_nanos()) };
    let mut files = [PollFd::new(file, for_what)];
    match poll(&mut files, Some(&limit)) {
        Ok(0) | Err(Errno::INTR) => Ok(PollFlags::empty()),
        Ok(_) => Ok(files[0].revents()),
        Err(error) => Err(error.into()),
    }
}

/// Why an endpoint is of no use.
#[derive(Debug, thiserror::Error)]
pub enum CarrierError {
    /// It can't be read.
    #[error("`{endpoint}` is no endpoint: {expected}")]
    NoEndpoint {
        /// What was given.
        endpoint: String,
        /// What one looks like.
        expected: &'static str,
    },
    /// Somebody listens there.
    #[error("endpoint `{endpoint}` is in use by another {}: stop that one, or listen at another endpoint", owner(*.process))]
    InUse {
        /// Which.
        endpoint: String,
        /// The process of the other agent, where that is known.
        process: Option<u32>,
    },
    /// Nobody listens there.
    #[error("no agent listens at `{endpoint}`")]
    Nobody {
        /// Which.
        endpoint: String,
    },
    /// Other users could reach it, or it belongs to one.
    #[error("endpoint `{endpoint}`: {reason}")]
    Unsafe {
        /// Which.
        endpoint: String,
        /// What is wrong.
        reason: String,
    },
    /// The system refuses.
    #[error("endpoint `{endpoint}`: {error}")]
    System {
        /// Which.
        endpoint: String,
        /// What the system says.
        error: io::Error,
    },
}

fn owner(process: Option<u32>) -> String {
    process.map_or_else(|| "program".into(), |process| format!("agent, process {process}"))
}

impl CarrierError {
    /// The endpoint that is of no use.
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
