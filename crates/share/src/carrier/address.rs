//! Network addresses of agents.

use std::io;
use std::net::{IpAddr, Ipv6Addr, SocketAddr, ToSocketAddrs};
use std::sync::mpsc::sync_channel;
use std::thread;
use std::time::Duration;

use crate::carrier::CarrierError;

/// Host and port as written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Address {
    host: String,
    port: u16,
}

impl Address {
    /// Parses `HOST:PORT`; an IPv6 address is in brackets.
    pub fn parse(text: &str) -> Option<Self> {
        let (host, port) = text.rsplit_once(':')?;
        let port = port.parse().ok().filter(|port| *port != 0)?;
        let inner = host.strip_prefix('[').and_then(|host| host.strip_suffix(']'));
        let good = match inner {
            Some(inner) => inner.parse::<Ipv6Addr>().is_ok(),
            None => host.bytes().all(|c| c.is_ascii_alphanumeric() || c == b'.' || c == b'-'),
        };
        (good && !host.is_empty()).then(|| Self { host: host.into(), port })
    }

    /// Returns whether the host may be this machine.
    /// A host name is valid: it is resolved later.
    pub fn may_be_here(&self) -> bool {
        let address: Option<IpAddr> = self.host.trim_matches(['[', ']']).parse().ok();
        address.is_none_or(|address| address.is_loopback())
    }

    /// Resolves the host within `limit`; returns at least one address.
    pub fn resolve(&self, endpoint: &str, limit: Duration) -> Result<Vec<SocketAddr>, CarrierError> {
        let unknown = |reason: String| CarrierError::System {
            endpoint: endpoint.into(),
            error: io::Error::new(
                io::ErrorKind::NotFound,
                format!("host `{}` is not found: {reason}", self.host),
            ),
        };
        let text = format!("{}:{}", self.host, self.port);
        if let Ok(address) = text.parse() {
            return Ok(vec![address]);
        }
        // The system's resolver may take far longer; that continues without this thread.
        let (sender, found) = sync_channel(1);
        let look = move || {
            // The waiting thread may have given up.
            let _ = sender.send(text.to_socket_addrs().map(Iterator::collect::<Vec<_>>));
        };
        thread::Builder::new()
            .name("resolver".into())
            .spawn(look)
            .map_err(|error| CarrierError::System { endpoint: endpoint.into(), error })?;
        match found.recv_timeout(limit) {
            Ok(Ok(addresses)) if addresses.is_empty() => Err(unknown("it has no address".into())),
            Ok(Ok(addresses)) => Ok(addresses),
            Ok(Err(error)) => Err(unknown(error.to_string())),
            Err(_) => Err(unknown(format!("no answer within {} ms", limit.as_millis()))),
        }
    }
}
