//! Carrier between agents of one machine.
//! It uses a Unix socket that preserves packets, and shared memory for large values.
//!
//! Endpoints are `local:NAME`, which is `$XDG_RUNTIME_DIR/slate/NAME.share`, and `local:/a/path`. Only the user that runs
//! an agent reaches it.

mod address;
mod link;
mod memory;

use std::io;
use std::os::fd::OwnedFd;
use std::sync::Arc;
use std::time::Duration;

use rustix::event::PollFlags;
use rustix::io::Errno;
use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType};

use super::{Carrier, CarrierError, Link, Listener, wait_ready};
use address::LocalAddress;
use link::LocalLink;

/// Largest number of links that wait to be accepted.
const BACKLOG: i32 = 64;

/// Carrier between agents of one user on one machine.
#[derive(Clone, Copy, Debug, Default)]
pub struct Local;

impl Carrier for Local {
    fn listen(&self, endpoint: &str) -> Result<Box<dyn Listener>, CarrierError> {
        let place = LocalAddress::take(endpoint)?;
        let socket = socket(SocketFlags::NONBLOCK).map_err(|error| system(endpoint, error))?;
        // The socket's file gets these rights when it is made, so it never has others.
        let owner = rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR;
        let bound = rustix::fs::fchmod(&socket, owner)
            .and_then(|()| SocketAddrUnix::new(place.path()))
            .and_then(|address| rustix::net::bind(&socket, &address))
            .and_then(|()| rustix::net::listen(&socket, BACKLOG));
        bound.map_err(|error| system(endpoint, error))?;
        Ok(Box::new(LocalListener { socket, _place: place }))
    }

    fn check(&self, endpoint: &str) -> Result<(), CarrierError> {
        address::path(endpoint).map(drop)
    }

    fn dial(&self, endpoint: &str) -> Result<Arc<dyn Link>, CarrierError> {
        let path = address::path(endpoint)?;
        // If it did wait, an agent that accepts no connection would block this one.
        let socket = socket(SocketFlags::NONBLOCK).map_err(|error| system(endpoint, error))?;
        let address = SocketAddrUnix::new(&path).map_err(|error| system(endpoint, error))?;
        match rustix::net::connect(&socket, &address) {
            Ok(()) => {}
            Err(Errno::NOENT | Errno::CONNREFUSED | Errno::AGAIN) => {
                return Err(CarrierError::Nobody { endpoint: endpoint.into() });
            }
            Err(error) => return Err(system(endpoint, error)),
        }
        check_user(&socket, endpoint)?;
        let link = LocalLink::new(socket).map_err(|error| system(endpoint, error))?;
        Ok(Arc::new(link))
    }
}

fn socket(flags: SocketFlags) -> rustix::io::Result<OwnedFd> {
    rustix::net::socket_with(AddressFamily::UNIX, SocketType::SEQPACKET, SocketFlags::CLOEXEC | flags, None)
}

fn system(endpoint: &str, error: Errno) -> CarrierError {
    CarrierError::System { endpoint: endpoint.into(), error: error.into() }
}

/// Checks that the process at the other end belongs to this user.
fn check_user(socket: &OwnedFd, endpoint: &str) -> Result<(), CarrierError> {
    let other = rustix::net::sockopt::socket_peercred(socket).map_err(|error| system(endpoint, error))?.uid;
    let own = rustix::process::geteuid();
    if other == own {
        return Ok(());
    }
    let reason = format!("an agent of user {} is there, not of user {}", other.as_raw(), own.as_raw());
    Err(CarrierError::Unsafe { endpoint: endpoint.into(), reason })
}

/// Listener at a named socket, which it removes at its end.
#[derive(Debug)]
struct LocalListener {
    socket: OwnedFd,
    _place: LocalAddress,
}

impl Listener for LocalListener {
    fn accept(&self, limit: Duration) -> io::Result<Option<Arc<dyn Link>>> {
        if wait_ready(&self.socket, PollFlags::IN, limit)?.is_empty() {
            return Ok(None);
        }
        match rustix::net::accept_with(&self.socket, SocketFlags::CLOEXEC) {
            Ok(socket) if check_user(&socket, "").is_ok() => Ok(Some(Arc::new(LocalLink::new(socket)?))),
            // It has gone again, or is not an agent of this user.
            Ok(_) | Err(Errno::AGAIN | Errno::CONNABORTED | Errno::INTR) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }
}
