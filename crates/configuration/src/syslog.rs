use std::net::SocketAddr;
use std::path::PathBuf;

/// Where a syslog is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SyslogAddress {
    /// A datagram socket of this computer, spoken to as RFC 3164 has it.
    Socket(PathBuf),
    /// A server, spoken to over UDP as RFC 5424 has it.
    Server(SocketAddr),
}

impl Default for SyslogAddress {
    /// The socket of this computer's own syslog.
    fn default() -> Self {
        Self::Socket("/dev/log".into())
    }
}
