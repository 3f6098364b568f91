use std::fmt;
use std::io::{self, ErrorKind};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use rustix::event::PollFlags;
use rustix::net::sockopt::set_socket_send_buffer_size;

use super::connection::{MAX_PACKET_SIZE, TlsConnection};
use super::{CONNECT_TIMEOUT, Credentials};
use crate::carrier::{CarrierError, Link, wait_ready};

/// Requested size of the send buffer, bytes; the system may allow less.
const SEND_BUFFER_SIZE: usize = 512 << 10;

/// Link to one agent.
pub(super) struct TlsLink {
    socket: TcpStream,
    other: SocketAddr,
    state: Mutex<TlsLinkState>,
    agent: OnceLock<String>,
}

/// State that both threads of a link use.
/// Each holds it for as long as it takes to encrypt a packet.
enum TlsLinkState {
    /// Accepted connection before its handshake.
    Accepted(Credentials),
    Open(Box<TlsConnection>),
    Closed(ErrorKind, String),
}

impl fmt::Debug for TlsLink {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TlsLink").field("socket", &self.socket).finish_non_exhaustive()
    }
}

fn set_up(socket: &TcpStream) -> io::Result<()> {
    socket.set_nonblocking(true)?;
    socket.set_nodelay(true)?;
    Ok(set_socket_send_buffer_size(socket, SEND_BUFFER_SIZE)?)
}

/// Returns a function for the time left until `limit` from now.
#[allow(clippy::disallowed_methods, reason = "the host limits the wait for a network")]
fn timer(limit: Duration) -> impl Fn() -> Duration {
    let start = Instant::now();
    move || limit.saturating_sub(start.elapsed())
}

impl TlsLink {
    fn new(socket: TcpStream, other: SocketAddr, state: TlsLinkState) -> io::Result<Self> {
        set_up(&socket)?;
        Ok(Self { socket, other, state: Mutex::new(state), agent: OnceLock::new() })
    }

    /// Creates a link from an accepted connection.
    pub fn accepted(socket: TcpStream, from: SocketAddr, credentials: Credentials) -> io::Result<Self> {
        Self::new(socket, from, TlsLinkState::Accepted(credentials))
    }

    /// Opens a link to an address.
    pub fn dial(
        endpoint: &str,
        address: SocketAddr,
        credentials: &Credentials,
    ) -> Result<Self, CarrierError> {
        let system = |error| CarrierError::System { endpoint: endpoint.into(), error };
        let socket =
            TcpStream::connect_timeout(&address, CONNECT_TIMEOUT).map_err(|error| match error.kind() {
                ErrorKind::ConnectionRefused => CarrierError::Nobody { endpoint: endpoint.into() },
                _ => system(error),
            })?;
        let begin = || {
            let loaded = credentials.read().map_err(|error| io::Error::other(error.message))?;
            let connection = Box::new(TlsConnection::dial(loaded)?);
            let link = Self::new(socket, address, TlsLinkState::Open(connection))?;
            link.shake_hands()?;
            Ok(link)
        };
        begin().map_err(system)
    }

    fn shake_hands(&self) -> io::Result<()> {
        let left = timer(CONNECT_TIMEOUT);
        while self.agent.get().is_none() {
            // Nothing is sent before, so no packet comes that would be lost here.
            let waits_for = self.listen(|connection| {
                connection.take(&self.socket, &mut [])?;
                connection.flush(&self.socket)?;
                Ok(interest(connection))
            })?;
            if left().is_zero() {
                let late = format!("no handshake within {} ms", CONNECT_TIMEOUT.as_millis());
                return Err(io::Error::new(ErrorKind::TimedOut, late));
            }
            if self.agent.get().is_none() {
                wait_ready(&self.socket, waits_for, left())?;
            }
        }
        Ok(())
    }

