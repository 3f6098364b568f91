//! Device's end of either kind of line.

use std::fs::OpenOptions;
use std::io::{Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

use super::terminal::{PseudoTerminal, TerminalError};

/// End of a line that belongs to the device.
#[derive(Debug)]
pub(crate) enum LineEnd {
    Terminal(PseudoTerminal),
    Server { listener: TcpListener, client: Option<TcpStream> },
}

impl LineEnd {
    pub fn terminal(link: Option<&Path>) -> Result<Self, TerminalError> {
        let terminal = PseudoTerminal::open(link)?;
        // Until its other end was open once, a terminal does not say whether it is.
        let _ = OpenOptions::new().read(true).custom_flags(libc::O_NOCTTY).open(terminal.path());
        Ok(Self::Terminal(terminal))
    }

    pub fn server(port: u16) -> std::io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        listener.set_nonblocking(true)?;
        Ok(Self::Server { listener, client: None })
    }

    /// Returns the address for a driver: a path, or `tcp://HOST:PORT`.
    pub fn name(&self) -> String {
        match self {
            Self::Terminal(terminal) => terminal.path().display().to_string(),
            Self::Server { listener, .. } => listener
                .local_addr()
                .map_or_else(|error| error.to_string(), |address| format!("tcp://{address}")),
        }
    }

    pub fn port(&self) -> u16 {
        match self {
            Self::Terminal(_) => 0,
            Self::Server { listener, .. } => listener.local_addr().map_or(0, |address| address.port()),
        }
    }

    /// Returns whether a driver has it open, and whether one has just opened it.
    /// The second is true also for another driver than before.
    pub fn poll(&mut self, was_open: bool) -> (bool, bool) {
        match self {
            Self::Terminal(terminal) => {
                let is_open = terminal.is_open();
                (is_open, is_open && !was_open)
            }
            Self::Server { listener, client } => {
                let newcomer = listener.accept().ok().map(|(stream, _)| stream);
                let is_new = newcomer.is_some();
                if let Some(stream) = newcomer {
                    let _ = stream.set_nonblocking(true);
                    let _ = stream.set_nodelay(true);
                    *client = Some(stream);
                }
                (client.is_some(), is_new)
            }
        }
    }

    pub fn read(&mut self, bytes: &mut [u8]) -> usize {
        match self {
            Self::Terminal(terminal) => terminal.read(bytes),
            Self::Server { client, .. } => {
                let Some(stream) = client else { return 0 };
                match stream.read(bytes) {
                    Ok(0) => {
                        *client = None;
                        0
                    }
                    Ok(count) => count,
                    Err(_) => 0,
                }
            }
        }
    }

    /// Writes what there is room for; returns the number of bytes.
    pub fn write(&mut self, bytes: &[u8]) -> usize {
        match self {
            Self::Terminal(terminal) => terminal.write(bytes),
            Self::Server { client, .. } => {
                client.as_mut().map_or(bytes.len(), |stream| stream.write(bytes).unwrap_or(0))
            }
        }
    }
}
