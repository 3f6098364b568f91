use std::io::{self, ErrorKind};
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::time::Duration;

use rustix::event::PollFlags;

use super::Credentials;
use super::link::TlsLink;
use crate::carrier::{CarrierError, Link, Listener, wait_ready};

/// Listener at one address.
#[derive(Debug)]
pub(super) struct TlsListener {
    socket: TcpListener,
    credentials: Credentials,
}

impl TlsListener {
    pub fn new(endpoint: &str, address: SocketAddr, credentials: Credentials) -> Result<Self, CarrierError> {
        let listen = || {
            let socket = TcpListener::bind(address)?;
            socket.set_nonblocking(true)?;
            Ok(socket)
        };
        let socket = listen().map_err(|error: io::Error| match error.kind() {
            ErrorKind::AddrInUse => CarrierError::InUse { endpoint: endpoint.into(), process: None },
            _ => CarrierError::System { endpoint: endpoint.into(), error },
        })?;
        Ok(Self { socket, credentials })
    }
}

impl Listener for TlsListener {
    fn accept(&self, limit: Duration) -> io::Result<Option<Arc<dyn Link>>> {
        if wait_ready(&self.socket, PollFlags::IN, limit)?.is_empty() {
            return Ok(None);
        }
        let gone = [ErrorKind::WouldBlock, ErrorKind::ConnectionAborted, ErrorKind::Interrupted];
        match self.socket.accept() {
            // The handshake authenticates it later, in a thread of its own.
            Ok((socket, from)) => {
                let link = TlsLink::accepted(socket, from, self.credentials.clone())?;
                Ok(Some(Arc::new(link)))
            }
            Err(error) if gone.contains(&error.kind()) => Ok(None),
            Err(error) => Err(error),
        }
    }
}
