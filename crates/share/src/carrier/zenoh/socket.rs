//! The socket of a stream, which Zenoh does not hand out.
#![allow(unsafe_code, reason = "a file is looked at by its number, here and nowhere else in this crate")]

use std::io;
use std::net::SocketAddr;
use std::os::fd::{BorrowedFd, OwnedFd};
use std::time::Duration;

use rustix::event::PollFlags;
use rustix::io::fcntl_dupfd_cloexec;
use rustix::net::{SocketType, getpeername, getsockname, sockopt};
use zenoh_link::Link as Wire;
use zenoh_protocol::core::Locator;

use crate::carrier::ready;

/// What the system is asked to keep of what the other end has not taken, bytes; it may allow less.
const ROOM: usize = 512 << 10;

/// Another handle of a stream's socket. It tells whether there is room, so that a thread that sends never waits; and it
/// lets the socket go at once when it is closed.
///
/// For Zenoh asks for ten seconds of linger: as long the system would hold the thread that closes the socket of an agent
/// that has fallen silent, and that thread serves all links of this process.
#[derive(Debug)]
pub(super) struct Socket(OwnedFd);

impl Socket {
    /// Looks for the socket between the two addresses of a stream.
    pub fn of(wire: &Wire) -> io::Result<Self> {
        let address = |locator: &Locator| locator.address().as_str().parse::<SocketAddr>();
        let (Ok(own), Ok(other)) = (address(&wire.src), address(&wire.dst)) else {
            return Err(io::Error::other(format!("{wire} is no stream")));
        };
        for entry in std::fs::read_dir("/proc/self/fd")? {
            let Some(number) = entry?.file_name().to_str().and_then(|name| name.parse().ok()) else {
                continue;
            };
            if let Some(socket) = duplicate(number)
                && is_between(&socket, own, other)
            {
                sockopt::set_socket_linger(&socket, None)?;
                sockopt::set_socket_send_buffer_size(&socket, ROOM)?;
                return Ok(Self(socket));
            }
        }
        Err(io::Error::other(format!("{wire} is closed")))
    }

    /// The largest packet that there is room for whenever the system says that there is room.
    pub fn largest(&self) -> usize {
        // It says so when a third is free, and counts some memory beside the bytes.
        sockopt::socket_send_buffer_size(&self.0).unwrap_or_default() / 6
    }

    /// Waits for room, at most for `limit`; whether there is some.
    pub fn wait_for_room(&self, limit: Duration) -> io::Result<bool> {
        Ok(!ready(&self.0, PollFlags::OUT, limit)?.is_empty())
    }
}

fn duplicate(number: i32) -> Option<OwnedFd> {
    if number < 0 {
        return None;
    }
    // SAFETY: it is used for this one call. Whoever owns that file may close it meanwhile, and then this fails, or finds
    // another file, of which a second handle harms nobody.
    let file = unsafe { BorrowedFd::borrow_raw(number) };
    fcntl_dupfd_cloexec(file, 0).ok()
}

fn is_between(socket: &OwnedFd, own: SocketAddr, other: SocketAddr) -> bool {
    sockopt::socket_type(socket) == Ok(SocketType::STREAM)
        && getsockname(socket).ok().and_then(|name| SocketAddr::try_from(name).ok()) == Some(own)
        && getpeername(socket).ok().flatten().and_then(|name| SocketAddr::try_from(name).ok()) == Some(other)
}
