use std::net::SocketAddr;
use std::os::fd::OwnedFd;

use rustix::net::{SocketType, getpeername, getsockname, sockopt};
use rustix::process::{PidfdFlags, PidfdGetfdFlags, getpid, pidfd_getfd, pidfd_open};
use zenoh_link::Link as Wire;
use zenoh_protocol::core::Locator;

/// Lets the socket of a link go at once when Zenoh closes it, whoever has not read what was sent.
///
/// Zenoh asks for ten seconds of linger: as long the system may hold the thread that closes the socket of an agent that
/// has fallen silent, and that thread serves all links of this process. Zenoh hands out no sockets, so this looks for
/// the one of the two addresses. Where the system does not allow that, it stays as it is.
pub(super) fn forbid(wire: &Wire) {
    if wire.is_streamed
        && let Some(socket) = find(wire)
    {
        // As above.
        let _ = sockopt::set_socket_linger(&socket, None);
    }
}

fn find(wire: &Wire) -> Option<OwnedFd> {
    let (own, other) = (address(&wire.src)?, address(&wire.dst)?);
    let process = pidfd_open(getpid(), PidfdFlags::empty()).ok()?;
    std::fs::read_dir("/proc/self/fd").ok()?.find_map(|entry| {
        let number = entry.ok()?.file_name().to_str()?.parse().ok()?;
        // Another handle of what that is by now; if it is another one, its addresses differ.
        let socket = pidfd_getfd(&process, number, PidfdGetfdFlags::empty()).ok()?;
        let same = sockopt::socket_type(&socket) == Ok(SocketType::STREAM)
            && getsockname(&socket).ok().and_then(|name| SocketAddr::try_from(name).ok()) == Some(own)
            && getpeername(&socket).ok().flatten().and_then(|name| SocketAddr::try_from(name).ok())
                == Some(other);
        same.then_some(socket)
    })
}

fn address(locator: &Locator) -> Option<SocketAddr> {
    locator.address().as_str().parse().ok()
}
