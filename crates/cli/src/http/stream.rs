//! A connection to an agent, with TLS or at this computer.

use std::io::{Read, Result, Write};
use std::net::TcpStream;
use std::path::Path;
use std::time::Duration;

use super::address::Address;
#[cfg(feature = "tls")]
use super::secure::{self, Secure};
use super::trouble::Trouble;

/// How long one of the addresses of a name may take.
const CONNECT: Duration = Duration::from_secs(5);

/// How long an agent may take for the head of an answer, and to take what it is told.
const PATIENCE: Duration = Duration::from_secs(60);

/// What goes to and fro.
#[derive(Debug)]
pub enum Stream {
    Open(TcpStream),
    #[cfg(feature = "tls")]
    Secure(Box<Secure>),
}

impl Stream {
    /// Connects to an agent. `certificate` is the file of whom to trust, instead of whom the system trusts.
    pub fn connect(address: &Address, certificate: Option<&Path>) -> std::result::Result<Self, Trouble> {
        let unreached = |error: std::io::Error| Trouble::Unreached {
            address: address.to_string(),
            reason: error.to_string(),
        };
        let found = address.resolve().map_err(unreached)?;
        if !address.is_secure && !found.iter().all(|found| found.ip().is_loopback()) {
            return Err(Trouble::Open { address: address.to_string() });
        }
        let mut last = None;
        for found in found {
            match TcpStream::connect_timeout(&found, CONNECT) {
                Ok(stream) => {
                    stream.set_read_timeout(Some(PATIENCE)).map_err(unreached)?;
                    stream.set_write_timeout(Some(PATIENCE)).map_err(unreached)?;
                    // Commands are small, and wait for nothing.
                    stream.set_nodelay(true).map_err(unreached)?;
                    return Self::over(stream, address, certificate);
                }
                Err(error) => last = Some(error),
            }
        }
        Err(unreached(last.unwrap_or_else(|| std::io::Error::other("there is no address"))))
    }

    fn over(
        stream: TcpStream,
        address: &Address,
        certificate: Option<&Path>,
    ) -> std::result::Result<Self, Trouble> {
        if !address.is_secure {
            return Ok(Self::Open(stream));
        }
        #[cfg(feature = "tls")]
        return secure::begin(stream, address, certificate).map(|secure| Self::Secure(Box::new(secure)));
        #[cfg(not(feature = "tls"))]
        {
            let _ = certificate;
            Err(Trouble::WithoutTls { address: address.to_string() })
        }
    }

    /// How long a read may take from now on.
    pub fn wait_at_most(&self, time: Option<Duration>) -> Result<()> {
        match self {
            Self::Open(stream) => stream.set_read_timeout(time),
            #[cfg(feature = "tls")]
            Self::Secure(secure) => secure.sock.set_read_timeout(time),
        }
    }
}

impl Read for Stream {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        match self {
            Self::Open(stream) => stream.read(buffer),
            #[cfg(feature = "tls")]
            Self::Secure(secure) => secure.read(buffer),
        }
    }
}

impl Write for Stream {
    fn write(&mut self, buffer: &[u8]) -> Result<usize> {
        match self {
            Self::Open(stream) => stream.write(buffer),
            #[cfg(feature = "tls")]
            Self::Secure(secure) => secure.write(buffer),
        }
    }

    fn flush(&mut self) -> Result<()> {
        match self {
            Self::Open(stream) => stream.flush(),
            #[cfg(feature = "tls")]
            Self::Secure(secure) => secure.flush(),
        }
    }
}
