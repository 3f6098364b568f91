//! Device at a TCP port, without ever waiting but for the connection.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use crate::error::PortError;
use crate::serial_port::wait;

/// Timeout of a connection; the thread of a driver can't be stopped meanwhile.
const TIMEOUT: Duration = Duration::from_millis(400);

/// Connection to a device with a network.
#[derive(Debug)]
pub(crate) struct TcpConnection {
    stream: TcpStream,
    address: String,
}

impl TcpConnection {
    pub fn open(address: &str) -> Result<Self, PortError> {
        let stream = connect(address)
            .map_err(|error| PortError::Unreachable { address: address.into(), reason: error.to_string() })?;
        Ok(Self { stream, address: address.into() })
    }

    pub fn wait(&self, limit: Duration) -> Result<(), PortError> {
        wait(&self.stream, limit).map_err(|error| self.failed(&error.into()))
    }

    pub fn read(&self, bytes: &mut [u8]) -> Result<usize, PortError> {
        match (&self.stream).read(bytes) {
            Ok(0) if !bytes.is_empty() => Err(PortError::Disconnected(self.address.clone())),
            Ok(count) => Ok(count),
            Err(error) if is_passing(&error) => Ok(0),
            Err(error) => Err(self.failed(&error)),
        }
    }

    pub fn write(&self, bytes: &mut Vec<u8>) -> Result<(), PortError> {
        while !bytes.is_empty() {
            match (&self.stream).write(bytes) {
                Ok(count) => drop(bytes.drain(..count)),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) => return Err(self.failed(&error)),
            }
        }
        Ok(())
    }

    fn failed(&self, error: &std::io::Error) -> PortError {
        match error.kind() {
            ErrorKind::ConnectionReset | ErrorKind::BrokenPipe | ErrorKind::ConnectionAborted => {
                PortError::Disconnected(self.address.clone())
            }
            _ => PortError::Unreachable { address: self.address.clone(), reason: error.to_string() },
        }
    }
}

fn is_passing(error: &std::io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

fn connect(address: &str) -> std::io::Result<TcpStream> {
    let mut last = std::io::Error::new(ErrorKind::NotFound, "its name has no address");
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, TIMEOUT) {
            Ok(stream) => {
                stream.set_nonblocking(true)?;
                stream.set_nodelay(true)?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(last)
}