    fn state(&self) -> MutexGuard<'_, TlsLinkState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads from the connection; an error ends the link.
    fn listen<T>(&self, call: impl FnOnce(&mut TlsConnection) -> io::Result<T>) -> io::Result<T> {
        let mut state = self.state();
        let result = self.with(&mut state, call);
        if let Err(error) = &result {
            self.end(&mut state, error.kind(), &error.to_string());
        }
        result
    }

    /// Writes to the connection.
    /// A failure does not end the link, as received data may give the reason.
    fn write<T>(&self, call: impl FnOnce(&mut TlsConnection) -> io::Result<T>) -> io::Result<T> {
        self.with(&mut self.state(), call)
    }

    fn with<T>(
        &self,
        state: &mut TlsLinkState,
        call: impl FnOnce(&mut TlsConnection) -> io::Result<T>,
    ) -> io::Result<T> {
        let connection = state.open()?;
        let result = call(connection);
        if let Some(agent) = connection.agent() {
            self.agent.get_or_init(|| agent.into());
        }
        result
    }

    /// Ends the link with that reason, unless it has ended.
    fn end(&self, state: &mut TlsLinkState, kind: ErrorKind, reason: &str) {
        if let TlsLinkState::Open(connection) = state {
            connection.finish(&self.socket);
        }
        if !matches!(state, TlsLinkState::Closed(..)) {
            *state = TlsLinkState::Closed(kind, reason.into());
            // It may have been the other end that ended it.
            let _ = self.socket.shutdown(Shutdown::Both);
        }
    }
}

impl TlsLinkState {
    fn open(&mut self) -> io::Result<&mut TlsConnection> {
        if let Self::Accepted(credentials) = self {
            let loaded = credentials
                .read()
                .map_err(|error| io::Error::new(ErrorKind::PermissionDenied, error.message))?;
            *self = Self::Open(Box::new(TlsConnection::accept(loaded)?));
        }
        match self {
            Self::Open(connection) => Ok(connection),
            Self::Closed(kind, reason) => Err(io::Error::new(*kind, reason.clone())),
            Self::Accepted(..) => unreachable!("it was opened above"),
        }
    }
}

/// Returns the events to wait for at the socket.
fn interest(connection: &TlsConnection) -> PollFlags {
    if connection.is_full() { PollFlags::IN | PollFlags::OUT } else { PollFlags::IN }
}

impl Link for TlsLink {
    fn send(&self, packet: &[u8]) -> io::Result<bool> {
        self.write(|connection| {
            connection.flush(&self.socket)?;
            // The system says so when a third is free, so all of the packet has room then.
            if connection.is_full() || wait_ready(&self.socket, PollFlags::OUT, Duration::ZERO)?.is_empty() {
                return Ok(false);
            }
            connection.put(packet)?;
            connection.flush(&self.socket)?;
            Ok(true)
        })
    }

    fn wait_for_room(&self, limit: Duration) -> io::Result<()> {
        wait_ready(&self.socket, PollFlags::OUT, limit)?;
        self.write(|connection| connection.flush(&self.socket))
    }

    fn receive(&self, packet: &mut [u8], limit: Duration) -> io::Result<Option<usize>> {
        let left = timer(limit);
        loop {
            let (length, waits_for) = self.listen(|connection| {
                let length = connection.take(&self.socket, packet)?;
                // Keep-alive data; a loss shows as silence.
                let _ = connection.flush(&self.socket);
                Ok((length, interest(connection)))
            })?;
            if length.is_some() || left().is_zero() {
                return Ok(length);
            }
            wait_ready(&self.socket, waits_for, left())?;
        }
    }

    fn largest(&self) -> usize {
        MAX_PACKET_SIZE
    }

    fn authenticated(&self) -> Option<&str> {
        self.agent.get().map(String::as_str)
    }

    fn origin(&self) -> Option<String> {
        Some(self.other.ip().to_string())
    }

    fn close(&self) {
        self.end(&mut self.state(), ErrorKind::ConnectionAborted, "the link was closed");
    }
}

impl Drop for TlsLink {
    fn drop(&mut self) {
        self.close();
    }
}
