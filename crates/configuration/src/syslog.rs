use std::net::SocketAddr;
use std::path::PathBuf;

/// Address of a syslog.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SyslogAddress {
    /// Datagram socket of this machine, with the format of RFC 3164.
    Socket(PathBuf),
    /// UDP server, with the format of RFC 5424.
    Server(SocketAddr),
}

impl Default for SyslogAddress {
    /// Returns the socket of this machine's syslog.
    fn default() -> Self {
        Self::Socket("/dev/log".into())
    }
}
