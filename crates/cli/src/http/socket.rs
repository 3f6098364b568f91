//! The WebSocket over which an agent is asked as at its local socket.

use std::fmt;
use std::io::{Error, ErrorKind, Result};
use std::time::Duration;

use slate::runtime::remote::{Client, Wire};
use tungstenite::handshake::client::generate_key;
use tungstenite::handshake::derive_accept_key;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Message, WebSocket};

use super::stream::Stream;
use super::trouble::Trouble;
use super::{Access, BASE, Request};
use crate::failure::Failure;
use crate::watch::now;

/// The longest answer, bytes: a tool trusts its agent more than the agent its tools.
const ANSWER: usize = 1 << 28;

/// Connects to an agent.
pub fn connect(access: &Access) -> std::result::Result<Client, Failure> {
    let (address, key) = (access.address.to_string(), generate_key());
    let path = format!("{BASE}/remote");
    let request = Request { method: "GET", path: &path, key: Some(&key), ..Request::default() };
    let response = access.ask(&request)?.well()?;
    if response.status != 101 || response.accepted != Some(derive_accept_key(key.as_bytes())) {
        let reason = format!("it opens no WebSocket (status {})", response.status);
        return Err(Trouble::NoHttp { address, reason }.into());
    }
    let (stream, read) = response.into_stream();
    let settings = WebSocketConfig::default().max_message_size(Some(ANSWER)).max_frame_size(Some(ANSWER));
    let socket = WebSocket::from_partially_read(stream, read, Role::Client, Some(settings));
    Ok(Client::over(&address, Box::new(WebWire(socket)))?)
}

/// Messages over a WebSocket.
struct WebWire(WebSocket<Stream>);

impl fmt::Debug for WebWire {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("WebWire").finish_non_exhaustive()
    }
}

impl Wire for WebWire {
    fn send(&mut self, message: &str) -> Result<()> {
        self.0.send(Message::text(message)).map_err(lost)
    }

    fn receive(&mut self, within: Duration) -> Result<Vec<u8>> {
        let until = now() + within;
        loop {
            // An agent that only says that it is there has not answered.
            let left = until.saturating_duration_since(now());
            if left.is_zero() {
                return Err(ErrorKind::TimedOut.into());
            }
            self.0.get_ref().wait_at_most(Some(left))?;
            match self.0.read().map_err(lost)? {
                Message::Text(text) => return Ok(text.as_bytes().to_vec()),
                Message::Binary(bytes) => return Ok(bytes.to_vec()),
                Message::Close(_) => return Err(closed()),
                Message::Ping(_) | Message::Pong(_) | Message::Frame(_) => {}
            }
        }
    }
}

fn closed() -> Error {
    Error::new(ErrorKind::UnexpectedEof, "it has closed the connection")
}

fn lost(error: tungstenite::Error) -> Error {
    use tungstenite::error::ProtocolError::ResetWithoutClosingHandshake;
    match error {
        tungstenite::Error::Io(error) if error.kind() == ErrorKind::WouldBlock => ErrorKind::TimedOut.into(),
        tungstenite::Error::Io(error) => error,
        tungstenite::Error::ConnectionClosed
        | tungstenite::Error::AlreadyClosed
        | tungstenite::Error::Protocol(ResetWithoutClosingHandshake) => closed(),
        other => Error::new(ErrorKind::InvalidData, other.to_string()),
    }
}
